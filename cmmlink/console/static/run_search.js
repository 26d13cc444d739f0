// What is looked for among the recorded runs, and the order in which they stand.

import { byId, elementsOf, inputOf, selectOf } from "./dom.js";
import { locale } from "./words.js";

/** @import { Command, RunRow } from "./protocol.js" */
/** @typedef {Pick<RunRow, "word" | "part" | "serial_number" | "began" | "operator" | "plan" | "state">} Words */
/** @typedef {Pick<RunRow, "received" | "worst_mm" | "worst_station_mm">} Numbers */
/** @typedef {keyof Words | keyof Numbers} Column */

const TYPED_MS = 250; // so long after the last letter is looked for what was typed
const TEXTS = /** @type {const} */ (["part", "serial_number", "operator", "plan", "since", "until"]);
const BY_LETTERS = new Intl.Collator(locale, { numeric: true, sensitivity: "base" });

export class RunSearch {
  /** @param {(sought: Command) => void} look */
  constructor(look) {
    this.look = look;
    this.timer = 0;
    const form = byId("run-search");
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("input", () => this.lookSoon());
    form.addEventListener("reset", () => this.lookSoon());
  }

  lookSoon() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.look(this.sought()), TYPED_MS);
  }

  /** @returns {Extract<Command, { do: "search" }>} */
  sought() {
    const [part, serial_number, operator, plan, since, until] = TEXTS.map((name) => inputOf(`sought-${name}`).value);
    return { do: "search", part, serial_number, operator, plan, verdict: selectOf("sought-verdict").value, since, until };
  }
}

export class Order {
  /** @param {() => void} onChange */
  constructor(onChange) {
    /** @type {Column} */
    this.column = "began";
    this.isDown = true; // the newest first
    for (const button of elementsOf("#runs [data-sort]")) {
      button.addEventListener("click", () => {
        this.choose(/** @type {Column} */ (button.dataset.sort));
        onChange();
      });
    }
    this.say();
  }

  get isByTime() {
    return this.column === "began" && this.isDown;
  }

  /** Another column, from its start; the same one the other way round. @param {Column} column */
  choose(column) {
    this.isDown = column === this.column ? !this.isDown : false;
    this.column = column;
    this.say();
  }

  /** Say in the headings how the runs are sorted. */
  say() {
    const way = this.isDown ? "descending" : "ascending";
    for (const button of elementsOf("#runs [data-sort]")) {
      button.closest("th")?.setAttribute("aria-sort", button.dataset.sort === this.column ? way : "none");
    }
  }

  /** @param {readonly RunRow[]} runs newest first */
  sorted(runs) {
    return sortedRuns(runs, this.column, this.isDown);
  }
}

/**
 * Runs in the order of a column; runs alike stay in the order of time, and what has no value stands at the end.
 * @param {readonly RunRow[]} runs newest first
 * @param {Column} column
 * @param {boolean} isDown
 */
export function sortedRuns(runs, column, isDown) {
  if (column === "began") return isDown ? [...runs] : [...runs].reverse();
  const sign = isDown ? -1 : 1;
  return [...runs].sort((one, other) => {
    const [a, b] = [one[column], other[column]], isLast = Number(isNothing(a)) - Number(isNothing(b));
    if (isLast || isNothing(a) || isNothing(b)) return isLast;
    return sign * (typeof a === "number" && typeof b === "number" ? a - b : BY_LETTERS.compare(String(a), String(b)));
  });
}

/** @param {string | number | null} value */
const isNothing = (value) => value === null || value === "";
