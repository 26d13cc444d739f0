// How numbers are written on the page and where the steps of an axis lie.

import assert from "node:assert/strict";
import { test } from "node:test";

import { count, digitsFor, niceLength, niceStep, signed } from "../../cmmlink/console/static/numbers.js";

/**
 * @param {number} actual
 * @param {number} expected
 */
const near = (actual, expected) => assert.ok(Math.abs(actual / expected - 1) < 1e-12, `${actual} is not ${expected}`);

test("a step is 1, 2 or 5 times a power of ten and never finer than asked for", () => {
  for (const [span, most, step] of [[100, 10, 10], [100, 9, 20], [100, 4, 50], [100, 1.9, 100], [0.03, 10, 0.005], [7, 7, 1], [7, 0, 10]]) {
    near(niceStep(span, most), step);
  }
});

test("the length of the ruler is 1, 2 or 5 times a power of ten and never longer than asked for", () => {
  for (const [most, length] of [[1, 1], [1.99, 1], [2, 2], [4.9, 2], [5, 5], [9.99, 5], [10, 10], [0.07, 0.05], [3456, 2000]]) {
    near(niceLength(most), length);
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

test("thousands are set apart", () => {
  assert.equal(count(1234567), "1,234,567");
});
