// The history view: the station's runs, one of them chosen to be opened, replayed, exported, reported or compared.

import { Chart } from "./chart.js";
import { buttonOf, byId, put } from "./dom.js";
import { count } from "./numbers.js";
import { Table, cell, verdictCell, worstCells } from "./table.js";
import { dated, gettext, ngettext, translate } from "./words.js";

/** @import { RunRow } from "./protocol.js" */
/** @typedef {"open" | "replay" | "export" | "report" | "compare"} Act */

const SHOWN = 20;
/** @type {Act[]} */
const ACTS = ["open", "replay", "export", "report", "compare"];

export class History {
  /**
   * @param {Record<Act, (run: string) => void>} acts what can be done with a run
   * @param {() => void} onChoice hears that another run is chosen
   */
  constructor(acts, onChoice) {
    this.acts = acts;
    this.charts = [new Chart(byId("chart-large"), true), new Chart(byId("chart-small"), false)];
    /** @type {Table<RunRow>} */
    this.table = new Table(byId("runs"), rowOf, ({ run }) => acts.open(run), onChoice);
    for (const act of ACTS) buttonOf(`${act}-run`).addEventListener("click", () => this.act(act));
  }

  /** @param {Act} act */
  act(act) {
    if (this.table.chosen) this.acts[act](this.table.chosen.run);
  }

  /** @param {readonly RunRow[]} runs newest first */
  show(runs) {
    byId("no-runs").hidden = runs.length > 0;
    byId("runs").hidden = !runs.length;
    for (const act of ACTS) buttonOf(`${act}-run`).disabled = !runs.length;
    const { at, chosen } = this.table, now = at ? runs.findIndex(({ run }) => run === chosen?.run) : 0;
    this.table.show(runs, Math.max(now, 0)); // the choice stays with its run; at the top it stays with the newest
    const last = runs.filter((run) => !run.section).slice(0, SHOWN); // sections of a surface are no parts
    const entries = last.map((run) => ({ ...run, label: run.serial_number || run.run })).reverse();
    for (const chart of this.charts) chart.show(entries);
    put("chart-words", last.length ? chartWords(last) : "");
  }
}

/**
 * How many parts were judged; a run that did not come to its end is no part, and is said.
 * @param {readonly RunRow[]} runs
 */
export function chartWords(runs) {
  const parts = runs.filter((run) => run.counted), bad = parts.filter((run) => run.verdict === "nonconform").length;
  const early = runs.length - parts.length;
  return [
    ngettext("{count} part, {bad} NOT CONFORM", "{count} parts, {bad} NOT CONFORM", parts.length, { bad }),
    early && ngettext("\u00d7 {count} aborted, interrupted or not measured, not counted",
      "\u00d7 {count} aborted, interrupted or not measured, not counted", early),
    gettext("newest at the right"),
  ].filter(Boolean).join("; ");
}

/** @param {RunRow} run */
function rowOf(run) {
  const part = run.section ? `${run.part}, ${translate(run.section)}` : run.part;
  const words = [part, run.serial_number, dated(run.began), stateOf(run)];
  const verdict = verdictCell(run.of ? `${translate(run.word)}: ${run.of}` : run.word, run.shape);
  return [verdict, ...words.map((word) => cell(word)), cell(count(run.received), "number"), ...worstCells(run)];
}

/** @param {RunRow} run */
const stateOf = ({ state, judged }) => (judged.length ? gettext("{state}, judged again", { state: translate(state) }) : translate(state));
