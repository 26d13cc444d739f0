// The history view: the station's runs, one of them chosen to be opened, replayed, exported, reported or compared.

import { Chart } from "./chart.js";
import { buttonOf, byId, put } from "./dom.js";
import { count } from "./numbers.js";
import { Order, RunSearch } from "./run_search.js";
import { Table, cell, verdictCell, worstCells } from "./table.js";
import { dated, gettext, ngettext, translate } from "./words.js";

/** @import { Command, FoundRuns, ResultsState, RunRow } from "./protocol.js" */
/** @typedef {"open" | "replay" | "export" | "report" | "compare"} Act */

const SHOWN = 20;
/** @type {Act[]} */
const ACTS = ["open", "replay", "export", "report", "compare"];

export class History {
  /**
   * @param {Record<Act, (run: string) => void>} acts what can be done with a run
   * @param {() => void} onChoice hears that another run is chosen
   * @param {(sought: Command) => void} look
   */
  constructor(acts, onChoice, look) {
    this.acts = acts;
    this.search = new RunSearch(look);
    this.order = new Order(() => this.showRows());
    /** @type {readonly RunRow[]} */
    this.newest = [];
    /** @type {FoundRuns} */
    this.found = { runs: null, total: 0, type: "found" };
    this.plan = ""; // the chosen one
    this.shownChart = "";
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
    this.newest = runs;
    byId("no-runs").hidden = runs.length > 0;
    byId("run-search").hidden = !runs.length;
    this.showRows();
    this.showChart();
  }

  /** @param {FoundRuns | ResultsState} message */
  hear(message) {
    if (message.type === "found") this.showFound(message);
    else this.showResults(message);
  }

  /** @param {FoundRuns} found */
  showFound(found) {
    this.found = found;
    this.showRows();
  }

  /** One line on where results go and what waits. @param {ResultsState} results */
  showResults(results) {
    byId("results-line").hidden = !results.address && !results.problem;
    put("results-line", resultsWords(results));
  }

  /** Only parts of the chosen plan make a trend. @param {string} plan */
  choosePlan(plan) {
    if (plan === this.plan) return;
    this.plan = plan;
    this.showChart();
  }

  showRows() {
    const runs = this.order.sorted(this.found.runs ?? this.newest), { at, chosen } = this.table;
    byId("runs").hidden = !this.newest.length;
    put("found-words", this.found.runs ? foundWords(this.found) : "");
    for (const act of ACTS) buttonOf(`${act}-run`).disabled = !runs.length;
    const staysAtTop = at === 0 && this.order.isByTime; // at the top the choice stays with the newest, else with its run
    this.table.show(runs, staysAtTop ? 0 : Math.max(runs.findIndex(({ run }) => run === chosen?.run), 0));
  }

  showChart() {
    const plan = this.plan || (this.newest[0]?.plan ?? "");
    const last = this.newest.filter((run) => !run.section && run.plan === plan).slice(0, SHOWN); // sections of a surface are no parts
    const shown = JSON.stringify([plan, last]);
    if (shown === this.shownChart) return;
    this.shownChart = shown;
    const entries = last.map((run) => ({ ...run, label: run.serial_number || run.run })).reverse();
    for (const chart of this.charts) chart.show(entries);
    if (plan) {
      put("chart-title", gettext("Worst deviation of the last 20 parts of {plan}", { plan }));
      put("chart-small-title", gettext("Last 20 parts of {plan}", { plan }));
    }
    put("chart-words", last.length ? chartWords(last) : "");
  }
}

/** @param {ResultsState} results */
function resultsWords({ address, waiting, since, problem }) {
  if (!waiting) return problem ? translate(problem) : gettext("Results go to {address}; nothing waits", { address });
  const told = { address, since: dated(since) };
  const words = ngettext("{count} run waits for {address} since {since}", "{count} runs wait for {address} since {since}", waiting, told);
  return problem ? `${words}: ${translate(problem.replace(`${address}: `, ""))}` : words;
}

/** @param {FoundRuns} found */
export function foundWords({ runs, total }) {
  const shown = runs?.length ?? 0;
  if (shown < total) return gettext("{total} runs found, the newest {shown} are shown", { total: count(total), shown: count(shown) });
  return ngettext("{count} run found", "{count} runs found", total);
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
  const words = [part, run.serial_number, dated(run.began), run.operator, run.plan, stateOf(run)];
  const verdict = verdictCell(run.of ? `${translate(run.word)}: ${run.of}` : run.word, run.shape);
  return [verdict, ...words.map((word) => cell(word)), cell(count(run.received), "number"), ...worstCells(run)];
}

/** @param {RunRow} run */
const stateOf = ({ state, judged }) => (judged.length ? gettext("{state}, judged again", { state: translate(state) }) : translate(state));
