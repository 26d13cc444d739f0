// How numbers are written on the page and where the steps of an axis lie.

import assert from "node:assert/strict";
import { test } from "node:test";

import { digitsFor, niceStep, signed } from "../../cmmlink/console/static/sheet.js";

test("a step is 1, 2 or 5 times a power of ten and never finer than asked for", () => {
  for (const [span, count, step] of [[100, 10, 10], [100, 9, 20], [100, 4, 50], [100, 1.9, 100], [0.03, 10, 0.005], [7, 7, 1], [7, 0, 10]]) {
    assert.ok(Math.abs(niceStep(span, count) - step) < 1e-12, `${span} / ${count}: ${niceStep(span, count)}`);
  }
});

test("a sign is written before what is not zero at the digits shown", () => {
  assert.equal(signed(0.05), "+0.0500");
  assert.equal(signed(-0.05), "\u22120.0500");
  assert.equal(signed(0.00004), "0.0000");
  assert.equal(signed(-0.00004), "0.0000");
  assert.equal(signed(-0.00004, 5), "\u22120.00004");
  assert.equal(signed(0, 3), "0.000");
});

test("a narrow zone is written with one digit more", () => {
  assert.equal(digitsFor({ lower_mm: -0.05, upper_mm: 0.05 }), 4);
  assert.equal(digitsFor({ lower_mm: -0.005, upper_mm: 0.005 }), 5);
});
