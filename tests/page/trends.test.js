// What the read-outs of trends say of a value and of a place of the heat strip.

import assert from "node:assert/strict";
import { test } from "node:test";

import { cellWords } from "../../cmmlink/console/static/heat_strip.js";
import { placeWords } from "../../cmmlink/console/static/trend_chart.js";

const RUN = { run: "20260314-0001", station: "hall-1", serial_number: "B-1", began: "2026-03-14 15:09", value: 1, lower: null, upper: 2,
  verdict: "conform" };
const broken = (at, words) => ({ at, words, above: true });
const CHART = { centre: 1, lower: 0, upper: 2, plotted: [],
  broken: [broken(4, "one value beyond"), broken(4, "one value beyond"), broken(5, "eight")] };
const STRIP = { length_mm: 40, names: ["B-1", "B-2"], worst_mm: [[0.01, null], [-0.04, 0]], levels: [[1, null], [-3, 0]],
  slope_um: [0.25, null], stretches: [] };

test("a value is told with its run and every rule that it breaks, once", () => {
  assert.equal(placeWords(RUN, CHART, 4), "B-1  \u00b7  hall-1  \u00b7  2026-03-14 15:09  \u00b7  one value beyond");
  assert.equal(placeWords({ ...RUN, serial_number: "" }, CHART, 0), "20260314-0001  \u00b7  hall-1  \u00b7  2026-03-14 15:09");
});

test("a place of the heat strip is told with its station, its worst deviation and its drift", () => {
  assert.equal(cellWords(STRIP, { row: 1, place: 0 }),
    "B-2  \u00b7  station 10.00 mm  \u00b7  worst \u22120.0400 mm  \u00b7  out of tolerance  \u00b7  drift +0.25 \u00b5m a run");
  assert.equal(cellWords(STRIP, { row: 0, place: 1 }), "B-1  \u00b7  station 30.00 mm  \u00b7  not measured");
});
