// The history view: the station's runs, one of them chosen to be opened, replayed or exported.

import { Chart } from "./chart.js";
import { byId, count } from "./panels.js";
import { Table, cell, verdictCell } from "./table.js";
import { digitsFor, signed } from "./sheet.js";

const SHOWN = 20;
const ACTS = ["open", "replay", "export"];

export class History {
  // does: { open(run), replay(run), export(run) }
  constructor(does) {
    this.does = does;
    this.charts = [new Chart(byId("chart-large"), true), new Chart(byId("chart-small"), false)];
    this.table = new Table(byId("runs"), row, (run) => does.open(run.run));
    for (const what of ACTS) byId(`${what}-run`).addEventListener("click", () => this.act(what));
  }

  act(what) {
    if (this.table.chosen) this.does[what](this.table.chosen.run);
  }

  show(runs) {
    byId("no-runs").hidden = runs.length > 0;
    byId("runs").hidden = !runs.length;
    for (const what of ACTS) byId(`${what}-run`).disabled = !runs.length;
    this.table.show(runs);
    const last = runs.slice(0, SHOWN);
    for (const chart of this.charts) chart.show([...last].reverse());
    const bad = last.filter((run) => run.verdict === "nonconform").length;
    byId("chart-words").textContent = runs.length ? `${last.length} parts, ${bad} not conform; newest at the right` : "";
  }
}

function row(run) {
  const zone = { lower_mm: run.lower_mm, upper_mm: run.upper_mm };
  const worst = run.worst_mm === null ? "" : signed(run.worst_mm, digitsFor(zone));
  const station = run.worst_station_mm === null ? "" : run.worst_station_mm.toFixed(2);
  const words = [run.part, run.serial_number, run.began.replace("T", " ").slice(0, 19), run.state];
  return [verdictCell(run.verdict), ...words.map((word) => cell(word)), ...[count(run.received), worst, station].map((word) => cell(word, "number"))];
}
