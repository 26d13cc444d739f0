// A scan of a whole surface as the page holds it: the nominal as places, and the worst point of every voxel that was reached.
// However many points were measured, the memory stays the same.

import { HEADER_AT, HEADER_BYTES, NOMINAL_SURFACE, SURFACE_POINTS } from "./protocol.js";

/** @import { ZoneLimits } from "./protocol.js" */
/** @import { Box, Spot } from "./turn.js" */
/** @typedef {"within" | "not_proven" | "above" | "below"} SurfaceClass */
/** A point that is read out. @typedef {{ place: Spot, deviation: number }} SurfacePoint */

const CELLS = 2 ** 17; // of a size along each axis, on both sides of zero together
const WIDER = 2; // than a voxel is a dot, so that neighbours touch wherever in their voxels they lie
const APART = 0.7; // of the side of the square that a point stands for: half its diagonal
export const WORDS = 5; // of a row as it is held: x, y, z, deviation, and the normal in the bytes of the fifth

/** Rows of x, y, z, deviation and normal, 20 bytes each. */
export class Rows {
  /** @param {number} capacity */
  constructor(capacity) {
    this.count = 0;
    this.words = new Uint32Array(capacity * WORDS);
    this.floats = new Float32Array(this.words.buffer);
    this.bytes = new Int8Array(this.words.buffer);
    /** The rows that changed since they were last fetched: from, up to. @type {[number, number]} */
    this.changed = [0, 0];
    this.version = 0; // counts changes
    /** The worst rows of larger voxels, by their size. @type {Map<number, { version: number, middle: number, rows: Uint32Array }>} */
    this.fewer = new Map();
  }

  /** @param {number} count */
  grow(count) {
    if (count * WORDS > this.words.length) {
      const grown = new Uint32Array(Math.max(count, 2 * this.count, 4096) * WORDS);
      grown.set(this.words);
      this.words = grown;
      this.floats = new Float32Array(grown.buffer);
      this.bytes = new Int8Array(grown.buffer);
    }
    this.count = Math.max(this.count, count);
  }

  /** @param {number} row */
  touch(row) {
    const [from, to] = this.changed;
    this.version++;
    this.changed = from === to ? [row, row + 1] : [Math.min(from, row), Math.max(to, row + 1)];
  }

  /** The rows that changed since this was last asked: from, up to. */
  fetch() {
    const { changed } = this;
    this.changed = [0, 0];
    return changed;
  }

  /**
   * The worst row of every voxel of a size that is larger than what the rows came in.
   * @param {number} size mm
   * @param {number} middle of the zone, mm
   */
  few(size, middle) {
    const known = this.fewer.get(size);
    if (known?.version === this.version && known.middle === middle) return known.rows;
    /** @type {Map<number, number>} */
    const worst = new Map();
    for (let row = 0; row < this.count; row++) {
      const [x, y, z] = this.place(row).map((value) => Math.floor(value / size) + CELLS / 2), key = (x * CELLS + y) * CELLS + z;
      const held = worst.get(key);
      const isWorse = held === undefined || Math.abs(this.deviation(row) - middle) > Math.abs(this.deviation(held) - middle);
      if (isWorse) worst.set(key, row);
    }
    const rows = Uint32Array.from(worst.values());
    this.fewer.set(size, { version: this.version, middle, rows });
    return rows;
  }

  /**
   * @param {number} row
   * @returns {Spot}
   */
  place(row) {
    return [this.floats[WORDS * row], this.floats[WORDS * row + 1], this.floats[WORDS * row + 2]];
  }

  /** @param {number} row */
  deviation(row) {
    return this.floats[WORDS * row + 3];
  }

  /**
   * The direction out of the material, of a length of about 127.
   * @param {number} row
   * @returns {Spot}
   */
  normal(row) {
    const at = 4 * (WORDS * row + 4);
    return [this.bytes[at], this.bytes[at + 1], this.bytes[at + 2]];
  }
}

export class SurfaceScan {
  constructor() {
    this.generation = -1;
    this.newestMs = 0; // when the newest verdict was given, ms since 1970
    this.size = 0; // of a voxel, mm
    this.points = new Rows(0);
    this.nominal = new Rows(0);
    this.spacing = 0; // between places of the nominal, mm
    /** @type {Box | null} */
    this.box = null;
    this.version = 0; // counts everything that was taken
  }

  /**
   * How wide a dot is that stands for a point, mm: neighbours touch, and none covers more than counts as measured.
   * @param {number} gap the diameter of the widest place without a point that counts as measured
   */
  dot(gap) {
    const apart = this.spacing * Math.sqrt(this.nominal.count / Math.max(this.points.count, 1));
    return Math.max(WIDER * this.size, Math.min(WIDER * APART * apart, gap));
  }

  /** Forget everything. */
  clear() {
    Object.assign(this, new SurfaceScan(), { version: this.version + 1 });
  }

  /**
   * Take a message, if it tells of a surface.
   * @param {ArrayBuffer} buffer
   */
  take(buffer) {
    const view = new DataView(buffer), kind = view.getUint32(HEADER_AT.kind, true);
    if (kind !== SURFACE_POINTS && kind !== NOMINAL_SURFACE) return false;
    const rows = view.getUint32(HEADER_AT.rows, true), number = view.getFloat64(HEADER_AT.number, true);
    const words = new Uint32Array(buffer, HEADER_BYTES);
    this.version++;
    if (kind === NOMINAL_SURFACE) this.takeNominal(words, rows, number);
    else {
      this.newestMs = view.getFloat64(HEADER_AT.time_ms, true);
      this.takePoints(words, rows, number, view.getUint32(HEADER_AT.generation, true));
    }
    return true;
  }

  /**
   * @param {Uint32Array} words
   * @param {number} rows
   * @param {number} spacing
   */
  takeNominal(words, rows, spacing) {
    this.nominal = new Rows(rows);
    this.nominal.grow(rows);
    this.nominal.words.set(words);
    if (rows) this.nominal.changed = [0, rows];
    this.spacing = spacing;
    this.box = boxOf(this.nominal);
    this.points = new Rows(0);
    this.generation = -1;
  }

  /**
   * Take the voxels that changed: the number of each, and its row.
   * @param {Uint32Array} words
   * @param {number} rows
   * @param {number} size
   * @param {number} generation another one than before says that all points sent before are void
   */
  takePoints(words, rows, size, generation) {
    if (generation !== this.generation) this.points = new Rows(rows);
    this.generation = generation;
    this.size = size;
    const { points } = this, row = WORDS + 1;
    for (let k = 0; k < rows; k++) points.grow(words[k * row] + 1);
    for (let k = 0; k < rows; k++) {
      const slot = words[k * row];
      for (let word = 0; word < WORDS; word++) points.words[slot * WORDS + word] = words[k * row + 1 + word];
      points.touch(slot);
    }
  }
}

/**
 * How a point is coloured: by its deviation, the zone, and what has to be proven of it.
 * @param {number} deviation
 * @param {Pick<ZoneLimits, "lower_mm" | "upper_mm" | "uncertainty_mm">} zone
 * @returns {SurfaceClass}
 */
export function surfaceClassOf(deviation, { lower_mm: lower, upper_mm: upper, uncertainty_mm: guard }) {
  const beyond = Math.max(lower - deviation, deviation - upper);
  if (beyond > guard) return deviation > upper ? "above" : "below";
  return beyond <= -guard ? "within" : "not_proven";
}

/**
 * @param {Rows} rows
 * @returns {Box | null}
 */
function boxOf({ count, floats }) {
  if (!count) return null;
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let row = 0; row < count; row++) {
    for (let axis = 0; axis < 3; axis++) {
      const value = floats[WORDS * row + axis];
      low[axis] = Math.min(low[axis], value);
      high[axis] = Math.max(high[axis], value);
    }
  }
  return { low: [low[0], low[1], low[2]], high: [high[0], high[1], high[2]] };
}
