// What the page decodes from the binary messages, and which points it finds in it.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Nominal, Points, Scan, classOf, toleranceUse } from "../../cmmlink/console/static/points.js";

const ZONE = { lower_mm: -0.04, upper_mm: 0.06, uncertainty_mm: 0.004 };
const BINS = 8;

/**
 * A message as the module docstring of the server's messages describes it, byte by byte: little-endian, 32 bytes of head.
 * @param {{ kind: number, generation?: number, flags?: number, timeMs?: number, number: number }} head
 * @param {number[][]} columns
 * @param {number[]} [bins]
 */
function message({ kind, generation = 0, flags = 0, timeMs = 0, number }, columns, bins) {
  const rows = columns[0].length, all = bins ? [bins, ...columns] : columns;
  const buffer = new ArrayBuffer(32 + 4 * rows * all.length), view = new DataView(buffer);
  [kind, generation, rows, flags].forEach((value, k) => view.setUint32(4 * k, value, true));
  view.setFloat64(16, timeMs, true);
  view.setFloat64(24, number, true);
  all.flat().forEach((value, k) => {
    if (bins && k < rows) view.setUint32(32 + 4 * k, value, true);
    else view.setFloat32(32 + 4 * k, value, true);
  });
  return buffer;
}

/**
 * Bins with a lowest and a highest point each: [station, deviation, foot x, foot y, normal x, normal y, verdict] twice.
 * @param {number} generation
 * @param {Record<number, number[][]>} bins
 */
function points(generation, bins) {
  const numbers = Object.keys(bins).map(Number);
  const columns = Array.from({ length: 14 }, (_, k) => numbers.map((bin) => bins[bin].flat()[k]));
  return message({ kind: 1, generation, timeMs: 1_700_000_000_000.5, number: BINS }, columns, numbers);
}

/** A straight nominal of 80 mm along x, its normal along y. */
const straight = () => message({ kind: 2, flags: 0, number: 80 }, [[0, 40, 80], [0, 40, 80], [5, 5, 5], [0, 0, 0], [1, 1, 1]]);

/**
 * @param {number} station
 * @param {number} deviation
 */
const point = (station, deviation, verdict = 0) => [station, deviation, station, 5, 0, 1, verdict];

test("points are decoded with their place one deviation away from the foot", () => {
  const held = new Points();
  held.take(points(1, { 3: [point(31, -0.25, 2), point(32, 0.5, 1)], 6: [point(61, 0.125), point(61, 0.125)] }));
  assert.deepEqual(held.at(0, 3), { side: 0, bin: 3, station: 31, deviation: -0.25, verdict: 2, x: 31, y: 4.75 });
  assert.deepEqual(held.at(1, 3), { side: 1, bin: 3, station: 32, deviation: 0.5, verdict: 1, x: 32, y: 5.5 });
  assert.deepEqual([0, 1, 2, 3, 4, 5, 6, 7].map((bin) => held.isEmpty(bin)), [true, true, true, false, true, true, false, true]);
  assert.equal(held.held, 2);
  assert.equal(held.newestMs, 1_700_000_000_000.5);
});

test("a bin that changed is replaced and counted once; another generation voids all", () => {
  const held = new Points();
  held.take(points(1, { 3: [point(31, -0.25), point(32, 0.5)] }));
  held.take(points(1, { 3: [point(31, -0.5), point(32, 0.75)], 4: [point(41, 0), point(41, 0)] }));
  assert.equal(held.held, 2);
  assert.equal(held.at(0, 3).deviation, -0.5);
  held.take(points(2, { 5: [point(51, 0), point(51, 0)] }));
  assert.equal(held.held, 1);
  assert.ok(held.isEmpty(3));
});

test("a message without a row voids what was sent before and breaks nothing", () => {
  const held = new Points();
  held.take(points(1, { 3: [point(31, -0.25), point(32, 0.5)] }));
  held.take(points(2, {}));
  assert.equal(held.held, 0);
  assert.equal(held.worst(ZONE), null);
});

test("the worst point is the one farthest from the middle of the zone, on either side", () => {
  const held = new Points();
  held.take(points(1, { 2: [point(21, -0.0625), point(22, 0.0625)], 5: [point(51, -0.03125), point(52, 0.078125)] }));
  assert.equal(held.worst(ZONE)?.station, 21);
  held.take(points(1, { 6: [point(61, 0), point(62, 0.25)] }));
  assert.equal(held.worst(ZONE)?.station, 62);
});

test("points are looked for in the bins that are named only", () => {
  const held = new Points();
  held.take(points(1, { 2: [point(21, -0.5), point(22, 0.5)], 5: [point(51, 0), point(52, 0.25)] }));
  const station = (/** @type {number} */ side, /** @type {number} */ bin) => held.sides[side][0][bin];
  assert.equal(held.least(station)?.station, 21);
  assert.equal(held.least(station, 3, 7)?.station, 51);
  assert.equal(held.least(station, 6, 7), null);
});

test("a closed nominal of one piece is decoded with its box", () => {
  const nominal = Nominal.decode(
    message({ kind: 2, flags: 1, number: 12.5 }, [[0, 4, 8], [-1, 3, 0], [2, -4, 0.5], [0, 1, 0], [1, 0, -1]]),
  );
  assert.deepEqual([...nominal.station], [0, 4, 8]);
  assert.deepEqual([[...nominal.nx], [...nominal.ny]], [[0, 1, 0], [1, 0, -1]]);
  assert.deepEqual([nominal.rows, nominal.length, nominal.closed], [3, 12.5, true]);
  assert.deepEqual(nominal.box, [-1, -4, 3, 2]);
  assert.deepEqual(nominal.pieces, [[0, 2]]);
  assert.equal(nominal.nearest(5), 1);
  assert.equal(nominal.nearest(100), 2);
});

test("a nominal of several pieces is not closed by a line from its end to its beginning", () => {
  const gap = NaN;
  const nominal = Nominal.decode(message(
    { kind: 2, flags: 1, number: 20 }, [[0, 5, gap, 5, 20], [0, 5, gap, 5, 0], [1, 1, gap, 1, 9], [0, 0, gap, 1, 1], [1, 1, gap, 0, 0]],
  ));
  assert.deepEqual(nominal.pieces, [[0, 1], [3, 4]]);
  assert.equal(nominal.closed, false);
  assert.deepEqual(nominal.box, [0, 1, 5, 9]);
  assert.equal(nominal.nearest(19), 4);
});

test("another nominal begins another scan, whose points are not mixed with those before", () => {
  const scan = new Scan();
  scan.take(straight());
  scan.take(points(1, { 3: [point(31, -0.25), point(32, 0.5)] }));
  const first = scan.nominal;
  scan.take(straight());
  scan.take(points(1, { 6: [point(61, 0), point(62, 0.125)] })); // both runs may have the same generation
  assert.notEqual(scan.nominal, first);
  assert.ok(scan.points.isEmpty(3));
  assert.equal(scan.points.worst(ZONE)?.station, 62);
});

test("the class of a point follows its verdict, then its share of the tolerance", () => {
  assert.equal(classOf(0.07, 2, ZONE), "over");
  assert.equal(classOf(-0.05, 2, ZONE), "under");
  assert.equal(classOf(0.059, 1, ZONE), "not-proven");
  assert.equal(classOf(0.0505, 0, ZONE), "near");
  assert.equal(classOf(0.0495, 0, ZONE), "in");
  assert.equal(classOf(-0.0305, 0, ZONE), "near");
});

test("a limit is the whole tolerance and the middle of the zone nothing of it", () => {
  for (const [deviation, use] of [[0.06, 1], [-0.04, 1], [0.01, 0], [0.085, 1.5]]) {
    assert.ok(Math.abs(toleranceUse(deviation, ZONE) - use) < 1e-12);
  }
});
