// What the page holds of a whole surface, and from where it is looked at.

import assert from "node:assert/strict";
import { test } from "node:test";

import { SurfaceScan, surfaceClassOf } from "../../cmmlink/console/static/surface_scan.js";
import { Turn } from "../../cmmlink/console/static/turn.js";

const ZONE = { lower_mm: -0.05, upper_mm: 0.05, uncertainty_mm: 0.01 };
const BOX = { low: /** @type {const} */ ([0, 0, 0]), high: /** @type {const} */ ([30, 18, 12]) };
const NEAR = 1e-9;

/**
 * A message as the server packs it: 32 bytes of head; rows of [slot,] x, y, z, deviation and the bytes of the normal.
 * @param {{ kind: number, generation?: number, number: number }} head
 * @param {number[][]} rows
 */
function message({ kind, generation = 0, number }, rows) {
  const wide = 4 * (kind === 3 ? 6 : 5), buffer = new ArrayBuffer(32 + wide * rows.length), view = new DataView(buffer);
  [kind, generation, rows.length, 0].forEach((value, k) => view.setUint32(4 * k, value, true));
  view.setFloat64(24, number, true);
  rows.forEach((row, k) => {
    const at = 32 + wide * k, floats = kind === 3 ? row.slice(1, 5) : row.slice(0, 4), from = at + wide - 20;
    if (kind === 3) view.setUint32(at, row[0], true);
    floats.forEach((value, place) => view.setFloat32(from + 4 * place, value, true));
    row.slice(-3).forEach((value, place) => view.setInt8(from + 16 + place, value));
  });
  return buffer;
}

const NOMINAL = message({ kind: 4, number: 2 }, [[0, 0, 0, 0, 0, 0, 127], [30, 18, 12, 0, 127, 0, 0]]);

test("voxels that changed replace what stood in their places, and another generation voids all", () => {
  const scan = new SurfaceScan();
  assert.ok(scan.take(NOMINAL));
  assert.deepEqual(scan.box, BOX);
  scan.take(message({ kind: 3, generation: 1, number: 0.5 }, [[0, 1, 2, 3, 0.25, 0, 127, 0], [1, 4, 5, 6, -0.5, 0, 0, -127]]));
  scan.take(message({ kind: 3, generation: 1, number: 0.5 }, [[1, 4, 5, 6, 0.75, 127, 0, 0], [2, 7, 8, 9, 0, 0, 0, 127]]));
  assert.equal(scan.points.count, 3);
  assert.deepEqual([0, 1, 2].map((row) => scan.points.deviation(row)), [0.25, 0.75, 0]);
  assert.deepEqual(scan.points.place(1), [4, 5, 6]);
  assert.deepEqual(scan.points.normal(1), [127, 0, 0]);
  assert.deepEqual(scan.points.fetch(), [0, 3]);
  assert.deepEqual(scan.points.fetch(), [0, 0]);
  scan.take(message({ kind: 3, generation: 2, number: 1 }, [[0, 1, 1, 1, 0, 0, 0, 127]]));
  assert.equal(scan.points.count, 1);
  assert.equal(scan.size, 1);
  assert.equal(scan.take(message({ kind: 1, number: 1 }, [])), false);
});

test("larger voxels keep the worst point of those in them, on either side of the zone's middle", () => {
  const scan = new SurfaceScan();
  const deviations = [0.01, -0.2, 0.03, 0.1];
  scan.take(message({ kind: 3, generation: 1, number: 1 }, deviations.map((value, k) => [k, k < 3 ? k / 4 : 9, 0, 0, value, 0, 0, 127])));
  assert.deepEqual([...scan.points.few(4, 0)], [1, 3]);
  assert.deepEqual([...scan.points.few(4, -0.25)], [2, 3]);
});

test("a point is coloured by what is proven of it", () => {
  const classes = [0.0, 0.039, 0.045, 0.055, 0.0601, -0.0601].map((value) => surfaceClassOf(value, ZONE));
  assert.deepEqual(classes, ["within", "within", "not_proven", "not_proven", "above", "below"]);
});

test("a turn keeps its directions at right angles, and pushing the front to the right moves it there", () => {
  const turn = new Turn();
  turn.resize(400, 300);
  turn.behold(BOX);
  for (let k = 0; k < 200; k++) turn.push(0.05 * Math.sin(k), 0.03);
  const [a, b, c] = turn.axes;
  const dot = (/** @type {readonly number[]} */ u, /** @type {readonly number[]} */ v) => u.reduce((sum, x, k) => sum + x * v[k], 0);
  for (const [u, v, is] of /** @type {const} */ ([[a, a, 1], [b, b, 1], [c, c, 1], [a, b, 0], [b, c, 0], [a, c, 0]])) {
    assert.ok(Math.abs(dot(u, v) - is) < NEAR);
  }
  /** @type {readonly [number, number, number]} */
  const front = [turn.centre[0] + c[0], turn.centre[1] + c[1], turn.centre[2] + c[2]], [x, y] = turn.seen(front);
  turn.push(0.1, 0.1);
  const [then, below] = turn.seen(front);
  assert.ok(then > x && below > y);
});

test("the whole part fits the sheet, what is zoomed at stays in its place, and a place that is gone to is in the middle", () => {
  const turn = new Turn();
  turn.resize(400, 300);
  turn.behold(BOX);
  for (const x of [0, 30]) {
    for (const y of [0, 18]) {
      for (const z of [0, 12]) {
        const [u, v] = turn.seen([x, y, z]);
        assert.ok(u > 0 && u < 400 && v > 0 && v < 300);
      }
    }
  }
  const [u, v] = turn.seen([30, 0, 12]);
  turn.zoom(3, u, v);
  assert.deepEqual(turn.seen([30, 0, 12]).slice(0, 2).map(Math.round), [u, v].map(Math.round));
  turn.goTo([22, 7, 12], [0, 0, 127], 6);
  assert.deepEqual(turn.seen([22, 7, 12]).slice(0, 2).map(Math.round), [200, 150]);
  assert.ok(Math.abs(turn.axes[2][2] - 1) < NEAR);
});
