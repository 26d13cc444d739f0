// A control chart: what is plotted run after run, its limits, the tolerance of each run, and the rules that are broken.

import { fixed, niceStep } from "./numbers.js";
import { INK, Sheet, label, mark, ring } from "./sheet.js";
import { translate } from "./words.js";

/** @import { TrendChart, TrendRun } from "./protocol.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {{ lower: number | null, upper: number | null }} Limits */
/**
 * @typedef {object} Drawn
 * @property {TrendChart} chart
 * @property {readonly TrendRun[]} runs the run that each plotted value ends with
 * @property {boolean} hasVerdicts whether each value is that of one run
 * @property {boolean} isForm whether values begin at zero
 */

const STEPS = 4; // of the axis of values, at least
const DOT = 2.5;

export class ControlChart {
  /**
   * @param {HTMLElement} element
   * @param {(place: number | null) => void} onPoint hears which plotted value is pointed at
   */
  constructor(element, onPoint) {
    /** @type {Drawn | null} */
    this.drawn = null;
    this.nothing = "";
    /** @type {number | null} */
    this.cursor = null;
    this.low = this.high = 0;
    this.left = this.right = this.top = this.bottom = 0;
    this.sheet = new Sheet(element, () => this.draw());
    element.addEventListener("keydown", (event) => this.act(event, onPoint));
    element.addEventListener("pointermove", (event) => onPoint(this.placeAt(event.offsetX)));
    element.addEventListener("pointerdown", (event) => onPoint(this.placeAt(event.offsetX)));
    element.addEventListener("pointerleave", () => onPoint(null));
  }

  /**
   * @param {Drawn | null} drawn
   * @param {string} nothing what is said in its place
   */
  show(drawn, nothing) {
    this.drawn = drawn;
    this.nothing = nothing;
    this.draw();
  }

  get count() {
    return this.drawn?.chart.plotted.length ?? 0;
  }

  /**
   * @param {KeyboardEvent} event
   * @param {(place: number | null) => void} onPoint
   */
  act(event, onPoint) {
    const last = this.count - 1, at = this.cursor ?? last + 1;
    const target = new Map([["ArrowLeft", at - 1], ["ArrowRight", at + 1], ["Home", 0], ["End", last]]).get(event.key);
    if (target === undefined || last < 0) return;
    event.preventDefault();
    onPoint(Math.min(Math.max(target, 0), last));
  }

  /** @param {number} x */
  placeAt(x) {
    const place = Math.round(((x - this.left) / (this.right - this.left)) * this.count - 0.5);
    return place >= 0 && place < this.count ? place : null;
  }

  /** @param {number} place */
  px(place) {
    return this.left + ((place + 0.5) / this.count) * (this.right - this.left);
  }

  /** @param {number} value */
  py(value) {
    return this.bottom - ((value - this.low) / (this.high - this.low)) * (this.bottom - this.top);
  }

  draw() {
    if (!this.sheet.width) return;
    const { drawn, sheet } = this, pen = sheet.pen("ground");
    sheet.pen("cursor");
    if (!drawn) return drawNothing(pen, sheet, this.nothing);
    this.rescale(drawn);
    this.drawTolerance(pen, drawn);
    this.drawAxis(pen);
    this.drawLimits(pen, drawn.chart);
    this.drawValues(pen, drawn);
    this.point(this.cursor);
  }

  /** @param {Drawn} drawn */
  rescale({ chart, runs, hasVerdicts, isForm }) {
    const limits = hasVerdicts ? runs.flatMap(({ lower, upper }) => [lower, upper]) : [];
    const values = [...chart.plotted, ...limits, chart.lower, chart.upper].filter((value) => value !== null);
    const low = isForm || !hasVerdicts ? 0 : Math.min(...values), high = Math.max(...values, low + 1e-9), room = 0.08 * (high - low);
    this.low = low === 0 ? 0 : low - room;
    this.high = high + room;
    const { width, height, text } = this.sheet;
    [this.left, this.right, this.top, this.bottom] = [text * 5, width - text * 5.4, text * 0.6, height - text * 0.6];
  }

  /**
   * @param {Pen} pen
   * @param {Drawn} drawn
   */
  drawTolerance(pen, { runs, hasVerdicts, isForm }) {
    if (!hasVerdicts) return;
    const half = (this.right - this.left) / this.count / 2;
    runs.forEach(({ lower, upper }, k) => {
      const low = isForm ? 0 : lower;
      if (low === null && upper === null) return;
      const left = Math.round(this.px(k) - half), right = Math.round(this.px(k) + half);
      const top = this.py(upper ?? this.high), bottom = this.py(low ?? this.low);
      pen.fillStyle = INK.band;
      pen.fillRect(left, top, right - left, bottom - top);
      pen.fillStyle = INK.line;
      if (upper !== null) pen.fillRect(left, top - 0.5, right - left, 1);
      if (lower !== null && !isForm) pen.fillRect(left, bottom - 0.5, right - left, 1);
    });
  }

  /** @param {Pen} pen */
  drawAxis(pen) {
    const step = niceStep(this.high - this.low, Math.max(STEPS, (this.bottom - this.top) / (this.sheet.text * 3)));
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    pen.fillStyle = INK.soft;
    pen.strokeStyle = INK.faint;
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let value = Math.ceil(this.low / step) * step; value <= this.high + 1e-12; value += step) {
      const y = Math.round(this.py(value)) + 0.5;
      pen.beginPath();
      pen.moveTo(this.left - 4, y);
      pen.lineTo(this.left, y);
      pen.stroke();
      pen.fillText(fixed(value, digits), this.left - 7, y);
    }
    pen.strokeRect(this.left - 0.5, this.top, this.right - this.left + 1, this.bottom - this.top);
  }

  /**
   * @param {Pen} pen
   * @param {TrendChart} chart
   */
  drawLimits(pen, { lower, centre, upper }) {
    const digits = Math.min(6, Math.max(0, 3 - Math.floor(Math.log10(Math.max(this.high - this.low, 1e-12)))));
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.lineWidth = 1.5;
    for (const [value, dash] of /** @type {[number, number[]][]} */ ([[upper, [7, 5]], [centre, []], [lower, [7, 5]]])) {
      if (value < this.low) continue;
      const y = this.py(value);
      pen.strokeStyle = INK.limit;
      pen.setLineDash(dash);
      pen.beginPath();
      pen.moveTo(this.left, y);
      pen.lineTo(this.right, y);
      pen.stroke();
    }
    pen.setLineDash([]);
    const apart = this.sheet.text * 1.2, middle = this.py(centre); // however narrow the limits are drawn
    pen.fillStyle = INK.soft;
    pen.fillText(fixed(upper, digits), this.right + 6, Math.min(this.py(upper), middle - apart));
    pen.fillText(fixed(centre, digits), this.right + 6, middle);
    if (lower >= this.low) pen.fillText(fixed(lower, digits), this.right + 6, Math.max(this.py(lower), middle + apart));
  }

  /**
   * The values with a line from each to the next; what is not conform or not proven by its shape, what breaks a rule in a ring.
   * @param {Pen} pen
   * @param {Drawn} drawn
   */
  drawValues(pen, { chart, runs, hasVerdicts }) {
    const places = chart.plotted.flatMap((value, k) => (value === null ? [] : [{ k, x: this.px(k), y: this.py(value) }]));
    pen.strokeStyle = INK.soft;
    pen.lineWidth = 1;
    pen.beginPath();
    for (const { x, y } of places) pen.lineTo(x, y);
    pen.stroke();
    for (const { k, x, y } of places) {
      const { verdict } = runs[k];
      if (hasVerdicts && verdict !== "conform") {
        mark(pen, verdict === "nonconform" ? "over" : "not-proven", x, y, 5);
        continue;
      }
      pen.fillStyle = INK.in;
      pen.beginPath();
      pen.arc(x, y, DOT, 0, 2 * Math.PI);
      pen.fill();
    }
    for (const k of new Set(chart.broken.map(({ at }) => at))) ring(pen, this.px(k), this.py(chart.plotted[k] ?? 0), 7, 1.5);
  }

  /** Show which value is pointed at. @param {number | null} cursor */
  point(cursor) {
    this.cursor = cursor;
    const pen = this.sheet.pen("cursor"), value = this.drawn?.chart.plotted[cursor ?? -1] ?? null;
    if (cursor === null || !this.drawn || cursor >= this.count) return;
    const x = this.px(cursor);
    pen.strokeStyle = INK.text;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x, this.top);
    pen.lineTo(x, this.bottom);
    pen.stroke();
    if (value !== null) label(pen, this.sheet, fixed(value, 5), x, this.py(value), INK.limit, true);
  }
}

/**
 * Words in place of a drawing.
 * @param {Pen} pen
 * @param {Sheet} sheet
 * @param {string} words
 */
export function drawNothing(pen, sheet, words) {
  pen.fillStyle = INK.soft;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(words, sheet.width / 2, sheet.height / 2);
}

/**
 * What is to be said of a plotted value: of which run it is, and which rules it breaks.
 * @param {TrendRun} run
 * @param {TrendChart} chart
 * @param {number} place
 */
export function placeWords({ serial_number, run, station, began }, chart, place) {
  const broken = chart.broken.filter(({ at }) => at === place).map(({ words }) => translate(words));
  return [serial_number || run, station, began, ...new Set(broken)].filter(Boolean).join("  \u00b7  ");
}
