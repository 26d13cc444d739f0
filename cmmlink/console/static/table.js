// A table whose rows are chosen by arrows or mouse and opened by Enter or a double click.

import { showSymbol, within } from "./dom.js";
import { digitsFor, fixed, signed } from "./numbers.js";
import { translate } from "./words.js";

/** @import { RunRow } from "./protocol.js" */

const PAGE = 10;

/** @template Item */
export class Table {
  /**
   * @param {HTMLElement} element
   * @param {(item: Item) => HTMLElement[]} rowOf gives the cells of a row
   * @param {(item: Item, place: number) => void} open
   * @param {() => void} onChoice hears that another row is chosen
   */
  constructor(element, rowOf, open, onChoice = () => {}) {
    this.onChoice = onChoice;
    this.element = element;
    this.rowOf = rowOf;
    this.open = open;
    /** @type {readonly Item[]} */
    this.items = [];
    this.at = 0;
    element.addEventListener("keydown", (event) => this.act(event));
  }

  /** @returns {Item | undefined} */
  get chosen() {
    return this.items[this.at];
  }

  openChosen() {
    if (this.chosen !== undefined) this.open(this.chosen, this.at);
  }

  /** @param {KeyboardEvent} event */
  act(event) {
    const { at } = this, last = this.items.length - 1;
    const targets = new Map([
      ["ArrowDown", at + 1], ["ArrowUp", at - 1], ["PageDown", at + PAGE], ["PageUp", at - PAGE], ["Home", 0], ["End", last],
    ]);
    const target = targets.get(event.key);
    if (target !== undefined) {
      event.preventDefault();
      this.point(Math.min(Math.max(target, 0), last));
    } else if (event.key === "Enter") this.openChosen();
  }

  /** @param {number} at */
  point(at) {
    this.mark(at);
    this.rows[at]?.scrollIntoView({ block: "nearest" });
  }

  /** @param {number} at */
  mark(at) {
    this.at = at;
    this.onChoice();
    this.rows.forEach((row, k) => row.setAttribute("aria-selected", String(k === at)));
  }

  get rows() {
    return this.element.querySelectorAll("tbody tr");
  }

  /**
   * Show other items; only a choice that moves is scrolled to, so that nothing moves under who reads.
   * @param {readonly Item[]} items
   */
  show(items, at = 0) {
    const isSame = at === this.at;
    this.items = items;
    within(this.element, "tbody").replaceChildren(...items.map((item, k) => {
      const row = document.createElement("tr");
      row.append(...this.rowOf(item));
      row.addEventListener("click", () => this.point(k));
      row.addEventListener("dblclick", () => this.openChosen());
      return row;
    }));
    if (isSame) this.mark(at);
    else this.point(at);
  }
}

/** @param {string} words */
export function cell(words, kind = "") {
  const element = document.createElement("td");
  element.className = kind;
  element.textContent = words;
  return element;
}

/**
 * @param {string} word
 * @param {RunRow["shape"]} shape
 */
export function verdictCell(word, shape) {
  const element = cell("", "verdict-cell");
  element.dataset.verdict = shape;
  element.innerHTML = '<svg class="shape" aria-hidden="true"><use/></svg>';
  showSymbol(element, `shape-${shape}`);
  element.append(translate(word));
  return element;
}

/**
 * The worst deviation of a run or section and its station, in two cells.
 * @param {Pick<RunRow, "worst_mm" | "worst_station_mm" | "lower_mm" | "upper_mm">} run
 */
export function worstCells({ worst_mm, worst_station_mm, lower_mm, upper_mm }) {
  if (worst_mm === null) return [cell(""), cell("")];
  const digits = digitsFor({ lower_mm: lower_mm ?? 0, upper_mm: upper_mm ?? 0 });
  return [cell(signed(worst_mm, digits), "number"), cell(worst_station_mm === null ? "" : fixed(worst_station_mm, 2), "number")];
}
