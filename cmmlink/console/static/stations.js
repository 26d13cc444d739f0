// Stations on the profile: a tick every so many mm with its number, and at the start a dot and an arrow the way that stations count.

import { niceStep } from "./numbers.js";
import { INK } from "./sheet.js";

/** @import { Profile } from "./profile.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {[left: number, top: number, right: number, bottom: number]} Box */

const EVERY_PX = 90; // about so far apart
const FROM_LIMIT_PX = 4, TICK_PX = 6, NUMBER_PX = 5;
const ARROW_PX = 30, HEAD_PX = 7, DOT_PX = 4.5;

/**
 * Draw the stations inside the zone's lower limit, and outside of the upper one where a number has no room.
 * @param {Pen} pen
 * @param {Profile} profile
 */
export function drawStations(pen, profile) {
  const { nominal, seen } = profile;
  if (!nominal.rows || !nominal.length) return;
  const step = niceStep(nominal.length, Math.max(1, (nominal.length * seen.scale) / EVERY_PX));
  /** @type {Box[]} */
  const boxes = [];
  pen.strokeStyle = pen.fillStyle = INK.soft;
  pen.lineWidth = 1.5;
  const last = nominal.closed ? nominal.length - step / 2 : nominal.length; // a closed profile ends where it starts
  for (let station = 0; station <= last + 1e-6 * step; station += step) drawStation(pen, profile, station, boxes);
  drawStart(pen, profile);
}

/**
 * How far from the nominal the marks of one side begin, in mm; negative inside.
 * @param {Profile} profile
 * @param {-1 | 1} side
 */
function edgeOf({ zone, drawnAt, seen }, side) {
  const limit = side < 0 ? Math.min(zone.lower_mm, 0) : Math.max(zone.upper_mm, 0);
  return limit * drawnAt + (side * FROM_LIMIT_PX) / seen.scale;
}

/**
 * @param {Pen} pen
 * @param {Profile} profile
 * @param {number} station
 * @param {Box[]} boxes of the numbers so far
 */
function drawStation(pen, profile, station, boxes) {
  const { nominal, sheet, seen } = profile, k = nominal.nearest(station), words = String(Number(station.toPrecision(6)));
  const wide = pen.measureText(words).width, high = sheet.text;
  for (const side of /** @type {const} */ ([-1, 1])) {
    const edge = edgeOf(profile, side), tip = edge + (side * TICK_PX) / seen.scale;
    const [fromX, fromY] = profile.moved(k, edge), [x, y] = profile.moved(k, tip);
    if (!profile.holds([x, y])) return;
    const ahead = side * nominal.nx[k], up = side * nominal.ny[k];
    const left = x + ahead * NUMBER_PX - (wide / 2) * (1 - ahead), top = y - up * NUMBER_PX - (high / 2) * (1 + up);
    /** @type {Box} */
    const box = [left - 2, top - 1, left + wide + 2, top + high + 1];
    if (!profile.holds([box[0], box[1]]) || !profile.holds([box[2], box[3]]) || isTaken(profile, box, boxes)) continue;
    boxes.push(box);
    pen.beginPath();
    pen.moveTo(fromX, fromY);
    pen.lineTo(x, y);
    pen.stroke();
    pen.textAlign = "left";
    pen.textBaseline = "top";
    pen.fillText(words, left, top);
    return;
  }
}

/**
 * Whether a number would lie on another one, or on the profile.
 * @param {Profile} profile
 * @param {Box} box
 * @param {readonly Box[]} boxes
 */
function isTaken(profile, box, boxes) {
  if (boxes.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3])) return true;
  const { x, y, rows } = profile.nominal;
  for (let k = 0; k < rows; k++) {
    const px = profile.px(x[k]), py = profile.py(y[k]);
    if (px > box[0] && px < box[2] && py > box[1] && py < box[3]) return true;
  }
  return false;
}

/**
 * A dot at the start of the profile, and an arrow beside it.
 * @param {Pen} pen
 * @param {Profile} profile
 */
function drawStart(pen, profile) {
  const { nominal, seen } = profile, [first, last] = nominal.pieces[0] ?? [0, 0], edge = edgeOf(profile, 1) + FROM_LIMIT_PX / seen.scale;
  pen.fillStyle = pen.strokeStyle = INK.line;
  const [x, y] = profile.moved(first, 0);
  pen.beginPath();
  pen.arc(x, y, DOT_PX, 0, 2 * Math.PI);
  pen.fill();
  let k = first + 1;
  while (k < last && (nominal.station[k] - nominal.station[first]) * seen.scale < ARROW_PX) k++;
  if (k > last) return;
  const [fromX, fromY] = profile.moved(first, edge), [toX, toY] = profile.moved(k, edge), turn = Math.atan2(toY - fromY, toX - fromX);
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(fromX, fromY);
  for (let at = first + 1; at <= k; at++) pen.lineTo(...profile.moved(at, edge));
  for (const aside of [2.6, -2.6]) {
    pen.moveTo(toX + HEAD_PX * Math.cos(turn + aside), toY + HEAD_PX * Math.sin(turn + aside));
    pen.lineTo(toX, toY);
  }
  pen.stroke();
}
