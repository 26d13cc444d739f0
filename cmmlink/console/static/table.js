// A table whose rows are chosen by arrows or mouse and opened by Enter or a double click.

import { SHAPES, WORDS } from "./panels.js";

export class Table {
  // rowOf(item) gives the cells of a row; open(item, place) opens one.
  constructor(element, rowOf, open) {
    Object.assign(this, { element, rowOf, open, items: [], at: 0 });
    element.addEventListener("keydown", (event) => this.key(event));
  }

  get chosen() {
    return this.items[this.at];
  }

  openChosen() {
    if (this.chosen) this.open(this.chosen, this.at);
  }

  key(event) {
    const last = this.items.length - 1;
    const to = { ArrowDown: this.at + 1, ArrowUp: this.at - 1, Home: 0, End: last, PageDown: this.at + 10, PageUp: this.at - 10 }[event.key];
    if (to !== undefined) {
      event.preventDefault();
      this.point(Math.min(Math.max(to, 0), last));
    } else if (event.key === "Enter") this.openChosen();
  }

  point(at) {
    this.at = at;
    const rows = this.element.querySelectorAll("tbody tr");
    rows.forEach((row, k) => row.setAttribute("aria-selected", String(k === at)));
    rows[at]?.scrollIntoView({ block: "nearest" });
  }

  show(items, at = 0) {
    this.items = items;
    this.element.querySelector("tbody").replaceChildren(...items.map((item, k) => {
      const row = document.createElement("tr");
      row.append(...this.rowOf(item));
      row.addEventListener("click", () => this.point(k));
      row.addEventListener("dblclick", () => this.openChosen());
      return row;
    }));
    this.point(at);
  }
}

export function cell(words, kind = "") {
  const element = document.createElement("td");
  element.className = kind;
  element.textContent = words;
  return element;
}

export function verdictCell(verdict) {
  const word = WORDS[verdict], shape = word ? SHAPES[word] : "none";
  const element = cell("", "said-verdict");
  element.dataset.verdict = shape;
  element.innerHTML = '<svg class="shape" aria-hidden="true"><use/></svg>';
  element.querySelector("use").setAttribute("href", `#shape-${shape}`);
  element.append(word ?? "no verdict");
  return element;
}
