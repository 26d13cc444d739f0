// The CT view: choose the plan of a surface, have its sections inspected, look at each of them.

import { Chart } from "./chart.js";
import { buttonOf, byId, fillBar, put } from "./dom.js";
import { List } from "./list.js";
import { count, fixed, flooredShare } from "./numbers.js";
import { WORDS_OF_VERDICTS } from "./protocol.js";
import { Table, cell, verdictCell, worstCells } from "./table.js";
import { SHAPE_OF } from "./verdicts.js";
import { gettext, translate } from "./words.js";

/** @import { SurfaceState, SectionRow } from "./protocol.js" */

const STARTED = 0.03; // of the bar, while the number of sections is not known

export class CtView {
  /**
   * @param {(plan: string) => void} inspect
   * @param {(place: number) => void} open
   */
  constructor(inspect, open) {
    this.list = new List(byId("ct-plans"), inspect);
    /** @type {Table<SectionRow>} */
    this.table = new Table(byId("sections"), rowOf, (_, place) => open(place));
    this.chart = new Chart(byId("chart-ct"), true);
    this.plan = "";
    this.isBad = false;
    this.shown = "";
    buttonOf("import-ct").addEventListener("click", () => this.list.choosePointed());
    buttonOf("open-section").addEventListener("click", () => this.table.openChosen());
  }

  /**
   * @param {readonly string[]} plans
   * @param {boolean} isRunning
   */
  showPlans(plans, isRunning) {
    byId("tab-ct").hidden = !plans.length;
    buttonOf("import-ct").disabled = isRunning;
    this.list.show(plans, this.plan, this.isBad);
  }

  /** @param {SurfaceState} ct */
  show(ct) {
    this.plan = ct.plan;
    this.isBad = ct.state === "failed";
    byId("ct-bar").hidden = ct.state !== "inspecting" && ct.state !== "reading";
    fillBar("ct-bar", ct.total ? ct.done / ct.total : STARTED);
    put("ct-words", progressWords(ct));
    byId("ct-message").dataset.state = ct.state;
    put("ct-message", this.isBad ? `\u2715 ${translate(ct.message)}` : translate(ct.message));
    buttonOf("open-section").disabled = !ct.sections.length;
    this.showSections(ct.sections);
  }

  /** @param {readonly SectionRow[]} sections */
  showSections(sections) {
    const shown = JSON.stringify(sections);
    if (shown === this.shown) return;
    this.shown = shown;
    this.table.show(sections, Math.min(this.table.at, Math.max(sections.length - 1, 0)));
    this.chart.show(sections.map((section) => ({ ...section, counted: true, label: fixed(section.height_mm, 1) })));
  }
}

/** @param {SurfaceState} ct */
function progressWords({ state, done, total, remaining_s }) {
  if (state === "reading") return gettext("reading the surface \u2026");
  const soFar = gettext("{done} of {total}", { done, total });
  if (state === "done" || (state === "inspecting" && remaining_s === null)) return soFar;
  return state === "inspecting" ? gettext("{done} of {total}, about {seconds} s left", { done, total, seconds: remaining_s ?? 0 }) : "";
}

/** @param {SectionRow} section */
function rowOf(section) {
  const numbers = [fixed(section.height_mm, 3), count(section.received)].map((words) => cell(words, "number"));
  const coverage = cell(flooredShare(section.coverage), "number"), warnings = section.warnings.map(translate);
  const notes = cell(warnings.join("; "));
  notes.title = warnings.join("\n");
  return [verdictCell(WORDS_OF_VERDICTS[section.verdict], SHAPE_OF[section.verdict]), ...numbers, ...worstCells(section), coverage, notes];
}
