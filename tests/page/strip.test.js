// No spike is hidden: what a pixel column keeps of the points in it.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Columns } from "../../cmmlink/console/static/strip.js";

test("a column keeps its lowest and its highest point with their verdicts", () => {
  const columns = new Columns(3);
  for (const [column, deviation, verdict] of [[1, 0.25, 0], [1, 0.5, 2], [1, 0.375, 1], [1, -0.125, 1]]) {
    columns.add(column, deviation, verdict);
  }
  assert.deepEqual([...columns.filled()], [1]);
  assert.deepEqual([columns.low[1], columns.high[1]], [-0.125, 0.5]);
  assert.deepEqual(columns.farthest(1, 0), { deviation: 0.5, verdict: 2 });
  assert.deepEqual(columns.farthest(1, 0.25), { deviation: -0.125, verdict: 1 });
});

test("a single point is the lowest and the highest of its column", () => {
  const columns = new Columns(1);
  columns.add(0, -0.5, 2);
  assert.deepEqual(columns.farthest(0, 0), { deviation: -0.5, verdict: 2 });
  assert.deepEqual([...new Columns(4).filled()], []);
});
