// The colours of the verdicts, as the colour-blind see them: Machado, Oliveira and Fernandes 2009, at full severity, in linear light.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const BLIND = {
  protanopia: [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
  deuteranopia: [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
  tritanopia: [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
};
const TO_XYZ = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]];
const WHITE = [0.95047, 1, 1.08883];
// CIE 1976, of which 2.3 is just seen: for areas and for points; words, which are dark on light and have a shape beside them, need less.
/** @type {[number, string[]][]} */
const TOLD_APART = [
  [20, ["good-fill", "bad-fill", "not-proven"]], [20, ["draw-in", "draw-over", "draw-under"]], [15, ["good", "bad", "not-proven-ink"]],
];

const times = (matrix, vector) => matrix.map((row) => row.reduce((sum, value, k) => sum + value * vector[k], 0));

function coloursOf(name) {
  const css = readFileSync(new URL(`../../cmmlink/console/static/${name}.css`, import.meta.url), "utf8");
  return Object.fromEntries([...css.matchAll(/--([\w-]+): #([0-9a-f]{6});/g)].map(([, key, hex]) => [key, hex]));
}

function linear(hex) {
  const values = [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  return values.map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4));
}

function lab(rgb) {
  const xyz = times(TO_XYZ, rgb.map((value) => Math.min(Math.max(value, 0), 1)));
  const cubeRoot = (value) => (value > 216 / 24389 ? Math.cbrt(value) : ((24389 / 27) * value + 16) / 116);
  const [x, y, z] = xyz.map((value, k) => cubeRoot(value / WHITE[k]));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

const luminance = (hex) => times(TO_XYZ, linear(hex))[1];

function contrast(one, other) {
  const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
}

for (const theme of ["colours", "dark"]) {
  test(`${theme}: no two verdicts have colours that a colour-blind reader takes for one`, () => {
    const colours = coloursOf(theme);
    for (const [enough, set] of TOLD_APART) {
      for (const [kind, matrix] of Object.entries(BLIND)) {
        const seen = set.map((name) => lab(times(matrix, linear(colours[name]))));
        seen.forEach((one, k) => seen.slice(k + 1).forEach((other, l) => {
          const apart = Math.hypot(...one.map((value, at) => value - other[at]));
          assert.ok(apart >= enough, `${kind}: ${set[k]} and ${set[k + 1 + l]} are ${apart.toFixed(1)} apart`);
        }));
      }
    }
  });

  test(`${theme}: words stand out from every ground they are written on`, () => {
    const colours = coloursOf(theme);
    const written = [
      ["ink", "ground"], ["ink", "card"], ["soft", "ground"], ["soft", "card"], ["good", "card"], ["good", "good-soft"], ["bad", "card"],
      ["bad", "bad-soft"], ["not-proven-ink", "not-proven-soft"], ["on-not-proven", "not-proven"], ["over", "card"], ["under", "card"],
      ["accent", "note"], ["near", "card"], ["amber", "not-proven-soft"], ["draw-text", "draw-ground"], ["draw-soft", "draw-ground"],
    ];
    const weak = written.filter(([one, other]) => contrast(colours[one], colours[other]) < 4.5);
    assert.deepEqual(weak, []);
    for (const fill of ["good-fill", "bad-fill", "accent-fill"]) assert.ok(contrast(colours[fill], "ffffff") >= 4.5, fill);
  });
}
