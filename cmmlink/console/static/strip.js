// Deviation against station: per pixel column the lowest and the highest point, so that no spike is hidden.

import { CONFORM, DEVIATION, STATION, VERDICT } from "./protocol.js";
import { Drawing } from "./drawing.js";
import { fixed, niceStep, signed } from "./numbers.js";
import { classOf, middleOf } from "./points.js";
import { INK, mark } from "./sheet.js";
import { gettext } from "./words.js";

/** @import { WorstPoint } from "./protocol.js" */
/** @import { HeldPoint, PointClass } from "./points.js" */
/** @import { Cursor, Place } from "./drawing.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {{ column: number, deviation: number, verdict: number }} Flag */

const MARK_EVERY_PX = 9;
const MEASURED_PX = 4; // height of the line at the foot that shows where something was measured

export class Strip extends Drawing {
  /**
   * @param {HTMLElement} element
   * @param {() => void} onChange
   */
  constructor(element, onChange) {
    super("strip", element, onChange);
    this.from = 0; // stations at the left and at the right edge
    this.to = 1;
    this.low = this.high = 0; // deviations at the lower and at the upper edge
    this.left = this.right = this.top = this.bottom = 0; // edges in pixels
  }

  lookAtAll() {
    [this.from, this.to] = [0, this.nominal.length];
  }

  rescale() {
    const { zone, sheet, low, high } = this, middle = middleOf(zone), room = 0.75 * (zone.upper_mm - zone.lower_mm);
    const far = [this.worst, this.chosen?.worst].map((worst) => (worst ? 1.18 * (worst.deviation_mm - middle) : 0));
    this.low = middle - Math.max(room, ...far.map((off) => -off));
    this.high = middle + Math.max(room, ...far);
    this.left = sheet.text * 5.2;
    this.right = sheet.width - sheet.text * 1.2;
    this.top = 6;
    this.bottom = sheet.height - sheet.text * 2.3;
    return low !== this.low || high !== this.high;
  }

  /** @param {number} station */
  px(station) {
    return this.left + ((station - this.from) / (this.to - this.from)) * (this.right - this.left);
  }

  /** @param {number} deviation */
  py(deviation) {
    return this.bottom - ((deviation - this.low) / (this.high - this.low)) * (this.bottom - this.top);
  }

  /**
   * @param {HeldPoint} point
   * @returns {Place}
   */
  place(point) {
    return [this.px(point.station), this.py(point.deviation)];
  }

  /**
   * @param {WorstPoint} worst
   * @returns {Place}
   */
  placeOfWorst(worst) {
    return [this.px(worst.station_mm), this.py(worst.deviation_mm)];
  }

  /** @param {Place} place */
  holds([x]) {
    return x >= this.left && x <= this.right;
  }

  /** @param {Pen} pen */
  drawGround(pen) {
    const { zone, sheet } = this, lower = this.py(zone.lower_mm), upper = this.py(zone.upper_mm);
    pen.fillStyle = INK.band;
    pen.fillRect(this.left, upper, this.right - this.left, lower - upper);
    this.drawChosen(pen);
    this.drawBand(pen);
    this.rule(pen, 0, INK.faint, []);
    for (const limit of [zone.upper_mm, zone.lower_mm]) {
      this.rule(pen, limit, INK.limit, [7, 5]);
      if (!zone.uncertainty_mm) continue;
      for (const side of [-1, 1]) {
        this.rule(pen, limit + side * zone.uncertainty_mm, INK["not-proven"], [2, 4]);
        this.nameOfU(pen, limit + side * zone.uncertainty_mm, side);
      }
    }
    this.labelLimits(pen, lower, upper);
    const isFree = [lower, upper].every((limit) => Math.abs(this.py(0) - limit) > sheet.text * 1.4);
    if (isFree) this.yLabel(pen, this.py(0), "0", INK.soft);
    this.drawStations(pen);
  }

  /**
   * The region of the characteristic that is shown, as a ground of its own; two pieces where it crosses the seam.
   * @param {Pen} pen
   */
  drawChosen(pen) {
    const { from_mm: from = null, to_mm: to = null } = this.chosen ?? {};
    if (from === null || to === null) return;
    const pieces = from <= to ? [[from, to]] : [[0, to], [from, this.nominal.length]];
    pen.fillStyle = INK["region-ground"];
    for (const [first, last] of pieces) {
      const left = Math.max(this.px(first), this.left), right = Math.min(this.px(last), this.right);
      if (right > left) pen.fillRect(left, this.top, right - left, this.bottom - this.top);
    }
  }

  /**
   * U of each station, to both sides of each limit.
   * @param {Pen} pen
   */
  drawBand(pen) {
    const { band, zone } = this, seen = band.filter(([station]) => station >= this.from && station <= this.to);
    if (seen.length < 2) return;
    pen.fillStyle = INK["uncertain-ground"];
    for (const limit of [zone.lower_mm, zone.upper_mm]) {
      pen.beginPath();
      for (const [station, u] of seen) pen.lineTo(this.px(station), this.py(limit + u));
      for (const [station, u] of [...seen].reverse()) pen.lineTo(this.px(station), this.py(limit - u));
      pen.fill();
    }
  }

  /**
   * The limits by value and name, the names outside the zone; apart from each other however narrow the zone is drawn.
   * @param {Pen} pen
   * @param {number} lower
   * @param {number} upper
   */
  labelLimits(pen, lower, upper) {
    const { zone, sheet } = this, line = sheet.text * 1.3, apart = Math.max(0, line - (lower - upper)) / 2;
    this.yLabel(pen, upper - apart, signed(zone.upper_mm, 3), INK.text);
    this.yLabel(pen, upper - apart - line, gettext("upper"), INK.soft);
    this.yLabel(pen, lower + apart, signed(zone.lower_mm, 3), INK.text);
    this.yLabel(pen, lower + apart + line, gettext("lower"), INK.soft);
  }

  /**
   * The name of a line that lies U beside a limit: between the two nothing is proven.
   * @param {Pen} pen
   * @param {number} deviation
   * @param {number} side
   */
  nameOfU(pen, deviation, side) {
    pen.fillStyle = INK["not-proven"];
    pen.textAlign = "right";
    pen.textBaseline = side > 0 ? "bottom" : "top";
    pen.fillText(side > 0 ? gettext("limit + U") : gettext("limit \u2212 U"), this.right - 4, this.py(deviation));
  }

  /**
   * @param {Pen} pen
   * @param {number} deviation
   * @param {string} ink
   * @param {number[]} dash
   */
  rule(pen, deviation, ink, dash) {
    const y = Math.round(this.py(deviation)) + 0.5;
    pen.setLineDash(dash);
    pen.strokeStyle = ink;
    pen.lineWidth = 1.25;
    pen.beginPath();
    pen.moveTo(this.left, y);
    pen.lineTo(this.right, y);
    pen.stroke();
    pen.setLineDash([]);
  }

  /**
   * @param {Pen} pen
   * @param {number} y
   * @param {string} words
   * @param {string} ink
   */
  yLabel(pen, y, words, ink) {
    pen.fillStyle = ink;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.fillText(words, this.left - 8, y);
  }

  /** @param {Pen} pen */
  drawStations(pen) {
    const { sheet } = this;
    const step = niceStep(this.to - this.from, (this.right - this.left) / (sheet.text * 7));
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    pen.fillStyle = INK.soft;
    pen.strokeStyle = INK.faint;
    pen.lineWidth = 1;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (let station = Math.ceil(this.from / step) * step; station <= this.to + 1e-9; station += step) {
      const x = Math.round(this.px(station)) + 0.5;
      pen.beginPath();
      pen.moveTo(x, this.bottom);
      pen.lineTo(x, this.bottom + 5);
      pen.stroke();
      if (x < this.right - sheet.text * 2.2) pen.fillText(fixed(station, digits), x, this.bottom + 8);
    }
    pen.textAlign = "right";
    pen.fillText("mm", this.right, this.bottom + 8);
  }

  /** Bins that can fall into the view, one to each side more. @returns {[number, number]} */
  range() {
    const { points, nominal } = this;
    const bin = (/** @type {number} */ station) => Math.floor((station / nominal.length) * points.bins);
    return [Math.max(0, bin(this.from) - 1), Math.min(points.bins - 1, bin(this.to) + 1)];
  }

  /** @param {Pen} pen */
  drawPoints(pen) {
    const columns = new Columns(Math.ceil(this.right - this.left) + 1), [first, last] = this.range();
    /** @type {Flag[]} */
    const flags = [];
    for (const side of this.points.sides) {
      const [stations, deviations, verdicts] = [side[STATION], side[DEVIATION], side[VERDICT]];
      for (let bin = first; bin <= last; bin++) {
        const deviation = deviations[bin], verdict = verdicts[bin];
        if (Number.isNaN(deviation) || stations[bin] < this.from || stations[bin] > this.to) continue;
        const column = Math.round(this.px(stations[bin]) - this.left);
        columns.add(column, deviation, verdict);
        if (verdict !== CONFORM) flags.push({ column, deviation, verdict });
      }
    }
    this.drawColumns(pen, columns);
    this.drawMeasured(pen, columns);
    this.drawFlags(pen, flags);
  }

  /**
   * @param {Pen} pen
   * @param {Columns} columns
   */
  drawColumns(pen, columns) {
    const half = this.to - this.from < this.nominal.length / 4 ? 1.5 : 1; // few points: larger dots
    /** @type {Map<PointClass, Path2D>} */
    const paths = new Map();
    for (const column of columns.filled()) {
      const { deviation, verdict } = columns.farthest(column, middleOf(this.zone)), kind = classOf(deviation, verdict, this.zone);
      const path = paths.get(kind) ?? new Path2D();
      paths.set(kind, path);
      const top = this.py(columns.high[column]) - half, bottom = this.py(columns.low[column]) + half;
      path.rect(this.left + column - 0.75 * half, top, 1.5 * half, bottom - top);
    }
    for (const [kind, path] of paths) {
      pen.fillStyle = INK[kind];
      pen.fill(path);
    }
  }

  /**
   * A line at the foot, filled where something was measured.
   * @param {Pen} pen
   * @param {Columns} columns
   */
  drawMeasured(pen, columns) {
    const top = this.bottom - MEASURED_PX;
    pen.fillStyle = INK.gap;
    pen.fillRect(this.left, top, this.right - this.left, MEASURED_PX);
    pen.fillStyle = INK.in;
    for (const column of columns.filled()) pen.fillRect(this.left + column - 1, top, 3, MEASURED_PX);
  }

  /**
   * Shapes on what is not proven to be good: the farthest of every few pixels, so that shapes stay readable.
   * @param {Pen} pen
   * @param {Flag[]} flags
   */
  drawFlags(pen, flags) {
    const middle = middleOf(this.zone);
    /** @type {Map<string, Flag>} */
    const farthest = new Map();
    for (const flag of flags) {
      const place = `${Math.floor(flag.column / MARK_EVERY_PX)} ${flag.deviation > middle}`, known = farthest.get(place);
      if (!known || Math.abs(flag.deviation - middle) > Math.abs(known.deviation - middle)) farthest.set(place, flag);
    }
    for (const { column, deviation, verdict } of farthest.values()) {
      mark(pen, classOf(deviation, verdict, this.zone), this.left + column, this.py(deviation), 5);
    }
  }

  /**
   * @param {Pen} pen
   * @param {Cursor | null} cursor
   */
  drawCursor(pen, cursor) {
    if (cursor && this.holds(this.place(cursor))) {
      const [x] = this.place(cursor);
      pen.strokeStyle = INK.text;
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(x, this.top);
      pen.lineTo(x, this.bottom);
      pen.stroke();
    }
    super.drawCursor(pen, cursor);
  }

  /**
   * A pixel along the station counts twice a pixel of deviation.
   * @param {number} side
   * @param {number} bin
   * @param {Place} place
   */
  distance(side, bin, [x, y]) {
    const columns = this.points.sides[side];
    return 4 * (this.px(columns[STATION][bin]) - x) ** 2 + (this.py(columns[DEVIATION][bin]) - y) ** 2;
  }

  /**
   * @param {number} factor
   * @param {Place} place
   */
  zoom(factor, [x]) {
    const share = (x - this.left) / (this.right - this.left), at = this.from + share * (this.to - this.from);
    const span = Math.min(Math.max((this.to - this.from) * factor, this.nominal.length / 2000), this.nominal.length);
    this.look(at - share * span, span);
  }

  /** @param {number} dx */
  pan(dx) {
    this.look(this.from + (dx / (this.right - this.left)) * (this.to - this.from), this.to - this.from);
  }

  /**
   * @param {number} from
   * @param {number} span
   */
  look(from, span) {
    this.from = Math.min(Math.max(from, 0), this.nominal.length - span);
    this.to = this.from + span;
    this.touch();
  }
}

/** The lowest and the highest point of every pixel column. */
export class Columns {
  /** @param {number} count */
  constructor(count) {
    this.low = new Float32Array(count).fill(Infinity);
    this.high = new Float32Array(count).fill(-Infinity);
    this.lowVerdict = new Uint8Array(count);
    this.highVerdict = new Uint8Array(count);
  }

  /**
   * @param {number} column
   * @param {number} deviation
   * @param {number} verdict
   */
  add(column, deviation, verdict) {
    if (deviation < this.low[column]) [this.low[column], this.lowVerdict[column]] = [deviation, verdict];
    if (deviation > this.high[column]) [this.high[column], this.highVerdict[column]] = [deviation, verdict];
  }

  /** Columns that hold a point. */
  *filled() {
    for (let column = 0; column < this.low.length; column++) if (this.high[column] >= this.low[column]) yield column;
  }

  /**
   * The point of a column that is farther from the middle of the zone.
   * @param {number} column
   * @param {number} middle
   */
  farthest(column, middle) {
    const isHigh = Math.abs(this.high[column] - middle) > Math.abs(this.low[column] - middle);
    return isHigh
      ? { deviation: this.high[column], verdict: this.highVerdict[column] }
      : { deviation: this.low[column], verdict: this.lowVerdict[column] };
  }
}
