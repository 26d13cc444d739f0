// The heat strip: a row for each of the newest runs, coloured along the profile by where in its zone the worst deviation lies.
// Below it the drift of each place, and the stretches where it is significant.

import { fixed, niceStep, signed } from "./numbers.js";
import { INK, Sheet } from "./sheet.js";
import { drawNothing } from "./trend_chart.js";
import { gettext } from "./words.js";

/** @import { TrendStrip } from "./protocol.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {{ row: number, place: number }} Cell */

const OUT = 3; // the level of what is out of tolerance, to either side
const DRIFT_SHARE = 0.24; // of the height

export class HeatStrip {
  /**
   * @param {HTMLElement} element
   * @param {(words: string) => void} onPoint hears what is pointed at
   */
  constructor(element, onPoint) {
    this.onPoint = onPoint;
    /** @type {TrendStrip | null} */
    this.strip = null;
    this.nothing = "";
    /** @type {Cell | null} */
    this.cursor = null;
    this.left = this.right = this.top = this.middle = this.bottom = 0;
    this.sheet = new Sheet(element, () => this.draw());
    element.addEventListener("keydown", (event) => this.act(event));
    element.addEventListener("pointermove", (event) => this.point(this.cellAt(event.offsetX, event.offsetY)));
    element.addEventListener("pointerdown", (event) => this.point(this.cellAt(event.offsetX, event.offsetY)));
    element.addEventListener("pointerleave", () => this.point(null));
  }

  /**
   * @param {TrendStrip | null} strip
   * @param {string} nothing what is said in its place
   */
  show(strip, nothing) {
    this.strip = strip;
    this.nothing = nothing;
    this.cursor = null;
    this.draw();
  }

  get places() {
    return this.strip?.slope_um.length ?? 0;
  }

  get rows() {
    return this.strip?.levels.length ?? 0;
  }

  /** @param {KeyboardEvent} event */
  act(event) {
    const { row, place } = this.cursor ?? { row: this.rows - 1, place: 0 };
    const moved = new Map([
      ["ArrowLeft", { row, place: place - 1 }], ["ArrowRight", { row, place: place + 1 }], ["ArrowUp", { row: row - 1, place }],
      ["ArrowDown", { row: row + 1, place }], ["Home", { row, place: 0 }], ["End", { row, place: this.places - 1 }],
    ]).get(event.key);
    if (!moved || !this.rows) return;
    event.preventDefault();
    const inside = (/** @type {number} */ at, /** @type {number} */ count) => Math.min(Math.max(at, 0), count - 1);
    this.point({ row: inside(moved.row, this.rows), place: inside(moved.place, this.places) });
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  cellAt(x, y) {
    const place = Math.floor(((x - this.left) / (this.right - this.left)) * this.places);
    const row = Math.floor(((y - this.top) / (this.middle - this.top)) * this.rows);
    return place >= 0 && place < this.places && row >= 0 && row < this.rows ? { row, place } : null;
  }

  /** @param {number} place its beginning */
  px(place) {
    return this.left + (place / this.places) * (this.right - this.left);
  }

  /** @param {number} row its upper edge */
  py(row) {
    return this.top + (row / this.rows) * (this.middle - this.top);
  }

  draw() {
    if (!this.sheet.width) return;
    const { sheet, strip } = this, { text, width, height } = sheet, pen = sheet.pen("ground");
    sheet.pen("cursor");
    if (!strip) return drawNothing(pen, sheet, this.nothing);
    [this.left, this.right, this.top, this.bottom] = [text * 6.5, width - text, text * 0.3, height - text * 1.9];
    this.middle = this.bottom - (this.bottom - this.top) * DRIFT_SHARE - text * 0.8;
    this.drawCells(pen, strip);
    this.drawNames(pen, strip);
    this.drawDrift(pen, strip);
    this.drawStations(pen, strip);
    this.point(this.cursor);
  }

  /**
   * @param {Pen} pen
   * @param {TrendStrip} strip
   */
  drawCells(pen, strip) {
    /** @type {[number, number, number][]} */
    const out = [];
    strip.levels.forEach((levels, row) => levels.forEach((level, place) => {
      const [left, right] = [place, place + 1].map((edge) => Math.round(this.px(edge)));
      const [top, bottom] = [row, row + 1].map((edge) => Math.round(this.py(edge)));
      pen.fillStyle = inkOf(level);
      pen.fillRect(left, top, right - left, bottom - top);
      if (level !== null && Math.abs(level) === OUT) out.push([(left + right) / 2, (top + bottom) / 2, Math.sign(level)]);
    }));
    const size = Math.min(4, (this.middle - this.top) / this.rows / 2.4, (this.right - this.left) / this.places / 2.4);
    pen.fillStyle = INK["heat-mark"];
    for (const [x, y, way] of out) triangle(pen, x, y, size, way);
    pen.strokeStyle = INK.faint;
    pen.lineWidth = 1;
    pen.strokeRect(this.left - 0.5, this.top - 0.5, this.right - this.left + 1, this.middle - this.top + 1);
  }

  /**
   * The names of some runs, the newest among them.
   * @param {Pen} pen
   * @param {TrendStrip} strip
   */
  drawNames(pen, strip) {
    const { rows, sheet } = this, every = Math.max(1, Math.ceil((rows * sheet.text * 1.3) / (this.middle - this.top)));
    pen.fillStyle = INK.soft;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let row = rows - 1; row >= 0; row -= every) pen.fillText(strip.names[row].slice(-10), this.left - 6, this.py(row + 0.5));
  }

  /**
   * @param {Pen} pen
   * @param {TrendStrip} strip
   */
  drawDrift(pen, { slope_um, stretches, length_mm }) {
    const top = this.middle + this.sheet.text * 0.8, far = Math.max(...slope_um.map((slope) => Math.abs(slope ?? 0)), 1e-3) * 1.15;
    const middle = (top + this.bottom) / 2, scale = (this.bottom - top) / 2 / far;
    const px = (/** @type {number} */ station) => this.left + (station / length_mm) * (this.right - this.left);
    pen.fillStyle = INK["uncertain-ground"];
    for (const [from, to] of stretches) pen.fillRect(px(from), top, px(to) - px(from), this.bottom - top);
    pen.strokeStyle = INK.faint;
    pen.strokeRect(this.left - 0.5, top, this.right - this.left + 1, this.bottom - top);
    pen.beginPath();
    pen.moveTo(this.left, middle);
    pen.lineTo(this.right, middle);
    pen.stroke();
    pen.strokeStyle = INK.text;
    pen.lineWidth = 1.5;
    pen.beginPath();
    let isDrawing = false; // a place of which nothing is known interrupts the line
    slope_um.forEach((slope, place) => {
      if (slope !== null) pen[isDrawing ? "lineTo" : "moveTo"](this.px(place + 0.5), middle - slope * scale);
      isDrawing = slope !== null;
    });
    pen.stroke();
    pen.fillStyle = INK.soft;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.fillText(signed(far / 1.15, 2), this.left - 6, top + this.sheet.text * 0.6);
    pen.fillText(gettext("\u00b5m a run"), this.left - 6, middle);
    pen.fillText(signed(-far / 1.15, 2), this.left - 6, this.bottom - this.sheet.text * 0.6);
  }

  /**
   * @param {Pen} pen
   * @param {TrendStrip} strip
   */
  drawStations(pen, { length_mm }) {
    const step = niceStep(length_mm, (this.right - this.left) / (this.sheet.text * 7));
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    pen.fillStyle = INK.soft;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (let station = 0; station < length_mm - step / 2; station += step) {
      pen.fillText(fixed(station, digits), this.left + (station / length_mm) * (this.right - this.left), this.bottom + 5);
    }
    pen.textAlign = "right";
    pen.fillText("mm", this.right, this.bottom + 5);
  }

  /** Show and tell what is pointed at. @param {Cell | null} cell */
  point(cell) {
    const { strip } = this, pen = this.sheet.pen("cursor");
    this.cursor = cell;
    if (!strip || !cell) return this.onPoint("");
    const { row, place } = cell, left = this.px(place), top = this.py(row);
    pen.strokeStyle = INK.text;
    pen.lineWidth = 2;
    pen.strokeRect(left, top, this.px(place + 1) - left, this.py(row + 1) - top);
    this.onPoint(cellWords(strip, cell));
  }
}

/** @param {number | null} level */
function inkOf(level) {
  if (level === null) return INK["heat-none"];
  if (!level) return INK["heat-0"];
  return INK[/** @type {"heat-over-1"} */ (`heat-${level > 0 ? "over" : "under"}-${Math.abs(level)}`)];
}

/**
 * @param {Pen} pen
 * @param {number} x
 * @param {number} y
 * @param {number} size
 * @param {number} way 1 for one that points up
 */
function triangle(pen, x, y, size, way) {
  pen.beginPath();
  pen.moveTo(x, y - way * size);
  pen.lineTo(x + size, y + way * size);
  pen.lineTo(x - size, y + way * size);
  pen.fill();
}

/**
 * @param {TrendStrip} strip
 * @param {Cell} cell
 */
export function cellWords({ names, worst_mm, levels, slope_um, length_mm }, { row, place }) {
  const station = fixed(((place + 0.5) / slope_um.length) * length_mm, 2), worst = worst_mm[row][place], slope = slope_um[place];
  const level = levels[row][place];
  const deviation = worst === null ? gettext("not measured") : gettext("worst {worst} mm", { worst: signed(worst, 4) });
  const out = level !== null && Math.abs(level) === OUT ? gettext("out of tolerance") : "";
  const drift = slope === null ? "" : gettext("drift {slope} \u00b5m a run", { slope: signed(slope, 2) });
  return [names[row], gettext("station {station} mm", { station }), deviation, out, drift].filter(Boolean).join("  \u00b7  ");
}
