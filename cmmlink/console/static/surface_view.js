// The view of a whole surface: it turns by mouse, fingers and keys, and every region out of tolerance stands in a table beside it.

import { buttonOf, byId, make, put, styleOf } from "./dom.js";
import { digitsFor, fixed, signed } from "./numbers.js";
import { SURFACE_COLOURS } from "./protocol.js";
import { SurfaceGl } from "./surface_gl.js";
import { surfaceClassOf } from "./surface_scan.js";
import { SurfaceStill } from "./surface_still.js";
import { Table, cell } from "./table.js";
import { Turn } from "./turn.js";
import { listenToTurning } from "./turning.js";
import { gettext, ngettext } from "./words.js";

/** @import { RunState, SurfaceRegion, WholeSurface, ZoneLimits } from "./protocol.js" */
/** @import { SurfacePoint, SurfaceScan } from "./surface_scan.js" */
/** @import { Spot } from "./turn.js" */

const REACH_PX = 14; // how far from the pointer a point is read out
const CLOSER = 6; // than the whole part a region is seen
const REST_MS = 250; // after the last movement everything is drawn in full
const SLOW_MS = 30; // between two pictures of a movement: fewer dots are drawn then, larger ones
const MOST_LEVELS = 2;
const SIGNS = { within: "\u25cf", not_proven: "\u25c6", above: "\u25b2", below: "\u25bc" };

export class SurfaceView {
  /**
   * @param {SurfaceScan} scan
   * @param {() => void} onChange hears that something is to be drawn
   */
  constructor(scan, onChange) {
    this.scan = scan;
    this.onChange = onChange;
    this.turn = new Turn();
    this.element = byId("surface");
    this.canvas = document.createElement("canvas");
    this.element.append(this.canvas);
    const gl = SurfaceGl.on(this.canvas);
    this.painter = gl ?? new SurfaceStill(this.canvas);
    byId("surface-still").hidden = gl !== null;
    this.ratio = 1;
    this.drawn = ""; // what stands on the sheet
    this.level = 0; // how coarse a movement is drawn
    this.pace = 0; // ms between the pictures of a movement, on average
    this.movedAt = -Infinity;
    this.resting = 0; // the timer that draws everything in full
    this.told = "";
    /** @type {RunState | null} */
    this.run = null;
    /** @type {SurfaceScan["box"]} */
    this.beheld = null;
    /** @type {Table<SurfaceRegion>} */
    this.table = new Table(byId("surface-regions"), (region) => this.rowOf(region), (region) => this.goTo(region));
    new ResizeObserver(() => this.fit()).observe(this.element);
    document.addEventListener("ink", () => this.touch());
    listenToTurning(this);
    buttonOf("surface-worst").addEventListener("click", () => this.goToWorst());
  }

  get isReady() {
    return this.scan.box !== null && this.run !== null;
  }

  /** Have everything drawn anew. */
  touch() {
    this.drawn = "";
    this.onChange();
  }

  fit() {
    const box = this.element.getBoundingClientRect();
    this.ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.max(1, Math.floor(box.width * this.ratio));
    this.canvas.height = Math.max(1, Math.floor(box.height * this.ratio));
    this.turn.resize(box.width, box.height);
    this.touch();
  }

  /** @param {RunState | null} run */
  show(run) {
    this.run = run;
    const surface = run?.surface ?? null;
    for (const id of ["profile-card", "strip-card"]) byId(id).hidden = surface !== null;
    for (const id of ["surface-card", "surface-regions-card"]) byId(id).hidden = surface === null;
    if (!run || !surface) return;
    const told = JSON.stringify([surface, run.zone, run.phase === "finished"]);
    if (told === this.told) return;
    this.told = told;
    this.showLegend(run.zone);
    this.showRegions(surface, run.phase === "finished");
  }

  /** Draw, where something changed. */
  draw() {
    const { scan, turn, run } = this;
    if (!run || !scan.box) return;
    if (this.beheld !== scan.box) {
      this.beheld = scan.box;
      turn.behold(scan.box);
    }
    const shown = JSON.stringify([scan.version, turn.axes, turn.scale, turn.x, turn.y, run.zone, this.isMoving]);
    if (shown === this.drawn) return;
    this.drawn = shown;
    this.painter.draw(scan, turn, run.zone, run.surface?.gap_max_mm ?? 0, this.ratio, this.isMoving ? this.level : 0);
  }

  get isMoving() {
    return performance.now() - this.movedAt < REST_MS;
  }

  /** The operator moves the part. Where pictures follow one another too slowly, until it rests dots are fewer: larger voxels' worst. */
  move() {
    const now = performance.now(), since = now - this.movedAt;
    this.pace = since < REST_MS ? 0.8 * this.pace + 0.2 * since : SLOW_MS / 2;
    if (this.pace > SLOW_MS && this.level < MOST_LEVELS) [this.level, this.pace] = [this.level + 1, SLOW_MS / 2];
    this.movedAt = now;
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.touch(), REST_MS);
    this.onChange();
  }

  /**
   * The nearest point to a place of the sheet that the part does not hide.
   * @param {number} x
   * @param {number} y
   * @returns {SurfacePoint | null}
   */
  nearest(x, y) {
    const { points, size } = this.scan, [, , towards] = this.turn.axes;
    /** @type {{ row: number, near: number, apart: number } | null} */
    let best = null;
    for (let row = 0; row < points.count; row++) {
      const [u, v, near] = this.turn.seen(points.place(row)), apart = Math.hypot(u - x, v - y);
      if (apart > REACH_PX || facing(points.normal(row), towards) < 0) continue;
      const isBefore = !best || near > best.near + size * 4, isNearer = best && near > best.near - size * 4 && apart < best.apart;
      if (isBefore || isNearer) best = { row, near, apart };
    }
    return best && { place: points.place(best.row), deviation: points.deviation(best.row) };
  }

  /** @param {SurfacePoint | null} point */
  readOut(point) {
    put("surface-words", point && this.run ? this.wordsOf(point.place, point.deviation, this.run.zone) : "");
  }

  /**
   * @param {Spot} place
   * @param {number} deviation
   * @param {ZoneLimits} zone
   */
  wordsOf([x, y, z], deviation, zone) {
    const sign = SIGNS[surfaceClassOf(deviation, zone)];
    const values = { deviation: signed(deviation, digitsFor(zone)), x: fixed(x, 3), y: fixed(y, 3), z: fixed(z, 3) };
    return `${sign} ${gettext("{deviation} mm at x {x}, y {y}, z {z} mm", values)}`;
  }

  goToWorst() {
    const worst = this.run?.worst;
    if (typeof worst?.z_mm === "number") this.goToPlace([worst.x_mm, worst.y_mm, worst.z_mm], worst.deviation_mm);
  }

  /** @param {SurfaceRegion} region */
  goTo({ x_mm: x, y_mm: y, z_mm: z, worst_mm: worst }) {
    this.goToPlace([x, y, z], worst);
  }

  /**
   * See a place from straight above, and read it out.
   * @param {Spot} place
   * @param {number} deviation
   */
  goToPlace(place, deviation) {
    if (!this.isReady) return;
    this.turn.goTo(place, this.normalAt(place), CLOSER);
    this.readOut({ place, deviation });
    this.onChange();
  }

  /**
   * The direction out of the material at a place: that of the nearest point held, or of the nominal.
   * @param {Spot} place
   * @returns {Spot}
   */
  normalAt([x, y, z]) {
    const rows = this.scan.points.count ? this.scan.points : this.scan.nominal;
    let nearest = 0, least = Infinity;
    for (let row = 0; row < rows.count; row++) {
      const [u, v, w] = rows.place(row), apart = (u - x) ** 2 + (v - y) ** 2 + (w - z) ** 2;
      if (apart < least) [nearest, least] = [row, apart];
    }
    return rows.normal(nearest);
  }

  /** @param {ZoneLimits} zone */
  showLegend(zone) {
    const { lower_mm: lower, upper_mm: upper, uncertainty_mm: guard } = zone, digits = digitsFor(zone);
    const limit = (/** @type {number} */ value) => signed(value, digits, 0);
    /** @type {[colours: string[], words: string][]} */
    const entries = [
      [[SURFACE_COLOURS.above], gettext("\u25b2 above {limit} mm", { limit: limit(upper + guard) })],
      [[SURFACE_COLOURS.lower, SURFACE_COLOURS.middle, SURFACE_COLOURS.upper],
        gettext("within {from} .. {to} mm", { from: limit(lower + guard), to: limit(upper - guard) })],
      [[SURFACE_COLOURS.below], gettext("\u25bc below {limit} mm", { limit: limit(lower - guard) })],
      [[SURFACE_COLOURS.not_measured], gettext("not measured")],
    ];
    if (guard > 0) entries.splice(1, 0, [[SURFACE_COLOURS.not_proven], gettext("\u25c6 between: not proven")]);
    byId("surface-legend").replaceChildren(...entries.map(([colours, words]) => {
      const item = make("li", words), swatch = document.createElement("i");
      styleOf(swatch).background = colours.length > 1 ? `linear-gradient(to right, ${colours.join(", ")})` : colours[0];
      swatch.setAttribute("aria-hidden", "true");
      item.prepend(swatch);
      return item;
    }));
  }

  /**
   * @param {WholeSurface} surface
   * @param {boolean} isFinal
   */
  showRegions({ regions, more, unmeasured, unmeasured_mm2: open }, isFinal) {
    const words = [
      isFinal ? ngettext("{count} region out of tolerance", "{count} regions out of tolerance", regions.length + more)
        : gettext("regions are told at the end"),
      more && ngettext("the worst is listed", "the {count} worst are listed", regions.length),
      unmeasured && ngettext("{count} place of {area} mm\u00b2 not measured", "{count} places of {area} mm\u00b2 not measured", unmeasured,
        { area: fixed(open, 1) }),
    ];
    put("surface-regions-words", words.filter(Boolean).join("; "));
    this.table.show(regions);
  }

  /** @param {SurfaceRegion} region */
  rowOf({ number, worst_mm: worst, area_mm2: area, points, x_mm: x, y_mm: y, z_mm: z }) {
    const zone = this.run?.zone ?? { lower_mm: 0, upper_mm: 0, uncertainty_mm: 0 };
    const numbers = [signed(worst, digitsFor(zone)), fixed(area, 2), String(points), ...[x, y, z].map((value) => fixed(value, 3))];
    return [cell(`${SIGNS[worst > (zone.lower_mm + zone.upper_mm) / 2 ? "above" : "below"]} ${number}`),
      ...numbers.map((words) => cell(words, "number"))];
  }
}

/**
 * @param {Spot} normal
 * @param {Spot} towards
 */
const facing = (normal, towards) => normal[0] * towards[0] + normal[1] * towards[1] + normal[2] * towards[2];
