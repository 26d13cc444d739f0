// What the two drawings of a scan share: what they show, which layers are to be drawn anew, the point that is read out.

import { digitsFor, fixed, signed } from "./numbers.js";
import { NO_NOMINAL, Points } from "./points.js";
import { INK, Sheet, label, ring } from "./sheet.js";
import { wordOf } from "./verdicts.js";
import { gettext, translate } from "./words.js";

/** @import { CharacteristicRow, WorstPoint, ZoneLimits } from "./protocol.js" */
/** @import { HeldPoint, Nominal, Scan } from "./points.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {[x: number, y: number]} Place in pixels from the upper left corner of the sheet */
/** @typedef {HeldPoint & { by: string }} Cursor the point that is read out, and the name of the drawing that names it */

/** Each drawing has these methods of its own. */
const missing = () => new Error("this drawing lacks a method of its own");

export class Drawing {
  /**
   * @param {string} name
   * @param {HTMLElement} element
   * @param {() => void} onChange hears that something is to be drawn anew
   */
  constructor(name, element, onChange) {
    this.name = name;
    this.element = element;
    this.onChange = onChange;
    /** @type {Nominal} */
    this.nominal = NO_NOMINAL;
    this.points = new Points();
    /** @type {ZoneLimits} */
    this.zone = { lower_mm: 0, upper_mm: 0, uncertainty_mm: 0, decision_rule: "" };
    /** @type {WorstPoint | null} */
    this.worst = null;
    /** The characteristic that is shown. @type {CharacteristicRow | null} */
    this.chosen = null;
    /** U along the profile, as pairs of station and U in mm. @type {readonly (readonly [number, number])[]} */
    this.band = [];
    this.outdated = { ground: true, marks: true, cursor: true };
    this.sheet = new Sheet(element, () => this.resize());
  }

  get isReady() {
    return this.nominal.rows > 0 && this.sheet.width > 0;
  }

  /** The middle of the sheet. @returns {Place} */
  get middle() {
    return [this.sheet.width / 2, this.sheet.height / 2];
  }

  /**
   * Take over what is to be shown; `draw` shows it.
   * @param {Scan} scan
   * @param {ZoneLimits} zone
   * @param {WorstPoint | null} worst
   */
  show(scan, zone, worst) {
    const isOther = scan.nominal !== this.nominal;
    this.outdated.ground ||= isOther || !areEqual(zone, this.zone);
    this.outdated.marks = this.outdated.cursor = true;
    this.nominal = scan.nominal;
    this.points = scan.points;
    this.zone = zone;
    this.worst = worst;
    if (isOther) this.lookAtAll();
  }

  /**
   * Take over the characteristics, the one of them that is shown, and U along the profile.
   * @param {readonly CharacteristicRow[]} _rows
   * @param {CharacteristicRow | null} chosen
   * @param {Drawing["band"]} band
   */
  mark(_rows, chosen, band) {
    this.outdated.ground ||= chosen !== this.chosen || band !== this.band;
    this.chosen = chosen;
    this.band = band;
  }

  /** The worst point: that of the characteristic that is shown, else that of the run. */
  get shownWorst() {
    return this.chosen ? this.chosen.worst : this.worst;
  }

  /** Show nothing. */
  clear() {
    this.nominal = NO_NOMINAL;
    this.sheet.clear();
  }

  /**
   * Draw the layers that are out of date.
   * @param {Cursor | null} cursor
   */
  draw(cursor) {
    if (!this.isReady) return;
    const ground = this.rescale() || this.outdated.ground, marks = ground || this.outdated.marks;
    if (ground) this.drawGround(this.sheet.pen("ground"));
    if (marks) this.drawMarks(this.sheet.pen("marks"));
    if (marks || this.outdated.cursor) this.drawCursor(this.sheet.pen("cursor"), cursor);
    this.outdated = { ground: false, marks: false, cursor: false };
  }

  touch() {
    this.outdated = { ground: true, marks: true, cursor: true };
    this.onChange();
  }

  resize() {
    this.touch();
  }

  fit() {
    this.lookAtAll();
    this.touch();
  }

  /** @param {Pen} pen */
  drawMarks(pen) {
    if (this.points.bins) this.drawPoints(pen);
    const worst = this.shownWorst;
    if (worst) this.drawWorst(pen, worst, this.placeOfWorst(worst));
  }

  /**
   * @param {Pen} pen
   * @param {WorstPoint} _worst
   * @param {Place} place
   */
  drawWorst(pen, _worst, place) {
    if (this.holds(place)) ring(pen, ...place, 9, 2);
  }

  /**
   * @param {Pen} pen
   * @param {Cursor | null} cursor
   */
  drawCursor(pen, cursor) {
    if (!cursor || !this.holds(this.place(cursor))) return;
    const place = this.place(cursor);
    ring(pen, ...place, 5.5, 1.5);
    if (cursor.by === this.name) label(pen, this.sheet, wordsOf(cursor, this.zone), ...place, INK.text);
  }

  /**
   * The point that is nearest to a place.
   * @param {Place} place
   */
  nearest(place) {
    return this.points.least((side, bin) => this.distance(side, bin, place), ...this.range());
  }

  /**
   * Move the view so that the point is seen.
   * @param {HeldPoint} point
   */
  reveal(point) {
    this.revealPlace(this.place(point));
  }

  /** @param {Place} place */
  revealPlace([x, y]) {
    const [middleX, middleY] = this.middle;
    if (!this.holds([x, y])) this.pan(x - middleX, y - middleY);
  }

  /** Move the view so that the worst point of the characteristic that is shown is seen, or the whole where it has none. */
  revealChosen() {
    const worst = this.chosen?.worst;
    if (worst) this.revealPlace(this.placeOfWorst(worst));
    else this.fit();
  }

  /**
   * Whether a place lies in the drawing.
   * @param {Place} place
   */
  holds([x, y]) {
    return x >= 0 && y >= 0 && x <= this.sheet.width && y <= this.sheet.height;
  }

  /** First and last bin that can be seen. @returns {[number, number]} */
  range() {
    return [0, this.points.bins - 1];
  }

  // What each drawing does in its own way.

  /** Look at the whole profile. */
  lookAtAll() {
    throw missing();
  }

  /** Fit the scale to what is shown; true when it changed. @returns {boolean} */
  rescale() {
    throw missing();
  }

  /** Draw what stays when points come: the tolerance zone and the scale. @param {Pen} _pen */
  drawGround(_pen) {
    throw missing();
  }

  /** Draw the deviations. @param {Pen} _pen */
  drawPoints(_pen) {
    throw missing();
  }

  /** @param {HeldPoint} _point @returns {Place} */
  place(_point) {
    throw missing();
  }

  /** @param {WorstPoint} _worst @returns {Place} */
  placeOfWorst(_worst) {
    throw missing();
  }

  /**
   * A measure of how far a point is drawn from a place, for comparison only.
   * @param {number} _side
   * @param {number} _bin
   * @param {Place} _place
   * @returns {number}
   */
  distance(_side, _bin, _place) {
    throw missing();
  }

  /** Show `factor` times as much, with the place staying where it is. @param {number} _factor @param {Place} _place */
  zoom(_factor, _place) {
    throw missing();
  }

  /** Move the view by pixels. @param {number} _dx @param {number} _dy */
  pan(_dx, _dy) {
    throw missing();
  }
}

/**
 * @param {ZoneLimits} one
 * @param {ZoneLimits} other
 */
function areEqual(one, other) {
  return one.lower_mm === other.lower_mm && one.upper_mm === other.upper_mm && one.uncertainty_mm === other.uncertainty_mm;
}

/**
 * What is said of a point that is read out.
 * @param {HeldPoint} point
 * @param {ZoneLimits} zone
 */
function wordsOf(point, zone) {
  const deviation = `${signed(point.deviation, digitsFor(zone))} mm  ${translate(wordOf(point.verdict))}`;
  const station = gettext("station {station} mm", { station: fixed(point.station, 2) });
  return `${deviation}\n${station}\nx ${fixed(point.x, 3)}  y ${fixed(point.y, 3)}`;
}
