// Verdicts as the page shows them: a number in a drawing, a name in a message, and always a word with a shape of its own.

import { CONFORM, NONCONFORM, UNCERTAIN, WORDS_OF_VERDICTS } from "./protocol.js";

/** @import { RunRow } from "./protocol.js" */
/** @typedef {RunRow["shape"]} Shape */
/** @typedef {keyof typeof WORDS_OF_VERDICTS} VerdictName */

/** @type {Readonly<Record<VerdictName, number>>} */
export const CODE_OF = { conform: CONFORM, uncertain: UNCERTAIN, nonconform: NONCONFORM };

const WORDS = new Map(Object.entries(CODE_OF).map(([name, code]) => [code, WORDS_OF_VERDICTS[/** @type {VerdictName} */ (name)]]));

/** @param {number} code */
export const wordOf = (code) => WORDS.get(code) ?? "";

/** The name of a verdict's shape and colour. @type {Readonly<Record<VerdictName, Shape>>} */
export const SHAPE_OF = { conform: "conform", uncertain: "not-proven", nonconform: "not-conform" };
