// The table of characteristics: its words, its limits, and the lanes that regions take on the profile.

import assert from "node:assert/strict";
import { test } from "node:test";

import { limitsOf, partsOf, wordsOf } from "../../cmmlink/console/static/characteristics.js";
import { cut, isInside, lanesOf } from "../../cmmlink/console/static/regions.js";

const ROW = { name: "chord", type: "chord", word: "so far", shape: "none", verdict: "uncertain", value: 99.9, nominal: 100, unit: "mm",
  lower: -0.1, upper: 0.1, deviation: -0.1, uncertainty: 0, method: "tangent", fit: "none", filter: "none", zone: "",
  region: "whole profile", rule: "simple", from_mm: null, to_mm: null, why: "", worst: null, places: [] };
const region = (name, from_mm, to_mm) => ({ ...ROW, name, from_mm, to_mm });

test("limits that are not there are not shown as numbers", () => {
  assert.equal(limitsOf({ lower: -0.045, upper: 0.1 }), "\u22120.045 .. +0.1");
  assert.equal(limitsOf({ lower: null, upper: 0.1 }), "\u2264 +0.1");
  assert.equal(limitsOf({ lower: -10, upper: null }), "\u2265 \u221210");
  assert.equal(limitsOf({ lower: 0, upper: 20 }), "0 .. +20");
});

test("how the characteristics stand is said in numbers, and what is not listed is said", () => {
  const out = { ...ROW, shape: "not-conform" }, unproven = { ...ROW, shape: "not-proven" };
  assert.equal(wordsOf([ROW, out, unproven], 0, false), "3, 1 NOT CONFORM, 1 LOOK OUT; values so far");
  assert.equal(wordsOf([ROW, out, unproven], 0, true), "3, 1 NOT CONFORM, 1 NOT PROVEN");
  assert.equal(wordsOf([out], 4, true), "5, 1 NOT CONFORM; the worst is listed, the others stand in result.json");
});

test("a value stands with all that it depends on", () => {
  assert.deepEqual(partsOf({ ...ROW, filter: "Gaussian", fit: "datum", why: "It is short." }),
    ["chord", "It is short.", "chord by tangent", "nominal 100.0000 mm", "whole profile", "fit datum", "Gaussian", "simple"]);
  assert.ok(partsOf(ROW).includes("raw"));
});

test("a region may cross the seam, and regions that meet take lanes of their own", () => {
  const seam = region("seam", 90, 10);
  assert.deepEqual([95, 5, 50, 90, 10].map((station) => isInside(seam, station)), [true, true, false, true, true]);
  const regions = lanesOf([region("a", 0, 40), ROW, region("b", 20, 60), region("c", 50, 80), seam, region("d", 42, 45)]);
  assert.deepEqual(regions.map(({ row, lane }) => [row.name, lane]), [["a", 0], ["b", 1], ["c", 0], ["seam", 1], ["d", 0]]);
});

test("a long name is cut with a mark", () => {
  assert.equal(cut("short"), "short");
  assert.equal(cut("x".repeat(80)).length, 28);
});
