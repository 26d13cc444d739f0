// A new Modbus device: its registers while they change, as numbers of every type and word order; which of them are x and y; the map saved.

import { buttonOf, byId, inputOf, make, put, selectOf } from "./dom.js";
import { gettext, translate } from "./words.js";

/** @import { Command, MapSaved, RegisterRow, RegisterTable } from "./protocol.js" */
/** @import { Outcome } from "./link.js" */
/** @typedef {"x" | "y" | "z" | "sequence"} Field */
/** @typedef {{ at: number, kind: string, order: string }} Place of a number: first register, type, word order (empty: 16 bits) */

/** @type {readonly Field[]} */
const FIELDS = ["x", "y", "z", "sequence"];
/** @type {Readonly<Record<Field, string>>} */
const SIGNS = { x: "x", y: "y", z: "z", sequence: "n" };
const PLAIN = 3; // columns before the numbers: register, hexadecimal, and the field that it was chosen for
const LONG = /64$/;
const USUAL_ORDER = "high-first";

export class RegistersView {
  /** @param {(command: Command) => Promise<Outcome>} ask */
  constructor(ask) {
    this.ask = ask;
    /** @type {Map<Field, Place>} */
    this.chosen = new Map();
    /** @type {Field} */
    this.field = "x";
    /** @type {RegisterTable | null} */
    this.told = null;
    this.shape = ""; // of the table as it stands
    this.cell = { row: 0, column: 0 };
    this.table = byId("register-table");
    this.table.addEventListener("click", (event) => this.press(event));
    this.table.addEventListener("keydown", (event) => this.act(event));
    byId("look").addEventListener("submit", (event) => this.look(event));
    byId("map").addEventListener("submit", (event) => this.keep(event, false));
    buttonOf("replace-map").addEventListener("click", (event) => this.keep(event, true));
    inputOf("map-name").addEventListener("input", () => { buttonOf("replace-map").hidden = true; });
    inputOf("long-numbers").addEventListener("change", () => this.showTable());
    for (const field of FIELDS) buttonOf(`field-${field}`).addEventListener("click", () => this.take(field));
    this.showFields();
  }

  /** @param {Event} event */
  look(event) {
    event.preventDefault();
    if (this.told?.state === "reading") return this.ask({ do: "abort" });
    const [first, count, device_id, baud_rate] = ["first", "count", "device-id", "baud"].map((id) => Number(inputOf(`look-${id}`).value));
    const [table, parity] = ["table", "parity"].map((id) => selectOf(`look-${id}`).value);
    return this.ask({ do: "look at registers", address: inputOf("look-address").value, table, first, count, device_id, baud_rate, parity });
  }

  /** @param {RegisterTable} told */
  show(told) {
    this.told = told;
    const isReading = told.state === "reading";
    put("look-words", isReading ? gettext("Stop") : gettext("Read"));
    byId("look-message").dataset.state = told.state;
    put("look-message", (told.state === "failed" ? "\u2715 " : "") + translate(told.message));
    this.showTable();
  }

  showTable() {
    const { told } = this;
    if (!told) return;
    const areLong = inputOf("long-numbers").checked;
    const shape = JSON.stringify([areLong, told.address, told.table, told.rows.map((row) => row.at)]);
    if (shape !== this.shape) this.build(told, areLong);
    this.shape = shape;
    for (const [place, row] of told.rows.entries()) this.fill(place, row);
    this.markCells();
  }

  /**
   * A table with empty cells.
   * @param {RegisterTable} told
   * @param {boolean} areLong whether numbers of 64 bits are shown, too
   */
  build({ columns, rows }, areLong) {
    /** @type {readonly number[]} places of the columns that are shown */
    this.shown = [...columns.keys()].filter((place) => areLong || !LONG.test(columns[place][0]));
    const heads = this.shown.map((place) => headOf(columns[place]));
    const head = [gettext("Register"), gettext("Hexadecimal"), gettext("Chosen"), ...heads].map((words) => make("th", words));
    const lines = rows.map((row) => {
      const line = document.createElement("tr"), cells = [String(row.at), "", "", ...this.shown.map(() => "")];
      line.append(...cells.map((words) => make("td", words)));
      return line;
    });
    const body = document.createElement("tbody"), top = document.createElement("thead"), headLine = document.createElement("tr");
    headLine.append(...head);
    top.append(headLine);
    body.append(...lines);
    const table = document.createElement("table");
    table.setAttribute("role", "grid");
    table.append(top, body);
    this.table.replaceChildren(table);
    byId("no-registers").hidden = rows.length > 0;
    this.table.hidden = !rows.length;
    this.cell = { row: 0, column: 0 };
  }

  /**
   * What a register holds now; what changed since it was read last is marked.
   * @param {number} place
   * @param {RegisterRow} row
   */
  fill(place, { hex, values }) {
    const line = this.lines[place], words = ["", hex, "", ...(this.shown ?? []).map((column) => values[column] ?? "")];
    line.classList.toggle("missing", !hex);
    for (const [k, cell] of [...line.cells].entries()) {
      if (k === 0 || k === PLAIN - 1) continue;
      const told = !hex && k === 1 ? gettext("absent") : words[k];
      cell.classList.toggle("changed", cell.textContent !== "" && cell.textContent !== told);
      if (cell.textContent !== told) cell.textContent = told;
    }
  }

  /** @returns {HTMLTableRowElement[]} */
  get lines() {
    return [...this.table.querySelectorAll("tbody tr")].filter((line) => line instanceof HTMLTableRowElement);
  }

  markCells() {
    const lines = this.lines;
    for (const [place, line] of lines.entries()) {
      const at = this.told?.rows[place]?.at ?? -1;
      const fields = FIELDS.filter((field) => this.chosen.get(field)?.at === at);
      line.cells[PLAIN - 1].textContent = fields.map((field) => SIGNS[field]).join(" ");
      for (const [k, column] of (this.shown ?? []).entries()) {
        const cell = line.cells[PLAIN + k], [kind, order] = this.told?.columns[column] ?? ["", ""];
        cell.classList.toggle("field", FIELDS.some((field) => isSame(this.chosen.get(field), { at, kind, order })));
        cell.setAttribute("aria-selected", String(place === this.cell.row && k === this.cell.column));
      }
    }
  }

  /** @param {MouseEvent} event */
  press(event) {
    const cell = event.target instanceof Element ? event.target.closest("td") : null, line = cell?.parentElement;
    if (!(cell instanceof HTMLTableCellElement) || !(line instanceof HTMLTableRowElement) || cell.cellIndex < PLAIN) return;
    this.cell = { row: line.sectionRowIndex, column: cell.cellIndex - PLAIN };
    this.choose();
  }

  /** @param {KeyboardEvent} event */
  act(event) {
    const { row, column } = this.cell;
    const targets = new Map([
      ["ArrowDown", [row + 1, column]], ["ArrowUp", [row - 1, column]], ["ArrowRight", [row, column + 1]], ["ArrowLeft", [row, column - 1]],
    ]);
    const target = targets.get(event.key);
    if (!target && event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    if (!target) return this.choose();
    const [lastRow, lastColumn] = [this.lines.length - 1, (this.shown?.length ?? 1) - 1];
    this.cell = { row: Math.min(Math.max(target[0], 0), lastRow), column: Math.min(Math.max(target[1], 0), lastColumn) };
    this.markCells();
    this.lines[this.cell.row]?.cells[PLAIN + this.cell.column]?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  /** The number in the pointed cell is that of the field to be chosen next. */
  choose() {
    const row = this.told?.rows[this.cell.row], column = this.shown?.[this.cell.column];
    if (!this.told || !row || column === undefined || !row.values[column]) return;
    const [kind, order] = this.told.columns[column];
    const orderOf = (/** @type {Field} */ field) => (field === this.field ? "" : this.chosen.get(field)?.order) || order;
    const other = FIELDS.find((field) => order && orderOf(field) !== order);
    if (other) {
      return this.say(gettext("A device has one word order, and {field} was chosen with the other one.", { field: SIGNS[other] }), false);
    }
    this.chosen.set(this.field, { at: row.at, kind, order });
    if (this.field === "x" && !this.chosen.has("y")) this.field = "y";
    this.say("", true);
    this.showFields();
  }

  /**
   * The next number that is chosen is that of this field; where it had one, it has none any more.
   * @param {Field} field
   */
  take(field) {
    if (this.field === field) this.chosen.delete(field);
    this.field = field;
    this.showFields();
  }

  showFields() {
    for (const field of FIELDS) {
      const place = this.chosen.get(field), button = buttonOf(`field-${field}`);
      button.setAttribute("aria-pressed", String(field === this.field));
      put(`place-${field}`, place ? `${place.at} ${headOf([place.kind, place.order])}` : "\u2013");
    }
    this.markCells();
  }

  /**
   * @param {Event} event
   * @param {boolean} replace
   */
  async keep(event, replace) {
    event.preventDefault();
    const placeOf = (/** @type {Field} */ field) => {
      const place = this.chosen.get(field);
      return place ? `${place.at}:${place.kind}` : "";
    };
    const [x, y, z, sequence] = FIELDS.map(placeOf);
    const word_order = [...this.chosen.values()].find(({ order }) => order)?.order ?? USUAL_ORDER;
    const [name, device, scale] = ["name", "device", "scale"].map((id) => inputOf(`map-${id}`).value);
    const table = this.told?.table || selectOf("look-table").value;
    const answer = await this.ask({ do: "keep map", name, device: device || name, table, word_order, x, y, z, sequence, scale, replace });
    if (!answer.ok) return this.say(translate(answer.message), false);
    /** @type {MapSaved} */
    const saved = JSON.parse(answer.message);
    buttonOf("replace-map").hidden = !saved.taken;
    if (saved.problem) return this.say(translate(saved.problem), false);
    const source = `modbus ${this.told?.address || inputOf("look-address").value} ${saved.name}`;
    this.say(gettext("{name} is saved. In a new plan the points come from: {source}", { name: saved.name, source }), true);
  }

  /**
   * @param {string} words
   * @param {boolean} isGood
   */
  say(words, isGood) {
    byId("map-message").dataset.state = isGood ? "good" : "failed";
    put("map-message", words && (isGood ? "\u2713 " : "\u2715 ") + words);
  }
}

/**
 * @param {Place | undefined} one
 * @param {Place} other
 */
const isSame = (one, other) => one?.at === other.at && one.kind === other.kind && one.order === other.order;

/** A type and its word order, in words. @param {readonly [string, string]} column */
function headOf([kind, order]) {
  if (!order) return kind;
  return order === USUAL_ORDER ? gettext("{type} high first", { type: kind }) : gettext("{type} low first", { type: kind });
}
