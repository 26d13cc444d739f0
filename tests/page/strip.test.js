// No spike is hidden: what a pixel column keeps of the points in it. And the names of the limits.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Columns, Strip } from "../../cmmlink/console/static/strip.js";

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

/**
 * What is written at the left of the strip and at which height, from top to bottom; letters are 12 pixels high.
 * @param {number} lower height at which the lower limit is drawn, pixels from the top
 * @param {number} upper
 */
function labelsOf(lower, upper) {
  const strip = Object.create(Strip.prototype), pen = { labels: [], fillText: (words, x, y) => pen.labels.push({ words, x, y }) };
  Object.assign(strip, { zone: { lower_mm: -0.05, upper_mm: 0.08, uncertainty_mm: 0 }, sheet: { text: 12 }, left: 62 });
  strip.labelLimits(pen, lower, upper);
  return pen.labels.sort((one, other) => one.y - other.y);
}

test("the limits are named beside their values, outside the zone", () => {
  const labels = labelsOf(200, 100);
  assert.deepEqual(labels.map(({ words }) => words), ["upper", "+0.080", "\u22120.050", "lower"]);
  assert.deepEqual([labels[1].y, labels[2].y], [100, 200]);
  assert.ok(labels.every(({ x }) => x < 62));
});

test("the names and values of the limits stand apart however narrow the zone is drawn", () => {
  for (const height of [0, 1, 5, 12, 13, 14, 20]) {
    const labels = labelsOf(100 + height, 100);
    assert.deepEqual(labels.map(({ words }) => words), ["upper", "+0.080", "\u22120.050", "lower"]);
    for (let k = 1; k < labels.length; k++) assert.ok(labels[k].y - labels[k - 1].y >= 12, `${height} px`);
  }
});
