// The profile with its tolerance zone, and the deviations magnified along the normal.

import { CONFORM, DEVIATION, FOOT_X, FOOT_Y, NORMAL_X, NORMAL_Y, NONCONFORM, VERDICT } from "./protocol.js";
import { Drawing } from "./drawing.js";
import { digitsFor, fixed, niceLength, signed } from "./numbers.js";
import { CLASSES, classOf } from "./points.js";
import { cut, drawPlaces, drawRegions, lanesOf, roomOf } from "./regions.js";
import { INK, label, mark } from "./sheet.js";
import { drawStations } from "./stations.js";
import { gettext } from "./words.js";

/** @import { CharacteristicRow, WorstPoint } from "./protocol.js" */
/** @import { HeldPoint, PointClass } from "./points.js" */
/** @import { Place } from "./drawing.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {{ scale: number, x: number, y: number }} View pixels per mm, and the place of the origin on the sheet */
/** @typedef {{ kind: PointClass, x: number, y: number }} Flag */
/** @typedef {{ paths: Map<PointClass, Path2D>, flags: Map<string, Flag> }} Whiskers */

const CELL_PX = 1.6; // whiskers closer together than this cannot be told apart
const MARK_EVERY_PX = 9;
const BAND_PX = 15; // half width of the tolerance zone that the automatic magnification aims at
const MOST_ROOM = 0.3; // of the sheet, that may be left free on every side of the part
const QUAD_PX = 2.5; // length of the pieces that the tolerance zone is filled with
const CLOSEST = 400; // most that a view enlarges the whole

export class Profile extends Drawing {
  /**
   * @param {HTMLElement} element
   * @param {() => void} onChange
   */
  constructor(element, onChange) {
    super("profile", element, onChange);
    /** @type {readonly CharacteristicRow[]} */
    this.rows = [];
    /** Chosen by the operator; null: chosen by the page. @type {number | null} */
    this.magnification = null;
    /** Null: all of the profile. @type {View | null} */
    this.view = null;
    /** @type {View} */
    this.all = { scale: 1, x: 0, y: 0 };
    this.drawnAt = 1; // the magnification of what stands on the sheet
    /** @type {ReturnType<typeof lanesOf>} */
    this.regions = [];
  }

  /** @type {Drawing["mark"]} */
  mark(rows, chosen, band) {
    super.mark(rows, chosen, band);
    if (rows === this.rows) return;
    this.rows = rows;
    this.regions = lanesOf(rows);
    this.all = this.whole();
    this.outdated.ground = true;
  }

  lookAtAll() {
    this.view = null;
    this.all = this.whole();
  }

  resize() {
    this.all = this.whole();
    super.resize();
  }

  /** The view that shows the whole nominal with room for whiskers. @returns {View} */
  whole() {
    const { width, height } = this.sheet, [x0, y0, x1, y1] = this.nominal.box;
    const least = Math.min(width, height), wanted = least * 0.04 + 3.2 * BAND_PX + roomOf(this.regions, this.sheet.text);
    const room = Math.min(wanted, MOST_ROOM * least);
    const scale = Math.min((width - 2 * room) / Math.max(x1 - x0, 1e-9), (height - 2 * room) / Math.max(y1 - y0, 1e-9));
    return { scale, x: width / 2 - ((x0 + x1) / 2) * scale, y: height / 2 + ((y0 + y1) / 2) * scale };
  }

  get seen() {
    return this.view ?? this.all;
  }

  /** How much larger deviations are drawn than the part. */
  get magnified() {
    return this.magnification ?? this.autoMagnification;
  }

  // The zone as wide as BAND_PX asks for, unless the worst deviation would then leave the sheet.
  get autoMagnification() {
    const half = (this.zone.upper_mm - this.zone.lower_mm) / 2, most = 0.3 * Math.min(this.sheet.width, this.sheet.height);
    const worst = Math.max(Math.abs(this.worst?.deviation_mm ?? 0), 1e-9);
    return Math.max(1, Math.min(BAND_PX / half, most / worst) / this.all.scale);
  }

  /** @param {number | null} magnification */
  magnify(magnification) {
    this.magnification = magnification;
    this.touch();
  }

  rescale() {
    const before = this.drawnAt;
    this.drawnAt = this.magnified;
    return before !== this.drawnAt;
  }

  /** @param {number} x */
  px(x) {
    return this.seen.x + x * this.seen.scale;
  }

  /** @param {number} y */
  py(y) {
    return this.seen.y - y * this.seen.scale;
  }

  /** @param {Pen} pen */
  drawGround(pen) {
    const lower = this.zone.lower_mm * this.drawnAt, upper = this.zone.upper_mm * this.drawnAt;
    this.fillZone(pen, lower, upper);
    pen.strokeStyle = INK.limit;
    pen.lineWidth = 1;
    pen.setLineDash([7, 5]);
    pen.stroke(this.offset(lower));
    pen.stroke(this.offset(upper));
    pen.setLineDash([]);
    pen.strokeStyle = INK.line;
    pen.lineWidth = 1.75;
    pen.stroke(this.offset(0));
    drawStations(pen, this);
    drawRegions(pen, this);
    this.drawRuler(pen);
  }

  /**
   * Where a sample of the nominal lies on the sheet, moved along its outward normal.
   * @param {number} k
   * @param {number} distance
   * @returns {Place}
   */
  moved(k, distance) {
    const { x, y, nx, ny } = this.nominal;
    return [this.px(x[k] + distance * nx[k]), this.py(y[k] + distance * ny[k])];
  }

  /**
   * The nominal moved along its outward normal, as a path on the sheet.
   * @param {number} distance
   */
  offset(distance) {
    const path = new Path2D();
    for (const [first, last] of this.nominal.pieces) {
      path.moveTo(...this.moved(first, distance));
      for (let k = first + 1; k <= last; k++) path.lineTo(...this.moved(k, distance));
    }
    if (this.nominal.closed) path.closePath();
    return path;
  }

  /**
   * Fill the tolerance zone quadrilateral by quadrilateral, so that loops of the limits do no harm.
   * @param {Pen} pen
   * @param {number} lower
   * @param {number} upper
   */
  fillZone(pen, lower, upper) {
    const path = new Path2D();
    const add = (/** @type {number} */ k, /** @type {number} */ l) => {
      path.moveTo(...this.moved(k, lower));
      path.lineTo(...this.moved(k, upper));
      path.lineTo(...this.moved(l, upper));
      path.lineTo(...this.moved(l, lower));
      path.closePath();
    };
    for (const [first, last] of this.nominal.pieces) {
      let from = first;
      for (let k = first + 1; k <= last; k++) {
        if (k < last && this.apart(from, k) <= QUAD_PX) continue;
        add(from, k);
        from = k;
      }
      if (this.nominal.closed) add(last, first);
    }
    pen.fillStyle = INK.band;
    pen.fill(path, "nonzero");
    pen.strokeStyle = INK.band;
    pen.lineWidth = 0.6;
    pen.stroke(path);
  }

  /**
   * How far two samples are apart on the sheet, and how much the normal turns between them.
   * @param {number} k
   * @param {number} l
   */
  apart(k, l) {
    const { x, y, nx, ny } = this.nominal;
    const turn = Math.abs(nx[k] * ny[l] - ny[k] * nx[l]) * 40;
    return Math.hypot(x[k] - x[l], y[k] - y[l]) * this.seen.scale + turn;
  }

  /**
   * A length on the part: what the eye needs to read the drawing.
   * @param {Pen} pen
   */
  drawRuler(pen) {
    const { sheet } = this, length = niceLength((sheet.width * 0.14) / this.seen.scale);
    const left = sheet.text, right = left + length * this.seen.scale, y = sheet.height - sheet.text * 1.1;
    pen.strokeStyle = INK.soft;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(left, y - 5);
    pen.lineTo(left, y);
    pen.lineTo(right, y);
    pen.lineTo(right, y - 5);
    pen.stroke();
    pen.fillStyle = INK.soft;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.fillText(`${fixed(Number(length.toPrecision(3)), 6, 0)} mm`, right + 8, y - 3);
  }

  /** @param {Pen} pen */
  drawPoints(pen) {
    const { points, nominal } = this, [low, high] = points.sides;
    /** @type {Whiskers} */
    const whiskers = { paths: new Map(), flags: new Map() };
    const perCell = Math.max(1, Math.floor((CELL_PX / this.seen.scale / nominal.length) * points.bins));
    for (let first = 0; first < points.bins; first += perCell) {
      const extremes = this.extremes(first, Math.min(first + perCell, points.bins));
      if (!extremes) continue;
      const { lowest, highest } = extremes, isOne = lowest === highest;
      if (low[DEVIATION][lowest] < 0 || isOne || low[VERDICT][lowest] !== CONFORM) this.addWhisker(whiskers, low, lowest);
      if (high[DEVIATION][highest] >= 0 || high[VERDICT][highest] !== CONFORM) this.addWhisker(whiskers, high, highest);
    }
    for (const kind of CLASSES) {
      pen.strokeStyle = INK[kind];
      pen.lineWidth = 2; // no gaps between neighbours: the deviations read as one shape
      pen.stroke(whiskers.paths.get(kind) ?? new Path2D());
    }
    for (const { kind, x, y } of whiskers.flags.values()) mark(pen, kind, x, y, 4.5);
  }

  /** @param {Pen} pen */
  drawMarks(pen) {
    super.drawMarks(pen);
    if (this.chosen) drawPlaces(pen, this, this.chosen);
  }

  /**
   * The bins with the lowest and the highest deviation among some; null where none holds a point.
   * @param {number} first
   * @param {number} end
   */
  extremes(first, end) {
    const low = this.points.sides[0][DEVIATION], high = this.points.sides[1][DEVIATION];
    let lowest = -1, highest = -1;
    for (let bin = first; bin < end; bin++) {
      if (this.points.isEmpty(bin)) continue;
      if (lowest < 0 || low[bin] < low[lowest]) lowest = bin;
      if (highest < 0 || high[bin] > high[highest]) highest = bin;
    }
    return lowest < 0 ? null : { lowest, highest };
  }

  /**
   * @param {Whiskers} whiskers
   * @param {Float32Array[]} side
   * @param {number} bin
   */
  addWhisker({ paths, flags }, side, bin) {
    const [fx, fy] = this.foot(side, bin), [tx, ty] = this.tip(side, bin);
    const { width, height } = this.sheet;
    if (Math.max(fx, tx) < -20 || Math.min(fx, tx) > width + 20 || Math.max(fy, ty) < -20 || Math.min(fy, ty) > height + 20) return;
    const kind = classOf(side[DEVIATION][bin], side[VERDICT][bin], this.zone), path = paths.get(kind) ?? new Path2D();
    paths.set(kind, path);
    path.moveTo(fx, fy);
    path.lineTo(tx, ty);
    if (side[VERDICT][bin] === CONFORM) return;
    const place = `${Math.round(tx / MARK_EVERY_PX)} ${Math.round(ty / MARK_EVERY_PX)}`;
    if (!flags.has(place)) flags.set(place, { kind, x: tx, y: ty });
  }

  /**
   * Where the foot of a point lies on the sheet.
   * @param {Float32Array[]} side
   * @param {number} bin
   * @returns {Place}
   */
  foot(side, bin) {
    return [this.px(side[FOOT_X][bin]), this.py(side[FOOT_Y][bin])];
  }

  /**
   * Where a point lies on the sheet, its deviation magnified.
   * @param {Float32Array[]} side
   * @param {number} bin
   * @returns {Place}
   */
  tip(side, bin) {
    const far = this.drawnAt * side[DEVIATION][bin];
    return [this.px(side[FOOT_X][bin] + far * side[NORMAL_X][bin]), this.py(side[FOOT_Y][bin] + far * side[NORMAL_Y][bin])];
  }

  /** @param {HeldPoint} point */
  place(point) {
    return this.tip(this.points.sides[point.side], point.bin);
  }

  /**
   * @param {WorstPoint} worst
   * @returns {Place}
   */
  placeOfWorst(worst) {
    const { nx, ny } = this.nominal, k = this.nominal.nearest(worst.station_mm);
    const more = (this.drawnAt - 1) * worst.deviation_mm; // the point itself lies one deviation away from its foot
    return [this.px(worst.x_mm + more * nx[k]), this.py(worst.y_mm + more * ny[k])];
  }

  /**
   * @param {Pen} pen
   * @param {WorstPoint} worst
   * @param {Place} place
   */
  drawWorst(pen, worst, place) {
    if (!this.holds(place)) return;
    super.drawWorst(pen, worst, place);
    const ink = worst.verdict === "nonconform" ? INK[classOf(worst.deviation_mm, NONCONFORM, this.zone)] : INK.limit;
    const name = this.chosen ? `${cut(this.chosen.name)}\n` : "";
    const values = { deviation: signed(worst.deviation_mm, digitsFor(this.zone)), station: fixed(worst.station_mm, 2) };
    label(pen, this.sheet, name + gettext("{deviation} mm at {station} mm", values), ...place, ink, true);
  }

  /**
   * Squared distance of a place from a point's whisker.
   * @param {number} side
   * @param {number} bin
   * @param {Place} place
   */
  distance(side, bin, [x, y]) {
    const columns = this.points.sides[side], [fx, fy] = this.foot(columns, bin), [tx, ty] = this.tip(columns, bin);
    const [wx, wy] = [tx - fx, ty - fy];
    const along = Math.min(1, Math.max(0, ((x - fx) * wx + (y - fy) * wy) / (wx * wx + wy * wy || 1)));
    return (fx + along * wx - x) ** 2 + (fy + along * wy - y) ** 2;
  }

  /**
   * @param {number} factor
   * @param {Place} place
   */
  zoom(factor, [x, y]) {
    const { seen, all } = this, scale = Math.min(Math.max(seen.scale / factor, all.scale), all.scale * CLOSEST);
    const share = scale / seen.scale;
    this.view = scale === all.scale ? null : { scale, x: x - (x - seen.x) * share, y: y - (y - seen.y) * share };
    this.touch();
  }

  /**
   * @param {number} dx
   * @param {number} dy
   */
  pan(dx, dy) {
    const { scale, x, y } = this.seen;
    this.view = { scale, x: x - dx, y: y - dy };
    this.touch();
  }
}
