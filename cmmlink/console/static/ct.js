// The CT view: choose the plan of a surface, have its sections inspected, look at each of them.

import { Chart } from "./chart.js";
import { byId, count, put } from "./panels.js";
import { digitsFor, signed } from "./sheet.js";
import { List } from "./list.js";
import { Table, cell, verdictCell } from "./table.js";

export class Ct {
  // does: { inspect(plan), open(place) }
  constructor(does) {
    this.list = new List(byId("ct-plans"), does.inspect);
    this.table = new Table(byId("sections"), row, (_, place) => does.open(place));
    this.chart = new Chart(byId("chart-ct"), true);
    byId("import-ct").addEventListener("click", () => this.list.pointed && does.inspect(this.list.pointed));
    byId("open-section").addEventListener("click", () => this.table.openChosen());
  }

  showPlans(plans, running) {
    byId("tab-ct").hidden = !plans.length;
    byId("import-ct").disabled = running;
    this.list.show(plans, this.plan, this.failed);
  }

  show(ct) {
    [this.plan, this.failed] = [ct.plan, ct.state === "failed"];
    const { state, done, total, message } = ct;
    byId("ct-bar").hidden = state !== "inspecting" && state !== "reading";
    byId("ct-bar").firstElementChild.style.width = `${total ? (100 * done) / total : 3}%`;
    const left = ct.remaining_s === null ? "" : `, about ${ct.remaining_s} s left`;
    put("ct-words", { none: "", reading: "reading the surface \u2026", inspecting: `${done} of ${total}${left}`, done: `${done} of ${total}`, failed: "" }[state]);
    byId("ct-message").dataset.state = state;
    put("ct-message", message && `${state === "failed" ? "\u2715 " : ""}${message}`);
    byId("open-section").disabled = !ct.sections.length;
    const told = JSON.stringify(ct.sections);
    if (told === this.told) return;
    this.told = told;
    this.table.show(ct.sections, Math.min(this.table.at, Math.max(ct.sections.length - 1, 0)));
    this.chart.show(ct.sections.map((section) => ({ ...section, label: section.height_mm.toFixed(1) })));
  }
}

function row(section) {
  const zone = { lower_mm: section.lower_mm, upper_mm: section.upper_mm };
  const worst = section.worst_mm === null ? "" : signed(section.worst_mm, digitsFor(zone));
  const station = section.worst_station_mm === null ? "" : section.worst_station_mm.toFixed(2);
  const numbers = [section.height_mm.toFixed(3), count(section.received), worst, station, `${(100 * section.coverage).toFixed(1)} %`];
  const notes = cell(section.warnings.join("; "));
  notes.title = section.warnings.join("\n");
  return [verdictCell(section.verdict), ...numbers.map((words) => cell(words, "number")), notes];
}
