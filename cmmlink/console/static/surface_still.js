// Draws a surface without WebGL, as a still picture: dot by dot, each pixel the nearest, and of those near together the worst.

import { SURFACE_COLOURS } from "./protocol.js";
import { BAD_PX, BEHIND, WIDER, channelsOf } from "./surface_gl.js";
import { surfaceClassOf } from "./surface_scan.js";

/** @import { ZoneLimits } from "./protocol.js" */
/** @import { Rows, SurfaceScan } from "./surface_scan.js" */
/** @import { Turn } from "./turn.js" */
/** What is painted so far. @typedef {{ image: ImageData, depth: Float32Array, ratio: number }} Painting */

const LARGEST_PX = 24;

export class SurfaceStill {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
  }

  /**
   * @param {SurfaceScan} scan
   * @param {Turn} turn
   * @param {ZoneLimits} zone
   * @param {number} gap the diameter of the widest place without a point that counts as measured, mm
   * @param {number} ratio pixels of the canvas to one of the page
   */
  draw(scan, turn, zone, gap, ratio) {
    const pen = this.canvas.getContext("2d"), { width, height } = this.canvas;
    if (!pen || !width || !height) return;
    const painting = { image: pen.createImageData(width, height), depth: new Float32Array(width * height).fill(-Infinity), ratio };
    const { size, spacing } = scan, dot = scan.dot(gap), back = Math.max(BEHIND * size, dot, 0.5 * spacing);
    paint(painting, scan.nominal, turn, WIDER * spacing, () => [UNMEASURED, 0, -back]);
    paint(painting, scan.points, turn, dot, (row, facing) => {
      const deviation = scan.points.deviation(row), kind = surfaceClassOf(deviation, zone), bad = BADNESS[kind];
      return [kind === "within" ? withinZone(deviation, zone) : COLOURS[kind], bad, facing > 0 ? 0.5 * bad * size : 0];
    });
    pen.putImageData(painting.image, 0, 0);
  }
}

/**
 * @param {Painting} painting
 * @param {Rows} rows
 * @param {Turn} turn
 * @param {number} dot its width, mm
 * @param {(row: number, facing: number) => [colour: readonly number[], bad: number, before: number]} look how a row is drawn
 */
function paint({ image, depth, ratio }, rows, turn, dot, look) {
  const { width, height } = image, [, , towards] = turn.axes;
  const wide = Math.min(Math.max(dot * turn.scale * ratio, 2), LARGEST_PX);
  for (let row = 0; row < rows.count; row++) {
    const [x, y, near] = turn.seen(rows.place(row)), normal = rows.normal(row);
    const facing = (normal[0] * towards[0] + normal[1] * towards[1] + normal[2] * towards[2]) / 127;
    const [colour, bad, before] = look(row, facing), side = Math.round(wide + bad * BAD_PX);
    const light = 255 * (0.55 + 0.45 * Math.min(Math.abs(facing), 1)) * (facing < 0 ? 0.6 : 1);
    const [left, top] = [Math.round(x * ratio - side / 2), Math.round(y * ratio - side / 2)];
    for (let v = Math.max(top, 0); v < Math.min(top + side, height); v++) {
      for (let u = Math.max(left, 0); u < Math.min(left + side, width); u++) {
        const at = v * width + u;
        if (near + before <= depth[at]) continue;
        depth[at] = near + before;
        image.data.set([colour[0] * light, colour[1] * light, colour[2] * light, 255], 4 * at);
      }
    }
  }
}

const BADNESS = { within: 0, not_proven: 1, above: 2, below: 2 };
const COLOURS = {
  not_proven: channelsOf(SURFACE_COLOURS.not_proven), above: channelsOf(SURFACE_COLOURS.above), below: channelsOf(SURFACE_COLOURS.below),
};
const UNMEASURED = channelsOf(SURFACE_COLOURS.not_measured);
const [LOWER, MIDDLE, UPPER] = [SURFACE_COLOURS.lower, SURFACE_COLOURS.middle, SURFACE_COLOURS.upper].map(channelsOf);

/**
 * The colour of a deviation between the limits.
 * @param {number} deviation
 * @param {ZoneLimits} zone
 */
function withinZone(deviation, { lower_mm: lower, upper_mm: upper }) {
  const share = (2 * (deviation - lower)) / (upper - lower);
  const [from, to, part] = share < 1 ? [LOWER, MIDDLE, share] : [MIDDLE, UPPER, share - 1];
  return from.map((channel, k) => channel + (to[k] - channel) * part);
}
