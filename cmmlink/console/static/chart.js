// Run chart: the worst deviation of the last parts (or of a surface's sections), each with its own limits; the verdict by shape.

import { signed } from "./numbers.js";
import { middleOf } from "./points.js";
import { INK, Sheet, cross, mark, ring } from "./sheet.js";
import { gettext } from "./words.js";

/** @import { RunRow } from "./protocol.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {RunRow["verdict"]} Shown */
/** @typedef {{ worst_mm: number, lower_mm: number, upper_mm: number, verdict: Shown, counted: boolean, label: string }} Entry */
/** @typedef {Pick<RunRow, "worst_mm" | "lower_mm" | "upper_mm" | "verdict" | "counted"> & { label: string }} Candidate */
/** @typedef {{ px: (place: number) => number, py: (deviation: number) => number, left: number, bottom: number, width: number }} Scale */

const FEWEST = 20;
const LABEL_LETTERS = 10;

export class Chart {
  /**
   * @param {HTMLElement} element
   * @param {boolean} isLarge
   */
  constructor(element, isLarge) {
    this.isLarge = isLarge;
    /** @type {Entry[]} */
    this.entries = [];
    this.sheet = new Sheet(element, () => this.draw());
  }

  /**
   * Show runs or sections in the order of drawing: the newest, or the highest, last. A run without a verdict is a cross in the
   * middle of its zone, or of the one before: it has a place in the order, and no value.
   * @param {Candidate[]} candidates
   */
  show(candidates) {
    this.entries = [];
    let zone = candidates.find(hasZone);
    for (const candidate of candidates) {
      zone = hasZone(candidate) ? candidate : zone;
      if (!zone) continue;
      const { verdict, label, worst_mm } = candidate, { lower_mm, upper_mm } = zone, counted = candidate.counted && worst_mm !== null;
      this.entries.push({ worst_mm: counted ? worst_mm : middleOf(zone), lower_mm, upper_mm, verdict, counted, label });
    }
    this.draw();
  }

  draw() {
    if (!this.sheet.width) return;
    const { entries } = this, pen = this.sheet.pen("ground"), last = entries.at(-1);
    if (!last) return this.drawNothing(pen);
    const scale = this.scale();
    this.drawLimits(pen, scale, last);
    const places = entries.flatMap((entry, k) => (entry.counted ? [[scale.px(k), scale.py(entry.worst_mm)]] : []));
    this.drawLine(pen, places, INK.faint);
    entries.forEach((entry, k) => this.drawPoint(pen, entry, scale.px(k), scale.py(entry.worst_mm)));
    ring(pen, scale.px(entries.length - 1), scale.py(last.worst_mm), this.size + 4, 1.5);
    if (this.isLarge) this.drawLabels(pen, scale);
  }

  get size() {
    return this.isLarge ? 6 : 4;
  }

  /** @returns {Scale} */
  scale() {
    const { width, height, text } = this.sheet, foot = this.isLarge ? 2 : 0.6;
    const left = text * 7.4, right = width - text, top = text * 0.6, bottom = height - text * foot;
    const values = this.entries.flatMap((entry) => [entry.worst_mm, entry.lower_mm, entry.upper_mm]);
    const low = Math.min(...values), high = Math.max(...values), room = (high - low) * 0.12 || 0.01;
    const step = (right - left) / Math.max(FEWEST, this.entries.length);
    return {
      left, bottom, width: step,
      px: (place) => left + (place + 0.5) * step,
      py: (deviation) => bottom - ((deviation - low + room) / (high - low + 2 * room)) * (bottom - top),
    };
  }

  /** @param {Pen} pen */
  drawNothing(pen) {
    pen.fillStyle = INK.soft;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(gettext("no part was measured yet"), this.sheet.width / 2, this.sheet.height / 2);
  }

  /**
   * The tolerance zone of each entry; the limits of the last one by number.
   * @param {Pen} pen
   * @param {Scale} scale
   * @param {Entry} last
   */
  drawLimits(pen, { px, py, left, width }, last) {
    pen.fillStyle = INK.band;
    this.entries.forEach((entry, k) => {
      const from = Math.round(px(k) - width / 2), to = Math.round(px(k) + width / 2);
      pen.fillRect(from, py(entry.upper_mm), to - from, py(entry.lower_mm) - py(entry.upper_mm));
    });
    pen.fillStyle = INK.soft;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const apart = Math.max(0, this.sheet.text * 1.15 - (py(last.lower_mm) - py(last.upper_mm))) / 2; // however narrow the zone is drawn
    pen.fillText(gettext("upper {limit}", { limit: signed(last.upper_mm, 3) }), left - 6, py(last.upper_mm) - apart);
    pen.fillText(gettext("lower {limit}", { limit: signed(last.lower_mm, 3) }), left - 6, py(last.lower_mm) + apart);
    const places = Math.max(FEWEST, this.entries.length);
    this.drawLine(pen, [[left, py(0)], [px(places - 0.5), py(0)]], INK.faint);
  }

  /**
   * @param {Pen} pen
   * @param {number[][]} places
   * @param {string} ink
   */
  drawLine(pen, places, ink) {
    pen.strokeStyle = ink;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (const [x, y] of places) pen.lineTo(x, y);
    pen.stroke();
  }

  /**
   * @param {Pen} pen
   * @param {Entry} entry
   * @param {number} x
   * @param {number} y
   */
  drawPoint(pen, entry, x, y) {
    if (!entry.counted) return cross(pen, x, y, this.size);
    if (entry.verdict === "nonconform") {
      const isOver = entry.worst_mm > middleOf(entry);
      mark(pen, isOver ? "over" : "under", x, y, this.size + 1);
    } else if (entry.verdict === "conform") {
      pen.fillStyle = INK.in;
      pen.beginPath();
      pen.arc(x, y, this.size - 0.5, 0, 2 * Math.PI);
      pen.fill();
    } else mark(pen, "not-proven", x, y, this.size);
  }

  /**
   * @param {Pen} pen
   * @param {Scale} scale
   */
  drawLabels(pen, { px, bottom, width }) {
    const every = Math.ceil((this.sheet.text * 6) / width), last = this.entries.length - 1;
    pen.fillStyle = INK.soft;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    this.entries.forEach(({ label }, k) => {
      if ((last - k) % every === 0) pen.fillText(label.slice(-LABEL_LETTERS), px(k), bottom + 6);
    });
  }
}

/**
 * @param {Candidate} candidate
 * @returns {candidate is Candidate & { lower_mm: number, upper_mm: number }}
 */
const hasZone = (candidate) => candidate.lower_mm !== null && candidate.upper_mm !== null;
