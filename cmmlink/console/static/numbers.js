// How numbers are written on the page, as its reader does, and where the steps of an axis lie.

import { locale } from "./words.js";

/** @import { ZoneLimits } from "./protocol.js" */

const COUNT = new Intl.NumberFormat(locale);
/** Decimals, by how many are shown. @type {Map<string, Intl.NumberFormat>} */
const FIXED = new Map();

/** @param {number} value */
export const count = (value) => COUNT.format(value);

/**
 * A number with so many decimals, or with as many as it needs of them at most.
 * @param {number} value
 * @param {number} digits
 */
export function fixed(value, digits, fewest = digits) {
  const key = `${fewest} ${digits}`;
  const format = FIXED.get(key)
    ?? new Intl.NumberFormat(locale, { minimumFractionDigits: fewest, maximumFractionDigits: digits, useGrouping: false });
  FIXED.set(key, format);
  return format.format(value).replace("-", "\u2212");
}

/**
 * A number with its sign; what is zero at the digits shown has none.
 * @param {number} value
 */
export function signed(value, digits = 4, fewest = digits) {
  const words = fixed(Math.abs(value), digits, fewest);
  if (Number(Math.abs(value).toFixed(digits)) === 0) return words;
  return (value > 0 ? "+" : "\u2212") + words;
}

/**
 * A share in percent, never rounded up: what is not the whole is not called so, and what is too little does not look enough.
 * @param {number} share from 0 to 1
 */
export function flooredShare(share) {
  return share > 1 - 1e-9 ? "100 %" : `${fixed(Math.floor(1000 * share + 1e-9) / 10, 1)} %`;
}

/**
 * Enough digits to tell limits and deviations of this size apart.
 * @param {Pick<ZoneLimits, "lower_mm" | "upper_mm">} zone
 */
export const digitsFor = (zone) => (zone.upper_mm - zone.lower_mm < 0.02 ? 5 : 4);

/**
 * Steps of 1, 2 or 5 times a power of ten, at most `most` of them over a span.
 * @param {number} span
 * @param {number} most
 */
export function niceStep(span, most) {
  const rough = span / Math.max(most, 1), power = powerOfTen(rough);
  return power * ([1, 2, 5].find((digit) => rough <= digit * power) ?? 10);
}

/**
 * The greatest length of 1, 2 or 5 times a power of ten that is not above `most`.
 * @param {number} most
 */
export function niceLength(most) {
  const power = powerOfTen(most);
  return power * ([5, 2].find((digit) => most >= digit * power) ?? 1);
}

/** @param {number} value */
const powerOfTen = (value) => 10 ** Math.floor(Math.log10(value));
