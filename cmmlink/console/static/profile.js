// The profile with its tolerance band and the deviations magnified along the normal.

import { CLASSES, DEVIATION, NX, NY, STATION, VERDICT, X, Y, classOf } from "./points.js";
import { INK, Sheet, label, mark, signed, digitsFor, wordsOf } from "./sheet.js";

const CELL_PX = 1.6; // whiskers closer together than this cannot be told apart
const MARK_EVERY_PX = 9;
const BAND_PX = 15; // half width of the tolerance band that the automatic magnification aims at

export class Profile {
  constructor(element, onChange) {
    this.name = "profile";
    this.element = element;
    this.onChange = onChange;
    this.sheet = new Sheet(element, () => this.refit());
    this.magnification = null; // null: chosen by itself
    this.view = null; // null: all of it
  }

  touch() {
    this.groundDirty = this.marksDirty = this.cursorDirty = true;
    this.onChange?.();
  }

  refit() {
    if (this.nominal && this.sheet.width) this.all = this.whole();
    this.touch();
  }

  show(points, nominal, zone, worst) {
    if (nominal !== this.nominal || zone.lower_mm !== this.zone?.lower_mm || zone.upper_mm !== this.zone?.upper_mm) {
      if (nominal !== this.nominal) this.view = null;
      this.nominal = nominal;
      this.zone = zone;
      this.all = this.whole();
      this.groundDirty = true;
    }
    this.points = points;
    this.worst = worst;
    if (this.magnified !== this.drawnAt) this.groundDirty = true;
    this.drawnAt = this.magnified;
    this.marksDirty = this.cursorDirty = true;
  }

  // The view that shows the whole nominal with room for whiskers: pixels per mm and the place of the origin.
  whole() {
    const { sheet } = this, [x0, y0, x1, y1] = this.nominal.box;
    const room = Math.min(sheet.width, sheet.height) * 0.04 + 3.2 * BAND_PX;
    const scale = Math.min((sheet.width - 2 * room) / Math.max(x1 - x0, 1e-9), (sheet.height - 2 * room) / Math.max(y1 - y0, 1e-9));
    return { scale, x: sheet.width / 2 - ((x0 + x1) / 2) * scale, y: sheet.height / 2 + ((y0 + y1) / 2) * scale };
  }

  get seen() {
    return this.view ?? this.all;
  }

  // The band as wide as BAND_PX asks for, unless the worst deviation would then leave the sheet.
  get autoMagnification() {
    const half = (this.zone.upper_mm - this.zone.lower_mm) / 2, most = 0.3 * Math.min(this.sheet.width, this.sheet.height);
    const worst = Math.max(Math.abs(this.worst?.deviation_mm ?? 0), 1e-9);
    return Math.max(1, Math.min(BAND_PX / half, most / worst) / this.all.scale);
  }

  get magnified() {
    return this.magnification ?? this.autoMagnification;
  }

  draw(cursor) {
    if (!this.nominal || !this.sheet.width || !this.all) return;
    if (this.groundDirty) this.drawGround();
    if (this.groundDirty || this.marksDirty) this.drawMarks();
    if (this.groundDirty || this.marksDirty || this.cursorDirty) this.drawCursor(cursor);
    this.groundDirty = this.marksDirty = this.cursorDirty = false;
  }

  px(x) {
    return this.seen.x + x * this.seen.scale;
  }

  py(y) {
    return this.seen.y - y * this.seen.scale;
  }

  // The nominal moved along its outward normal, as a path on the sheet.
  offset(path, distance) {
    const { x, y, nx, ny, rows, closed } = this.nominal;
    let up = true;
    for (let k = 0; k < rows; k++) {
      if (x[k] !== x[k]) {
        up = true;
        continue;
      }
      const [px, py] = [this.px(x[k] + distance * nx[k]), this.py(y[k] + distance * ny[k])];
      if (up) path.moveTo(px, py);
      else path.lineTo(px, py);
      up = false;
    }
    if (closed && !x.some((value) => value !== value)) path.closePath();
    return path;
  }

  // Where along the nominal each sample's band quadrilateral lies; filled one by one so that loops of the offset do no harm.
  band(pen, lower, upper) {
    const { x, y, nx, ny, rows, closed } = this.nominal;
    const path = new Path2D();
    const put = (k, l) => {
      path.moveTo(this.px(x[k] + lower * nx[k]), this.py(y[k] + lower * ny[k]));
      path.lineTo(this.px(x[k] + upper * nx[k]), this.py(y[k] + upper * ny[k]));
      path.lineTo(this.px(x[l] + upper * nx[l]), this.py(y[l] + upper * ny[l]));
      path.lineTo(this.px(x[l] + lower * nx[l]), this.py(y[l] + lower * ny[l]));
      path.closePath();
    };
    let from = 0;
    for (let k = 1; k < rows; k++) {
      if (x[k] !== x[k]) from = k + 1;
      else if (k > from && this.far(from, k) > 2.5) {
        put(from, k);
        from = k;
      }
    }
    put(from, closed && !x.some((value) => value !== value) ? 0 : rows - 1);
    pen.fillStyle = INK.band;
    pen.fill(path, "nonzero");
    pen.strokeStyle = INK.band;
    pen.lineWidth = 0.6;
    pen.stroke(path);
  }

  far(k, l) {
    const { x, y, nx, ny } = this.nominal;
    const turned = Math.abs(nx[k] * ny[l] - ny[k] * nx[l]) * 40;
    return Math.hypot(x[k] - x[l], y[k] - y[l]) * this.seen.scale + turned;
  }

  drawGround() {
    const { zone, sheet } = this, pen = sheet.pen("ground"), m = this.magnified;
    this.band(pen, zone.lower_mm * m, zone.upper_mm * m);
    pen.strokeStyle = INK.limit;
    pen.lineWidth = 1;
    pen.setLineDash([7, 5]);
    pen.stroke(this.offset(new Path2D(), zone.lower_mm * m));
    pen.stroke(this.offset(new Path2D(), zone.upper_mm * m));
    pen.setLineDash([]);
    pen.strokeStyle = INK.line;
    pen.lineWidth = 1.75;
    pen.stroke(this.offset(new Path2D(), 0));
    this.drawRuler(pen);
  }

  // A length on the part and, magnified, a length of deviation: what the eye needs to read the drawing.
  drawRuler(pen) {
    const { sheet, zone } = this, y = sheet.height - sheet.text * 1.1;
    const wanted = (sheet.width * 0.14) / this.seen.scale;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = power * (wanted / power >= 5 ? 5 : wanted / power >= 2 ? 2 : 1);
    const x = sheet.text, wide = length * this.seen.scale;
    pen.strokeStyle = INK.soft;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, y - 5);
    pen.lineTo(x, y);
    pen.lineTo(x + wide, y);
    pen.lineTo(x + wide, y - 5);
    pen.stroke();
    pen.fillStyle = INK.soft;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.fillText(`${+length.toPrecision(3)} mm`, x + wide + 8, y - 3);
  }

  drawMarks() {
    const { sheet, points, nominal, zone } = this, pen = sheet.pen("marks");
    if (!points?.bins) return;
    const m = this.magnified, paths = {}, flags = new Map();
    const perCell = Math.max(1, Math.floor((CELL_PX / this.seen.scale / nominal.length) * points.bins));
    const [low, high] = points.sides;
    for (let start = 0; start < points.bins; start += perCell) {
      let [least, most] = [-1, -1];
      for (let bin = start; bin < Math.min(start + perCell, points.bins); bin++) {
        if (low[DEVIATION][bin] !== low[DEVIATION][bin]) continue;
        if (least < 0 || low[DEVIATION][bin] < low[DEVIATION][least]) least = bin;
        if (most < 0 || high[DEVIATION][bin] > high[DEVIATION][most]) most = bin;
      }
      if (least < 0) continue;
      if (low[DEVIATION][least] < 0 || least === most || low[VERDICT][least] > 0) this.whisker(paths, flags, low, least, m);
      if (high[DEVIATION][most] >= 0 || high[VERDICT][most] > 0) this.whisker(paths, flags, high, most, m);
    }
    for (const kind of CLASSES) {
      if (!paths[kind]) continue;
      pen.strokeStyle = INK[kind];
      pen.lineWidth = 2; // no gaps between neighbours: the deviations read as one shape
      pen.stroke(paths[kind]);
    }
    for (const [kind, x, y, size] of flags.values()) mark(pen, kind, x, y, size);
    if (this.worst) this.drawWorst(pen, m);
  }

  whisker(paths, flags, side, bin, m) {
    const deviation = side[DEVIATION][bin], verdict = side[VERDICT][bin];
    const [fx, fy] = [this.px(side[X][bin]), this.py(side[Y][bin])];
    const [tx, ty] = [fx + m * deviation * side[NX][bin] * this.seen.scale, fy - m * deviation * side[NY][bin] * this.seen.scale];
    const { width, height } = this.sheet;
    if (Math.max(fx, tx) < -20 || Math.min(fx, tx) > width + 20 || Math.max(fy, ty) < -20 || Math.min(fy, ty) > height + 20) return;
    const kind = classOf(deviation, verdict, this.zone);
    const path = (paths[kind] ??= new Path2D());
    path.moveTo(fx, fy);
    path.lineTo(tx, ty);
    if (verdict < 1) return;
    const place = `${Math.round(tx / MARK_EVERY_PX)} ${Math.round(ty / MARK_EVERY_PX)}`;
    if (!flags.has(place)) flags.set(place, [kind, tx, ty, 4.5]);
  }

  tip(point) {
    const m = this.magnified, at = this.nearestSample(point.station_mm);
    const [nx, ny] = [this.nominal.nx[at], this.nominal.ny[at]];
    const [x, y] = [point.x_mm - point.deviation_mm * nx, point.y_mm - point.deviation_mm * ny];
    return [this.px(x + m * point.deviation_mm * nx), this.py(y + m * point.deviation_mm * ny)];
  }

  nearestSample(station) {
    let [best, least] = [0, Infinity];
    this.nominal.station.forEach((value, k) => {
      const far = Math.abs(value - station);
      if (far < least) [least, best] = [far, k];
    });
    return best;
  }

  drawWorst(pen) {
    const { worst, zone, sheet } = this, [x, y] = this.tip(worst);
    if (x < 0 || y < 0 || x > sheet.width || y > sheet.height) return;
    pen.strokeStyle = INK.text;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, 9, 0, 7);
    pen.stroke();
    const ink = worst.verdict === "nonconform" ? INK[classOf(worst.deviation_mm, 2, zone)] : INK.limit;
    label(pen, this.sheet, `${signed(worst.deviation_mm, digitsFor(zone))} mm at ${worst.station_mm.toFixed(2)} mm`, x, y, ink, true);
  }

  drawCursor(cursor) {
    const pen = this.sheet.pen("cursor");
    if (!cursor) return;
    const [x, y] = this.place(cursor);
    pen.strokeStyle = INK.text;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.arc(x, y, 6, 0, 7);
    pen.stroke();
    if (cursor.by === "profile") label(pen, this.sheet, wordsOf(cursor, this.zone), x, y, INK.text);
  }

  place(point) {
    const side = this.points.sides[point.side], m = this.magnified * point.deviation;
    return [this.px(side[X][point.bin] + m * side[NX][point.bin]), this.py(side[Y][point.bin] + m * side[NY][point.bin])];
  }

  nearest(x, y) {
    const { points } = this;
    if (!points?.bins) return null;
    const m = this.magnified, { scale } = this.seen;
    let best = null, least = Infinity;
    for (let s = 0; s < 2; s++) {
      const side = points.sides[s];
      for (let bin = 0; bin < points.bins; bin++) {
        const deviation = side[DEVIATION][bin];
        if (deviation !== deviation) continue;
        const [fx, fy] = [this.px(side[X][bin]) - x, this.py(side[Y][bin]) - y];
        const [wx, wy] = [m * deviation * side[NX][bin] * scale, -m * deviation * side[NY][bin] * scale];
        const along = Math.min(1, Math.max(0, -(fx * wx + fy * wy) / (wx * wx + wy * wy || 1)));
        const far = (fx + along * wx) ** 2 + (fy + along * wy) ** 2;
        if (far < least) [least, best] = [far, [s, bin]];
      }
    }
    return best && points.at(...best);
  }

  zoom(factor, x, y) {
    const seen = this.seen, scale = Math.min(Math.max(seen.scale / factor, this.all.scale), this.all.scale * 400);
    const share = scale / seen.scale;
    this.view = scale === this.all.scale ? null : { scale, x: x - (x - seen.x) * share, y: y - (y - seen.y) * share };
    this.touch();
  }

  pan(dx, dy = 0) {
    if (!this.view) this.view = { ...this.all };
    this.view = { ...this.view, x: this.view.x - dx, y: this.view.y - dy };
    this.touch();
  }

  fit() {
    this.view = null;
    this.touch();
  }

  reveal(point) {
    const [x, y] = this.place(point), { width, height } = this.sheet;
    if (x < 0 || x > width || y < 0 || y > height) this.pan(x - width / 2, y - height / 2);
  }

  magnify(magnification) {
    this.magnification = magnification;
    this.touch();
  }
}
