// Draws a surface by WebGL: every voxel's worst point as a dot, nearer ones before farther ones, bad ones larger and before good ones.

import { SURFACE_COLOURS } from "./protocol.js";
import { WORDS } from "./surface_scan.js";

/** @import { ZoneLimits } from "./protocol.js" */
/** @import { Rows, SurfaceScan } from "./surface_scan.js" */
/** @import { Turn } from "./turn.js" */
/** @typedef {Record<string, WebGLUniformLocation | null>} Places */
/** @typedef {"nominal" | "points"} Drawn */
/**
 * What was uploaded of some rows, and which of them are drawn where not all are.
 * @typedef {{ rows: Rows | null, buffer: WebGLBuffer | null, room: number, few: Uint32Array | null, chosen: WebGLBuffer | null }} Uploaded
 */

const STRIDE = 4 * WORDS;
export const WIDER = 2; // than places of the nominal are apart is a dot of them
export const BEHIND = 2.5; // voxels that the nominal is drawn behind its place, so that it shows only where nothing was measured
const LEAST_PX = 2;
export const BAD_PX = 2; // more for each step from within over not proven to out of tolerance
const ROUND_PX = 6; // from this size on a dot is drawn round

const VERTEX = `
attribute vec4 point;
attribute vec3 normal;
uniform mat3 axes;
uniform vec3 centre;
uniform vec4 place;      // scale to the right and up, shift to the right and up
uniform float depth;     // of the part, mm
uniform float back;      // how far behind its place a dot lies, mm
uniform float size_mm;   // of a voxel
uniform vec3 zone;       // lower and upper limit, guard
uniform vec2 size;       // of a dot, and more for each step of badness, px
uniform float bare;      // 1 for the nominal itself
uniform vec3 lower, middle, upper, above, below, unproven, unmeasured;
varying vec3 colour;
varying float isRound;

void main() {
  vec3 seen = (point.xyz - centre) * axes;
  float facing = dot(normalize(normal + vec3(1e-6)), axes[2]);
  float beyond = max(zone.x - point.w, point.w - zone.y);
  float bad = bare > 0.5 ? 0.0 : beyond > zone.z ? 2.0 : beyond > -zone.z ? 1.0 : 0.0;
  float share = clamp((point.w - zone.x) / (zone.y - zone.x), 0.0, 1.0);
  vec3 within = share < 0.5 ? mix(lower, middle, 2.0 * share) : mix(middle, upper, 2.0 * share - 1.0);
  vec3 shown = bare > 0.5 ? unmeasured : bad > 1.5 ? (point.w > zone.y ? above : below) : bad > 0.5 ? unproven : within;
  colour = shown * (0.55 + 0.45 * abs(facing)) * (facing < 0.0 ? 0.6 : 1.0);
  float before = facing < 0.0 ? 0.0 : 0.5 * bad * size_mm;
  gl_Position = vec4(seen.xy * place.xy + place.zw, (back - before - seen.z) / depth, 1.0);
  gl_PointSize = size.x + bad * size.y;
  isRound = gl_PointSize > ${ROUND_PX.toFixed(1)} ? 1.0 : 0.0;
}`;

const FRAGMENT = `
precision mediump float;
varying vec3 colour;
varying float isRound;

void main() {
  if (isRound > 0.5 && length(gl_PointCoord - 0.5) > 0.5) discard;
  gl_FragColor = vec4(colour, 1.0);
}`;

export class SurfaceGl {
  /**
   * A painter on a canvas; null where the browser has no WebGL.
   * @param {HTMLCanvasElement} canvas
   */
  static on(canvas) {
    const gl = canvas.getContext("webgl", { antialias: false, preserveDrawingBuffer: true, powerPreference: "high-performance" });
    return gl && new SurfaceGl(canvas, gl);
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {WebGLRenderingContext} gl
   */
  constructor(canvas, gl) {
    this.canvas = canvas;
    this.gl = gl;
    this.canThin = gl.getExtension("OES_element_index_uint") !== null;
    /** @type {Places} */
    this.uniforms = {};
    /** @type {{ nominal: Uploaded, points: Uploaded }} */
    this.uploaded = { nominal: NOTHING(), points: NOTHING() };
    this.prepare();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.prepare();
      document.dispatchEvent(new Event("ink")); // everything is drawn anew
    });
  }

  prepare() {
    const { gl } = this, program = gl.createProgram();
    for (const [kind, text] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]])) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "point");
    gl.bindAttribLocation(program, 1, "normal");
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    const named = ["axes", "centre", "place", "depth", "back", "size_mm", "zone", "size", "bare", ...Object.keys(COLOURS)];
    this.uniforms = Object.fromEntries(named.map((name) => [name, gl.getUniformLocation(program, name)]));
    for (const [name, colour] of Object.entries(COLOURS)) gl.uniform3fv(this.uniforms[name], colour);
    this.uploaded = { nominal: NOTHING(), points: NOTHING() };
  }

  /**
   * @param {SurfaceScan} scan
   * @param {Turn} turn
   * @param {ZoneLimits} zone
   * @param {number} gap the diameter of the widest place without a point that counts as measured, mm
   * @param {number} ratio pixels of the canvas to one of the page
   * @param {number} level how many times voxels are doubled, so that fewer dots are drawn
   */
  draw(scan, turn, zone, gap, ratio, level = 0) {
    const { gl, uniforms } = this, { scale, radius } = turn, [right, up, towards] = turn.axes;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix3fv(uniforms.axes, false, [...right, ...up, ...towards]);
    gl.uniform3fv(uniforms.centre, turn.centre);
    const { width, height } = turn;
    gl.uniform4f(uniforms.place, (2 * scale) / width, (2 * scale) / height, (2 * turn.x) / width, (-2 * turn.y) / height);
    gl.uniform1f(uniforms.depth, 1.2 * radius);
    gl.uniform3f(uniforms.zone, zone.lower_mm, zone.upper_mm, zone.uncertainty_mm);
    const depth = this.canThin ? level : 0, size = scan.size * 2 ** depth, spacing = scan.spacing * 2 ** depth;
    const dot = Math.max(scan.dot(gap), WIDER * size), back = Math.max(BEHIND * size, dot, 0.5 * spacing);
    const middle = (zone.lower_mm + zone.upper_mm) / 2;
    gl.uniform1f(uniforms.size_mm, size);
    const [places, points] = depth ? [scan.nominal.few(spacing, 0), scan.points.few(size, middle)] : [null, null];
    this.drawRows("nominal", scan.nominal, places, WIDER * spacing * scale * ratio, back, 0);
    this.drawRows("points", scan.points, points, dot * scale * ratio, 0, BAD_PX * ratio);
  }

  /**
   * @param {Drawn} name
   * @param {Rows} rows
   * @param {Uint32Array | null} few which rows are drawn; null: all
   * @param {number} dot its width, px
   * @param {number} back mm
   * @param {number} worse px
   */
  drawRows(name, rows, few, dot, back, worse) {
    const { gl, uniforms } = this;
    if (!rows.count) return;
    this.upload(name, rows);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, STRIDE, 0);
    gl.vertexAttribPointer(1, 3, gl.BYTE, true, STRIDE, 16);
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(1);
    gl.uniform1f(uniforms.back, back);
    gl.uniform1f(uniforms.bare, name === "nominal" ? 1 : 0);
    gl.uniform2f(uniforms.size, Math.max(dot, LEAST_PX), worse);
    if (!few) return gl.drawArrays(gl.POINTS, 0, rows.count);
    this.choose(name, few);
    gl.drawElements(gl.POINTS, few.length, gl.UNSIGNED_INT, 0);
  }

  /**
   * Hand over which rows are drawn.
   * @param {Drawn} name
   * @param {Uint32Array} few
   */
  choose(name, few) {
    const { gl } = this, held = this.uploaded[name];
    held.chosen ??= gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, held.chosen);
    if (held.few !== few) gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, few, gl.DYNAMIC_DRAW);
    held.few = few;
  }

  /**
   * Hand over what changed of some rows.
   * @param {Drawn} name
   * @param {Rows} rows
   */
  upload(name, rows) {
    const { gl } = this, held = this.uploaded[name], [from, to] = rows.fetch();
    held.buffer ??= gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, held.buffer);
    if (held.rows !== rows || held.room !== rows.words.length) {
      gl.bufferData(gl.ARRAY_BUFFER, rows.words, gl.DYNAMIC_DRAW);
      [held.rows, held.room] = [rows, rows.words.length];
    } else if (to > from) gl.bufferSubData(gl.ARRAY_BUFFER, from * STRIDE, rows.words.subarray(from * WORDS, to * WORDS));
  }
}

/** @returns {Uploaded} */
const NOTHING = () => ({ rows: null, buffer: null, room: -1, few: null, chosen: null });

/** Red, green and blue from 0 to 1. @param {string} colour */
export const channelsOf = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255);

const COLOURS = {
  lower: channelsOf(SURFACE_COLOURS.lower), middle: channelsOf(SURFACE_COLOURS.middle), upper: channelsOf(SURFACE_COLOURS.upper),
  above: channelsOf(SURFACE_COLOURS.above), below: channelsOf(SURFACE_COLOURS.below), unproven: channelsOf(SURFACE_COLOURS.not_proven),
  unmeasured: channelsOf(SURFACE_COLOURS.not_measured),
};
