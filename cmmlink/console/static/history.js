// The history view: the station's runs, one of them chosen to be opened, replayed or exported.

import { Chart } from "./chart.js";
import { SHAPES, WORDS, byId, count } from "./panels.js";
import { digitsFor, signed } from "./sheet.js";

export class History {
  // does: { open(run), replay(run), export(run) }
  constructor(does) {
    this.does = does;
    this.runs = [];
    this.at = 0;
    this.charts = [new Chart(byId("chart-large"), true), new Chart(byId("chart-small"), false)];
    byId("runs").addEventListener("keydown", (event) => this.key(event));
    for (const what of ["open", "replay", "export"]) byId(`${what}-run`).addEventListener("click", () => this.act(what));
  }

  get chosen() {
    return this.runs[this.at];
  }

  act(what) {
    if (this.chosen) this.does[what](this.chosen.run);
  }

  key(event) {
    const to = { ArrowDown: this.at + 1, ArrowUp: this.at - 1, Home: 0, End: this.runs.length - 1, PageDown: this.at + 10, PageUp: this.at - 10 }[event.key];
    if (to !== undefined) {
      event.preventDefault();
      this.point(Math.min(Math.max(to, 0), this.runs.length - 1));
    } else if (event.key === "Enter") this.act("open");
  }

  point(at) {
    this.at = at;
    const rows = byId("runs").querySelectorAll("tbody tr");
    rows.forEach((row, k) => row.setAttribute("aria-selected", String(k === at)));
    rows[at]?.scrollIntoView({ block: "nearest" });
  }

  show(runs) {
    this.runs = runs;
    byId("no-runs").hidden = runs.length > 0;
    byId("runs").hidden = !runs.length;
    for (const what of ["open", "replay", "export"]) byId(`${what}-run`).disabled = !runs.length;
    byId("runs").querySelector("tbody").replaceChildren(...runs.map((run, k) => this.row(run, k)));
    this.point(0);
    for (const chart of this.charts) chart.show(runs);
    const bad = runs.slice(0, 20).filter((run) => run.verdict === "nonconform").length;
    document.getElementById("chart-words").textContent = runs.length ? `${Math.min(runs.length, 20)} parts, ${bad} not conform; newest at the right` : "";
  }

  row(run, k) {
    const row = document.createElement("tr");
    const word = WORDS[run.verdict];
    const verdict = document.createElement("td");
    verdict.className = "said-verdict";
    verdict.dataset.verdict = word ? SHAPES[word] : "none";
    verdict.innerHTML = '<svg class="shape" aria-hidden="true"><use/></svg>';
    verdict.querySelector("use").setAttribute("href", `#shape-${word ? SHAPES[word] : "none"}`);
    verdict.append(word ?? "no verdict");
    const zone = { lower_mm: run.lower_mm, upper_mm: run.upper_mm };
    const worst = run.worst_mm === null ? "" : signed(run.worst_mm, digitsFor(zone));
    const station = run.worst_station_mm === null ? "" : run.worst_station_mm.toFixed(2);
    row.append(verdict, ...[run.part, run.serial_number, began(run.began), run.state].map((words) => cell(words)));
    row.append(...[count(run.received), worst, station].map((words) => cell(words, "number")));
    row.addEventListener("click", () => this.point(k));
    row.addEventListener("dblclick", () => this.act("open"));
    return row;
  }
}

const began = (iso) => iso.replace("T", " ").slice(0, 19);

function cell(words, kind = "") {
  const element = document.createElement("td");
  element.className = kind;
  element.textContent = words;
  return element;
}
