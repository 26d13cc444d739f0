// A scan as the page holds it: the nominal profile, and for each bin of station its lowest and its highest point.
// However many points were measured, the memory stays the same.

import { CLOSED, COLUMNS, DEVIATION, FOOT_X, FOOT_Y, HEADER_AT, HEADER_BYTES, NOMINAL, NONCONFORM, NORMAL_X, NORMAL_Y, POINTS, STATION,
  UNCERTAIN, VERDICT } from "./protocol.js";

/** @import { ZoneLimits } from "./protocol.js" */

/**
 * A point of the scan: which of the two in its bin it is, and its measured place in mm.
 * @typedef {{ side: number, bin: number, station: number, deviation: number, verdict: number, x: number, y: number }} HeldPoint
 */

/** How a point is coloured and marked: "near" a limit is more than 80 % of the tolerance. */
export const CLASSES = /** @type {const} */ (["in", "near", "not-proven", "over", "under"]);
/** @typedef {(typeof CLASSES)[number]} PointClass */

const NEAR = 0.8;

export class Points {
  constructor() {
    this.generation = -1;
    this.newestMs = 0; // when the newest verdict was given, ms since 1970
    this.bins = 0;
    this.held = 0; // bins that hold a point
    this.sides = emptySides(0);
  }

  /**
   * Forget every point.
   * @param {number} bins
   */
  clear(bins) {
    this.bins = bins;
    this.held = 0;
    this.sides = emptySides(bins);
  }

  /**
   * Take the bins that changed. Another generation says that all points sent before are void.
   * @param {ArrayBuffer} buffer
   */
  take(buffer) {
    const { generation, rows, timeMs, number: bins } = headerOf(buffer);
    if (generation !== this.generation || bins !== this.bins) this.clear(bins);
    this.generation = generation;
    this.newestMs = timeMs;
    const changed = new Uint32Array(buffer, HEADER_BYTES, rows);
    for (const bin of changed) if (this.isEmpty(bin)) this.held++;
    this.sides.flat().forEach((column, k) => {
      const values = new Float32Array(buffer, HEADER_BYTES + 4 * rows * (1 + k), rows);
      changed.forEach((bin, row) => (column[bin] = values[row]));
    });
  }

  /** @param {number} bin */
  isEmpty(bin) {
    return Number.isNaN(this.sides[0][DEVIATION][bin]);
  }

  /**
   * @param {number} side 0 for the lowest point of the bin, 1 for the highest
   * @param {number} bin
   * @returns {HeldPoint}
   */
  at(side, bin) {
    const columns = this.sides[side], deviation = columns[DEVIATION][bin];
    return {
      side, bin, deviation, station: columns[STATION][bin], verdict: columns[VERDICT][bin],
      x: columns[FOOT_X][bin] + deviation * columns[NORMAL_X][bin], y: columns[FOOT_Y][bin] + deviation * columns[NORMAL_Y][bin],
    };
  }

  /**
   * The point for which a measure is least, among the bins from `first` to `last`; null where there is none.
   * @param {(side: number, bin: number) => number} measure
   * @returns {HeldPoint | null}
   */
  least(measure, first = 0, last = this.bins - 1) {
    let best = null, least = Infinity;
    for (let bin = first; bin <= last; bin++) {
      if (this.isEmpty(bin)) continue;
      for (let side = 0; side < 2; side++) {
        const value = measure(side, bin);
        if (value < least) [least, best] = [value, [side, bin]];
      }
    }
    return best && this.at(best[0], best[1]);
  }

  /**
   * The point farthest from the middle of the zone.
   * @param {ZoneLimits} zone
   */
  worst(zone) {
    return this.least((side, bin) => -Math.abs(this.sides[side][DEVIATION][bin] - middleOf(zone)));
  }
}

export class Nominal {
  /**
   * Samples of the profile: station, place and outward normal in mm; NaN in every column between two pieces.
   * @param {Float32Array[]} columns
   * @param {boolean} closed
   * @param {number} length of the whole profile, mm
   */
  constructor(columns, closed, length) {
    const [station, x, y, nx, ny] = columns;
    this.station = station;
    this.x = x;
    this.y = y;
    this.nx = nx;
    this.ny = ny;
    this.rows = x.length;
    this.length = length;
    this.pieces = piecesOf(x);
    this.closed = closed && this.pieces.length === 1; // as one line without a break
    const [knownX, knownY] = [x.filter(isKnown), y.filter(isKnown)];
    this.box = [Math.min(...knownX), Math.min(...knownY), Math.max(...knownX), Math.max(...knownY)];
  }

  /** @param {ArrayBuffer} buffer */
  static decode(buffer) {
    const { rows, flags, number: length } = headerOf(buffer);
    const columns = Array.from({ length: 5 }, (_, k) => new Float32Array(buffer, HEADER_BYTES + 4 * rows * k, rows));
    return new Nominal(columns, (flags & CLOSED) !== 0, length);
  }

  /**
   * Index of the sample whose station is nearest.
   * @param {number} station
   */
  nearest(station) {
    let best = 0;
    this.station.forEach((value, k) => {
      if (Math.abs(value - station) < Math.abs(this.station[best] - station)) best = k;
    });
    return best;
  }
}

export const NO_NOMINAL = new Nominal(Array.from({ length: 5 }, () => new Float32Array(0)), false, 0);

export class Scan {
  constructor() {
    this.nominal = NO_NOMINAL;
    this.points = new Points();
  }

  clear() {
    this.nominal = NO_NOMINAL;
    this.points.clear(0);
  }

  /**
   * Take a binary message. A nominal begins another scan: points of the one before must not be drawn on it.
   * @param {ArrayBuffer} buffer
   */
  take(buffer) {
    const { kind } = headerOf(buffer);
    if (kind === POINTS) this.points.take(buffer);
    if (kind !== NOMINAL) return;
    this.nominal = Nominal.decode(buffer);
    this.points.clear(0);
  }
}

/** @param {ArrayBuffer} buffer */
function headerOf(buffer) {
  const view = new DataView(buffer), whole = (/** @type {number} */ at) => view.getUint32(at, true);
  const { kind, generation, rows, flags, time_ms, number } = HEADER_AT;
  return {
    kind: whole(kind), generation: whole(generation), rows: whole(rows), flags: whole(flags),
    timeMs: view.getFloat64(time_ms, true), number: view.getFloat64(number, true),
  };
}

/** @param {number} value */
function isKnown(value) {
  return !Number.isNaN(value);
}

/**
 * The lowest and the highest point of each bin, column by column; NaN where a bin is empty.
 * @param {number} bins
 */
function emptySides(bins) {
  return [0, 1].map(() => Array.from({ length: COLUMNS }, () => new Float32Array(bins).fill(NaN)));
}

/**
 * First and last index of each piece between samples that are not a number.
 * @param {Float32Array} values
 */
function piecesOf(values) {
  /** @type {[number, number][]} */
  const pieces = [];
  let first = 0;
  for (let k = 0; k <= values.length; k++) {
    if (k < values.length && isKnown(values[k])) continue;
    if (k > first) pieces.push([first, k - 1]);
    first = k + 1;
  }
  return pieces;
}

/** @param {Pick<ZoneLimits, "lower_mm" | "upper_mm">} zone */
export const middleOf = (zone) => (zone.lower_mm + zone.upper_mm) / 2;

/**
 * How much of the tolerance a deviation uses: 1 at a limit.
 * @param {number} deviation
 * @param {Pick<ZoneLimits, "lower_mm" | "upper_mm">} zone
 */
export function toleranceUse(deviation, zone) {
  return Math.abs(deviation - middleOf(zone)) / ((zone.upper_mm - zone.lower_mm) / 2);
}

/**
 * @param {number} deviation
 * @param {number} verdict
 * @param {Pick<ZoneLimits, "lower_mm" | "upper_mm">} zone
 * @returns {PointClass}
 */
export function classOf(deviation, verdict, zone) {
  if (verdict === NONCONFORM) return deviation > middleOf(zone) ? "over" : "under";
  if (verdict === UNCERTAIN) return "not-proven";
  return toleranceUse(deviation, zone) > NEAR ? "near" : "in";
}
