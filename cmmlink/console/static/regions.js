// Regions of the profile, each with its name, and what a chosen characteristic was found at.

import { INK, cross } from "./sheet.js";

/** @import { CharacteristicRow } from "./protocol.js" */
/** @import { Nominal } from "./points.js" */
/** @import { Profile } from "./profile.js" */
/** @import { Pen } from "./sheet.js" */
/** @typedef {{ row: CharacteristicRow, lane: number }} Region */
/** @typedef {[left: number, top: number, right: number, bottom: number]} Box */

const FROM_LIMIT_PX = 9; // from the upper limit to the first lane, and from lane to lane
const LANE_PX = 8;
const MOST_LETTERS = 28;
const NAME_AT = [0.5, 0.3, 0.7, 0.12, 0.88]; // places along a region at which its name may stand

/**
 * Whether a station lies in the region of a characteristic.
 * @param {Pick<CharacteristicRow, "from_mm" | "to_mm">} row
 * @param {number} station
 */
export function isInside({ from_mm: from, to_mm: to }, station) {
  if (from === null || to === null) return true;
  return from <= to ? station >= from && station <= to : station >= from || station <= to;
}

/**
 * The regions among characteristics, each in the first lane where it meets no other.
 * @param {readonly CharacteristicRow[]} rows
 */
export function lanesOf(rows) {
  /** @type {Region[]} */
  const regions = [];
  for (const row of rows) {
    if (row.from_mm === null) continue;
    const taken = regions.filter((other) => doMeet(row, other.row)).map(({ lane }) => lane);
    let lane = 0;
    while (taken.includes(lane)) lane++;
    regions.push({ row, lane });
  }
  return regions;
}

/**
 * @param {CharacteristicRow} one
 * @param {CharacteristicRow} other
 */
const doMeet = (one, other) => isInside(one, other.from_mm ?? 0) || isInside(other, one.from_mm ?? 0);

/**
 * How much room the regions take outside the tolerance zone, in pixels.
 * @param {readonly Region[]} regions
 * @param {number} text size of letters
 */
export const roomOf = (regions, text) => (regions.length ? LANE_PX * Math.max(...regions.map(({ lane }) => lane)) + 1.5 * text : 0);

/**
 * Draw every region beside the zone, the chosen one stronger, and their names where there is room for them.
 * @param {Pen} pen
 * @param {Profile} profile
 */
export function drawRegions(pen, profile) {
  const { regions, chosen, zone, drawnAt, seen } = profile;
  const inOrder = [...regions].sort((one, other) => Number(other.row === chosen) - Number(one.row === chosen));
  const { height, text, width } = profile.sheet;
  /** @type {Box[]} */
  const boxes = [[0, height - 2.4 * text, 0.3 * width, height]]; // there stands the ruler
  for (const { row, lane } of inOrder) {
    const isChosen = row === chosen, distance = drawnAt * zone.upper_mm + (FROM_LIMIT_PX + LANE_PX * lane) / seen.scale;
    pen.strokeStyle = isChosen ? INK.chosen : INK.region;
    pen.lineWidth = isChosen ? 5 : 2;
    pen.stroke(pathOf(profile, row, distance));
    drawName(pen, profile, row, distance, boxes);
  }
}

/**
 * A region moved along the outward normal, as a path on the sheet.
 * @param {Profile} profile
 * @param {CharacteristicRow} row
 * @param {number} distance
 */
function pathOf(profile, row, distance) {
  const { nominal } = profile, path = new Path2D();
  for (const [first, last] of nominal.pieces) {
    let isDrawn = false;
    for (let k = first; k <= last + Number(nominal.closed); k++) {
      const at = k > last ? first : k, isIn = isInside(row, nominal.station[at]);
      if (isIn && isDrawn) path.lineTo(...profile.moved(at, distance));
      else if (isIn) path.moveTo(...profile.moved(at, distance));
      isDrawn = isIn;
    }
  }
  return path;
}

/**
 * @param {Pen} pen
 * @param {Profile} profile
 * @param {CharacteristicRow} row
 * @param {number} distance
 * @param {Box[]} boxes of the names so far
 */
function drawName(pen, profile, row, distance, boxes) {
  const { nominal, sheet, chosen } = profile, words = cut(row.name), pad = 3;
  if (row === chosen) pen.font = `600 ${pen.font}`;
  const wide = pen.measureText(words).width, high = sheet.text * 1.2;
  for (const share of NAME_AT) {
    const k = nominal.nearest(stationAt(row, share, nominal));
    const [x, y] = profile.moved(k, distance + (sheet.text * 0.8) / profile.seen.scale);
    const wished = x - (wide / 2) * (1 - nominal.nx[k]), left = Math.min(Math.max(wished, pad), sheet.width - wide - pad);
    const top = Math.min(Math.max(y - (high / 2) * (1 + nominal.ny[k]), pad), sheet.height - high - pad);
    /** @type {Box} */
    const box = [left - pad, top - pad, left + wide + pad, top + high + pad];
    const isMoved = Math.abs(left - wished) > sheet.text; // it would lie over the part
    if (isMoved || !profile.holds([x, y]) || boxes.some((other) => doOverlap(box, other))) continue;
    boxes.push(box);
    pen.textAlign = "left";
    pen.textBaseline = "top";
    pen.lineWidth = 4;
    pen.strokeStyle = INK.ground;
    pen.strokeText(words, left, top);
    pen.fillStyle = row === chosen ? INK.chosen : INK.region;
    pen.fillText(words, left, top);
    break;
  }
  pen.font = pen.font.replace(/^(600|bold) /, "");
}

/**
 * @param {CharacteristicRow} row
 * @param {number} share of the region
 * @param {Nominal} nominal
 */
function stationAt({ from_mm, to_mm }, share, nominal) {
  const from = from_mm ?? 0, to = to_mm ?? nominal.length, span = to >= from ? to - from : to + nominal.length - from;
  return (from + share * span) % nominal.length;
}

/**
 * @param {Box} one
 * @param {Box} other
 */
const doOverlap = (one, other) => one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3];

/** @param {string} name */
export const cut = (name) => (name.length > MOST_LETTERS ? `${name.slice(0, MOST_LETTERS - 1)}\u2026` : name);

/**
 * The places that the value of a characteristic was found at, with their names, and the line between two of them.
 * @param {Pen} pen
 * @param {Profile} profile
 * @param {CharacteristicRow} row
 */
export function drawPlaces(pen, profile, { places }) {
  const at = places.map(([, x, y]) => /** @type {[number, number]} */ ([profile.px(x), profile.py(y)]));
  pen.strokeStyle = pen.fillStyle = INK.chosen;
  if (at.length === 2) {
    pen.lineWidth = 1.5;
    pen.setLineDash([9, 4]);
    pen.beginPath();
    pen.moveTo(...at[0]);
    pen.lineTo(...at[1]);
    pen.stroke();
    pen.setLineDash([]);
  }
  pen.textBaseline = "bottom";
  at.forEach(([x, y], k) => {
    cross(pen, x, y, 6, INK.chosen);
    const isRight = x > profile.sheet.width / 2;
    pen.textAlign = isRight ? "right" : "left";
    pen.lineWidth = 4;
    pen.strokeStyle = INK.ground;
    pen.strokeText(places[k][0], x + (isRight ? -9 : 9), y - 5);
    pen.fillStyle = INK.chosen;
    pen.fillText(places[k][0], x + (isRight ? -9 : 9), y - 5);
  });
}
