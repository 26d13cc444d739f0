// Run chart: the worst deviation of the last parts (or of a surface's sections), with their own limits; the verdict by shape.

import { INK, Sheet, mark, signed } from "./sheet.js";

const FEWEST = 20;

export class Chart {
  constructor(element, large) {
    this.large = large;
    this.sheet = new Sheet(element, () => this.draw());
    this.runs = [];
  }

  // In the order of drawing: the newest part, or the highest section, last.
  show(runs) {
    this.runs = runs.filter((run) => run.worst_mm !== null);
    this.draw();
  }

  draw() {
    const { sheet, runs } = this, pen = sheet.pen("ground");
    if (!sheet.width) return;
    const left = sheet.text * 4.4, right = sheet.width - sheet.text, top = sheet.text * 0.6, bottom = sheet.height - sheet.text * (this.large ? 2 : 0.6);
    if (!runs.length) {
      pen.fillStyle = INK.soft;
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillText("no part was measured yet", sheet.width / 2, sheet.height / 2);
      return;
    }
    const values = runs.flatMap((run) => [run.worst_mm, run.lower_mm, run.upper_mm]);
    const low = Math.min(...values), high = Math.max(...values), room = (high - low) * 0.12 || 0.01;
    this.places = Math.max(FEWEST, runs.length);
    const px = (k) => left + ((k + 0.5) / this.places) * (right - left);
    const py = (value) => bottom - ((value - low + room) / (high - low + 2 * room)) * (bottom - top);
    this.limits(pen, px, py, left);
    pen.strokeStyle = INK.faint;
    pen.lineWidth = 1.5;
    pen.beginPath();
    runs.forEach((run, k) => pen[k ? "lineTo" : "moveTo"](px(k), py(run.worst_mm)));
    pen.stroke();
    runs.forEach((run, k) => this.point(pen, run, px(k), py(run.worst_mm), k === runs.length - 1));
    if (this.large) this.serials(pen, px, bottom);
  }

  limits(pen, px, py, left) {
    const half = px(1) - px(0);
    pen.fillStyle = INK.band;
    this.runs.forEach((run, k) => {
      const [from, to] = [Math.round(px(k) - half / 2), Math.round(px(k) + half / 2)];
      pen.fillRect(from, py(run.upper_mm), to - from, py(run.lower_mm) - py(run.upper_mm));
    });
    pen.fillStyle = INK.soft;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const last = this.runs.at(-1);
    for (const limit of [last.upper_mm, last.lower_mm]) pen.fillText(signed(limit, 3), left - 6, py(limit));
    pen.strokeStyle = INK.faint;
    pen.beginPath();
    pen.moveTo(left, py(0));
    pen.lineTo(px(this.places - 0.5), py(0));
    pen.stroke();
  }

  point(pen, run, x, y, newest) {
    const size = this.large ? 6 : 4;
    if (run.verdict === "nonconform") mark(pen, run.worst_mm > (run.lower_mm + run.upper_mm) / 2 ? "over" : "under", x, y, size + 1);
    else if (run.verdict === "conform") {
      pen.fillStyle = INK.in;
      pen.beginPath();
      pen.arc(x, y, size - 0.5, 0, 7);
      pen.fill();
    } else mark(pen, "unsure", x, y, size);
    if (!newest) return;
    pen.strokeStyle = INK.text;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.arc(x, y, size + 4, 0, 7);
    pen.stroke();
  }

  serials(pen, px, bottom) {
    const { sheet, runs } = this;
    const every = Math.ceil((sheet.text * 6) / (px(1) - px(0)));
    pen.fillStyle = INK.soft;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    runs.forEach((run, k) => {
      if ((runs.length - 1 - k) % every === 0) pen.fillText((run.label ?? (run.serial_number || run.run)).slice(-10), px(k), bottom + 6);
    });
  }
}
