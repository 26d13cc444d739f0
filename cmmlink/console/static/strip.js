// Deviation against station: per pixel column the lowest and the highest point, so that no spike is hidden.

import { DEVIATION, NONCONFORM, STATION, UNCERTAIN, VERDICT, classOf } from "./points.js";
import { INK, Sheet, label, mark, niceStep, signed, wordsOf } from "./sheet.js";

const MARK_EVERY_PX = 9;

export class Strip {
  constructor(element, onChange) {
    this.sheet = new Sheet(element, () => this.touch());
    this.onChange = onChange;
    this.name = "strip";
    this.element = element;
    this.from = 0;
    this.to = 1;
  }

  touch() {
    this.groundDirty = this.marksDirty = this.cursorDirty = true;
    this.onChange?.();
  }

  show(points, nominal, zone, worst) {
    if (nominal !== this.nominal || zone.lower_mm !== this.zone?.lower_mm || zone.upper_mm !== this.zone?.upper_mm || zone.uncertainty_mm !== this.zone?.uncertainty_mm) {
      if (nominal !== this.nominal) [this.from, this.to] = [0, nominal.length];
      this.nominal = nominal;
      this.zone = zone;
      this.groundDirty = true;
    }
    this.points = points;
    this.worst = worst;
    this.marksDirty = this.cursorDirty = true;
  }

  draw(cursor) {
    if (!this.nominal || !this.sheet.width) return;
    if (this.scale()) this.groundDirty = true;
    if (this.groundDirty) this.drawGround();
    if (this.groundDirty || this.marksDirty) this.drawMarks();
    if (this.groundDirty || this.marksDirty || this.cursorDirty) this.drawCursor(cursor);
    this.groundDirty = this.marksDirty = this.cursorDirty = false;
  }

  // Where things stand on the sheet; true when the scale changed.
  scale() {
    const { zone, worst, sheet } = this;
    const half = (zone.upper_mm - zone.lower_mm) / 2, middle = (zone.lower_mm + zone.upper_mm) / 2;
    const far = worst ? 1.18 * (worst.deviation_mm - middle) : 0;
    const low = middle - Math.max(1.5 * half, -far), high = middle + Math.max(1.5 * half, far);
    const changed = low !== this.low || high !== this.high;
    Object.assign(this, { low, high, middle });
    this.left = sheet.text * 5.2;
    this.right = sheet.width - sheet.text * 1.2;
    this.top = 6;
    this.bottom = sheet.height - sheet.text * 2.3;
    return changed;
  }

  px(station) {
    return this.left + ((station - this.from) / (this.to - this.from)) * (this.right - this.left);
  }

  py(deviation) {
    return this.bottom - ((deviation - this.low) / (this.high - this.low)) * (this.bottom - this.top);
  }

  drawGround() {
    const { sheet, zone } = this, pen = sheet.pen("ground");
    const [low, high] = [this.py(zone.lower_mm), this.py(zone.upper_mm)];
    pen.fillStyle = INK.band;
    pen.fillRect(this.left, high, this.right - this.left, low - high);
    this.rule(pen, 0, INK.faint, []);
    for (const [limit, name] of [[zone.upper_mm, "upper"], [zone.lower_mm, "lower"]]) {
      this.rule(pen, limit, INK.limit, [7, 5]);
      this.yLabel(pen, limit, signed(limit, 3), INK.text, name);
    }
    if (zone.uncertainty_mm) for (const limit of [zone.upper_mm, zone.lower_mm]) for (const side of [-1, 1]) this.rule(pen, limit + side * zone.uncertainty_mm, INK.unsure, [2, 4]);
    if (Math.abs(this.py(0) - high) > sheet.text * 1.4 && Math.abs(this.py(0) - low) > sheet.text * 1.4) this.yLabel(pen, 0, "0", INK.soft);
    this.drawStations(pen);
  }

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

  yLabel(pen, deviation, words, ink) {
    pen.fillStyle = ink;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.fillText(words, this.left - 8, this.py(deviation));
  }

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
      if (x < this.right - sheet.text * 2.2) pen.fillText(station.toFixed(digits), x, this.bottom + 8);
    }
    pen.textAlign = "right";
    pen.fillText("mm", this.right, this.bottom + 8);
  }

  // Bins that can fall into the view, one to each side more.
  range() {
    const { points, nominal } = this;
    const bin = (station) => Math.floor((station / nominal.length) * points.bins);
    return [Math.max(0, bin(this.from) - 1), Math.min(points.bins - 1, bin(this.to) + 1)];
  }

  drawMarks() {
    const { sheet, points, zone } = this, pen = sheet.pen("marks");
    if (!points?.bins) return;
    const wide = Math.ceil(this.right - this.left) + 1;
    const low = new Float32Array(wide).fill(Infinity), high = new Float32Array(wide).fill(-Infinity);
    const lowVerdict = new Uint8Array(wide), highVerdict = new Uint8Array(wide);
    const [first, last] = this.range(), flagged = [];
    for (let side = 0; side < 2; side++) {
      const [station, deviation, verdict] = [STATION, DEVIATION, VERDICT].map((c) => points.sides[side][c]);
      for (let bin = first; bin <= last; bin++) {
        const value = deviation[bin];
        if (value !== value || station[bin] < this.from || station[bin] > this.to) continue;
        const column = Math.round(this.px(station[bin]) - this.left);
        if (value < low[column]) [low[column], lowVerdict[column]] = [value, verdict[bin]];
        if (value > high[column]) [high[column], highVerdict[column]] = [value, verdict[bin]];
        if (verdict[bin] === NONCONFORM || verdict[bin] === UNCERTAIN) flagged.push([column, value, verdict[bin]]);
      }
    }
    this.drawColumns(pen, low, high, lowVerdict, highVerdict);
    this.drawFlags(pen, flagged);
    if (this.worst) this.drawWorst(pen);
  }

  drawColumns(pen, low, high, lowVerdict, highVerdict) {
    const { zone } = this, paths = {}, half = this.to - this.from < this.nominal.length / 4 ? 1.5 : 1; // few points: larger dots
    for (let column = 0; column < low.length; column++) {
      if (high[column] < low[column]) continue;
      const above = Math.abs(high[column] - this.middle) > Math.abs(low[column] - this.middle);
      const kind = above ? classOf(high[column], highVerdict[column], zone) : classOf(low[column], lowVerdict[column], zone);
      const path = (paths[kind] ??= new Path2D());
      const top = this.py(high[column]) - half, bottom = this.py(low[column]) + half;
      path.rect(this.left + column - 0.75 * half, top, 1.5 * half, bottom - top);
    }
    for (const [kind, path] of Object.entries(paths)) {
      pen.fillStyle = INK[kind];
      pen.fill(path);
    }
    pen.fillStyle = INK.gap; // where nothing was measured yet, the foot of the strip stays empty
    pen.fillRect(this.left, this.bottom - 4, this.right - this.left, 4);
    pen.fillStyle = INK.in;
    for (let column = 0; column < low.length; column++) if (high[column] >= low[column]) pen.fillRect(this.left + column - 1, this.bottom - 4, 3, 4);
  }

  // Shapes on what is not proven to be good: the farthest of every few pixels, so that shapes stay readable.
  drawFlags(pen, flagged) {
    const farthest = new Map();
    for (const one of flagged) {
      const place = `${Math.floor(one[0] / MARK_EVERY_PX)} ${one[1] > this.middle}`;
      const known = farthest.get(place);
      if (!known || Math.abs(one[1] - this.middle) > Math.abs(known[1] - this.middle)) farthest.set(place, one);
    }
    for (const [column, value, verdict] of farthest.values()) mark(pen, classOf(value, verdict, this.zone), this.left + column, this.py(value), 5);
  }

  drawWorst(pen) {
    const { worst } = this;
    if (worst.station_mm < this.from || worst.station_mm > this.to) return;
    const [x, y] = [this.px(worst.station_mm), this.py(worst.deviation_mm)];
    pen.strokeStyle = INK.text;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, 8, 0, 7);
    pen.stroke();
  }

  drawCursor(cursor) {
    const pen = this.sheet.pen("cursor");
    if (!cursor || cursor.station < this.from || cursor.station > this.to) return;
    const [x, y] = [this.px(cursor.station), this.py(cursor.deviation)];
    pen.strokeStyle = INK.text;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x, this.top);
    pen.lineTo(x, this.bottom);
    pen.stroke();
    pen.beginPath();
    pen.arc(x, y, 4.5, 0, 7);
    pen.stroke();
    if (cursor.by === "strip") label(pen, this.sheet, wordsOf(cursor, this.zone), x, y, INK.text);
  }

  // The held point nearest to a place on the sheet.
  nearest(x, y) {
    const { points } = this;
    if (!points?.bins) return null;
    const [first, last] = this.range();
    let best = null, least = Infinity;
    for (let side = 0; side < 2; side++) {
      const [station, deviation] = [points.sides[side][STATION], points.sides[side][DEVIATION]];
      for (let bin = first; bin <= last; bin++) {
        if (deviation[bin] !== deviation[bin]) continue;
        const far = 4 * (this.px(station[bin]) - x) ** 2 + (this.py(deviation[bin]) - y) ** 2;
        if (far < least) [least, best] = [far, [side, bin]];
      }
    }
    return best && points.at(...best);
  }

  zoom(factor, x) {
    const at = this.from + ((x - this.left) / (this.right - this.left)) * (this.to - this.from);
    const span = Math.min(Math.max((this.to - this.from) * factor, this.nominal.length / 2000), this.nominal.length);
    this.look(at - ((at - this.from) / (this.to - this.from)) * span, span);
  }

  pan(px) {
    this.look(this.from + (px / (this.right - this.left)) * (this.to - this.from), this.to - this.from);
  }

  look(from, span) {
    this.from = Math.min(Math.max(from, 0), this.nominal.length - span);
    this.to = this.from + span;
    this.touch();
  }

  fit() {
    if (this.nominal) this.look(0, this.nominal.length);
  }

  reveal(point) {
    const span = this.to - this.from;
    if (point.station < this.from || point.station > this.to) this.look(point.station - span / 2, span);
  }

  place(point) {
    return [this.px(point.station), this.py(point.deviation)];
  }
}
