// The table of characteristics: of the run that is on, that was opened, or of a section; the chosen one is shown on the drawings.

import { byId, put } from "./dom.js";
import { fixed, signed } from "./numbers.js";
import { Table, cell, verdictCell } from "./table.js";
import { gettext, ngettext, translate } from "./words.js";

/** @import { CharacteristicList, CharacteristicRow } from "./protocol.js" */

const NONE = "\u2013";

export class Characteristics {
  /** @param {(isOpened: boolean) => void} onChoice hears that another one is chosen, or that the chosen one is to be gone to */
  constructor(onChoice) {
    /** @type {Table<CharacteristicRow>} */
    this.table = new Table(byId("characteristics"), rowOf, () => onChoice(true), () => {
      this.tell();
      onChoice(false);
    });
    this.table.at = -1;
    this.shown = "";
  }

  /** @returns {CharacteristicRow | null} */
  get chosen() {
    return this.table.chosen ?? null;
  }

  /** @param {CharacteristicList} list */
  show({ rows, more, final }) {
    const shown = JSON.stringify([rows, more, final]);
    if (shown === this.shown) return;
    this.shown = shown;
    document.body.dataset.characteristics = String(rows.length > 1); // one alone is the verdict, which stands at the right
    put("characteristics-words", wordsOf(rows, more, final));
    const name = this.chosen?.name;
    this.table.show(rows, rows.findIndex((row) => row.name === name));
  }

  tell() {
    const hint = gettext("arrows or the mouse choose one, and the drawings show it");
    const words = this.chosen ? partsOf(this.chosen).join("  \u00b7  ") : hint;
    put("characteristic-words", words);
    byId("characteristic-words").title = words; // a long one is cut
  }
}

/**
 * How many there are, and how they stand.
 * @param {readonly CharacteristicRow[]} rows
 * @param {number} more
 * @param {boolean} isFinal
 */
export function wordsOf(rows, more, isFinal) {
  const [out, unproven] = ["not-conform", "not-proven"].map((shape) => rows.filter((row) => row.shape === shape).length);
  const open = isFinal
    ? ngettext("{count} NOT PROVEN", "{count} NOT PROVEN", unproven) : ngettext("{count} LOOK OUT", "{count} LOOK OUT", unproven);
  const counts = [rows.length + more, out && ngettext("{count} NOT CONFORM", "{count} NOT CONFORM", out), unproven && open];
  const count = rows.length, listed = more && ngettext("the worst is listed, the others stand in result.json",
    "the {count} worst are listed, the others stand in result.json", count);
  return [counts.filter(Boolean).join(", "), listed, !isFinal && gettext("values so far")].filter(Boolean).join("; ");
}

/**
 * Everything that the value of a characteristic depends on, in words.
 * @param {CharacteristicRow} row
 */
export function partsOf({ name, type, method, fit, filter, zone, region, rule, nominal, unit, why }) {
  const words = [
    name, translate(why), gettext("{type} by {method}", { type: translate(type), method: translate(method) }),
    nominal !== null && gettext("nominal {value}", { value: withUnit(nominal, unit) }),
    zone && gettext("zone {zone}", { zone: translate(zone) }), translate(region),
    fit !== "none" && gettext("fit {fit}", { fit: translate(fit) }),
    filter === "none" ? gettext("raw") : translate(filter), translate(rule),
  ];
  return words.filter((word) => word !== false && word !== "");
}

/** @param {CharacteristicRow} row */
function rowOf(row) {
  const { name, word, shape, value, unit, deviation, uncertainty, method } = row;
  const numbers = [
    value === null ? NONE : withUnit(value, unit), limitsOf(row), deviation === null ? NONE : signed(deviation),
    uncertainty ? fixed(uncertainty, 4) : NONE,
  ];
  const how = [method, ...[row.fit, row.filter].filter((way) => way !== "none")].map(translate).join(", ");
  const cells = [verdictCell(word, shape), cell(name), ...numbers.map((words) => cell(words, "number")), cell(how)];
  cells[1].title = name; // a long one is cut
  return cells;
}

/**
 * @param {number} value
 * @param {string} unit
 */
const withUnit = (value, unit) => `${fixed(value, 4)}${unit === "1" ? "" : ` ${unit}`}`;

/**
 * What is allowed of the deviation.
 * @param {Pick<CharacteristicRow, "lower" | "upper">} row
 */
export function limitsOf({ lower, upper }) {
  if (lower === null) return upper === null ? NONE : `\u2264 ${limit(upper)}`;
  return upper === null ? `\u2265 ${limit(lower)}` : `${limit(lower)} .. ${limit(upper)}`;
}

/** @param {number} value */
const limit = (value) => signed(value, 4, 0);
