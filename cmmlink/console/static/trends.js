// The view of trends: a part and a characteristic are chosen, and their runs are drawn with what is to be said of them.

import { byId, buttonOf, make, put, selectOf } from "./dom.js";
import { HeatStrip } from "./heat_strip.js";
import { fixed } from "./numbers.js";
import { ControlChart, placeWords } from "./trend_chart.js";
import { gettext, ngettext, translate } from "./words.js";

/** @import { TrendChoices, TrendIndex, TrendShown } from "./protocol.js" */
/** @typedef {import("./link.js").Posted} Got */

const NONE = "\u2013";
const CHOSEN = /** @type {const} */ (["part", "characteristic", "station", "last", "subgroup"]);

export class TrendsView {
  /**
   * @param {(path: string, asked: Record<string, string>) => Promise<Got>} get
   * @param {(address: string, name: string) => void} download
   */
  constructor(get, download) {
    this.get = get;
    /** @type {TrendChoices} */
    this.choices = { parts: [], stations: [] };
    /** @type {TrendShown | null} */
    this.trend = null;
    this.asked = 0; // so many times; an answer that comes late is for nobody
    this.isShown = false;
    const point = (/** @type {number | null} */ place) => this.point(place);
    this.charts = [new ControlChart(byId("trend-location"), point), new ControlChart(byId("trend-spread"), point)];
    this.strip = new HeatStrip(byId("trend-strip"), (words) => put("trend-strip-words", words || gettext("arrows read out")));
    for (const name of CHOSEN) selectOf(`trend-${name}`).addEventListener("change", () => this.look());
    for (const kind of ["pdf", "xlsx"]) buttonOf(`trend-${kind}`).addEventListener("click", () => this.save(kind, download));
  }

  /** The view comes in front, or is left. @param {boolean} isShown */
  turn(isShown) {
    if (isShown === this.isShown) return;
    this.isShown = isShown;
    if (isShown) this.renew();
  }

  /** Ask anew which trends there are, and for the chosen one: a run may have been added. */
  async renew() {
    if (!this.isShown) return;
    if (!this.trend) this.tell(gettext("looking \u2026"));
    const got = await this.get("/trends", {});
    if (!got.ok) return this.tell(got.message);
    this.choices = /** @type {TrendChoices} */ (got.given);
    const { parts, stations } = this.choices;
    fill("trend-part", parts);
    fill("trend-station", stations, gettext("all stations"));
    if (!parts.length) return this.tell(gettext("There are no results yet. They come with the runs that are pushed."));
    await this.look();
  }

  /** @returns {Record<string, string>} */
  get wanted() {
    return Object.fromEntries(CHOSEN.map((name) => [name, selectOf(`trend-${name}`).value]));
  }

  async look() {
    const number = ++this.asked, got = await this.get("/trend", this.wanted);
    if (number !== this.asked) return;
    if (!got.ok) return this.tell(got.message);
    this.show(/** @type {TrendShown} */ (got.given));
  }

  /**
   * @param {string} kind
   * @param {(address: string, name: string) => void} download
   */
  save(kind, download) {
    if (!this.trend) return;
    const language = document.documentElement.lang === "de" ? "de" : "en";
    const asked = new URLSearchParams({ ...this.wanted, as: kind, language });
    download(`/trend-file?${asked}`, `${this.trend.part} ${this.trend.characteristic}.${kind}`);
  }

  /** Say why there is nothing to be seen. @param {string} problem */
  tell(problem) {
    this.trend = null;
    for (const chart of this.charts) chart.show(null, "");
    this.strip.show(null, "");
    this.fill(problem, [], []);
  }

  /** @param {TrendShown} trend */
  show(trend) {
    this.trend = trend;
    fill("trend-characteristic", trend.characteristics);
    selectOf("trend-characteristic").value = trend.characteristic;
    const runs = trend.rows.map((row) => trend.runs[row]), isSingle = trend.subgroup === 1;
    [trend.location, trend.spread].forEach((chart, k) => {
      const isLocation = k === 0;
      this.charts[k].show(chart && { chart, runs, hasVerdicts: isLocation && isSingle, isForm: trend.is_form || !isLocation },
        gettext("too few values"));
    });
    this.strip.show(trend.strip, gettext("no profile on record"));
    this.fill(wordsOf(trend), trend.indices, [...trend.drifts, ...trend.notes]);
    put("trend-basis", translate(trend.basis));
    this.point(null);
  }

  /**
   * @param {string} words
   * @param {readonly TrendIndex[]} indices
   * @param {readonly string[]} sentences
   */
  fill(words, indices, sentences) {
    const isToldOnce = new Set(indices.map(({ reason }) => reason)).size === 1;
    put("trend-words", words);
    put("trend-basis", "");
    byId("trend-indices").replaceChildren(...indices.map((index) => indexElement(index, isToldOnce)));
    byId("trend-notes").replaceChildren(...sentences.map((told) => make("li", translate(told))));
    for (const kind of ["pdf", "xlsx"]) buttonOf(`trend-${kind}`).disabled = !this.trend?.runs.length;
  }

  /** @param {number | null} place */
  point(place) {
    for (const chart of this.charts) chart.point(place);
    const { trend } = this;
    if (place === null || !trend?.location || !trend.spread) return put("trend-place", gettext("arrows read out"));
    const run = trend.runs[trend.rows[place]], chart = trend.location;
    const broken = [...chart.broken, ...trend.spread.broken.map((one) => ({ ...one, words: gettext("range") }))];
    put("trend-place", placeWords(run, { ...chart, broken }, place));
  }
}

/**
 * Offer choices, and keep the one that was chosen where it is still there.
 * @param {string} id
 * @param {readonly string[]} names
 * @param {string} [first] words for none of them
 */
function fill(id, names, first) {
  const select = selectOf(id), chosen = select.value;
  const options = names.map((name) => new Option(name, name));
  select.replaceChildren(...(first === undefined ? [] : [new Option(first, "")]), ...options);
  if (names.includes(chosen)) select.value = chosen;
}

/** @param {TrendShown} trend */
function wordsOf({ runs, location, spread }) {
  const broken = new Set([...(location?.broken ?? []), ...(spread?.broken ?? [])].map(({ at }) => at));
  const bad = runs.filter(({ verdict }) => verdict === "nonconform").length;
  return [
    ngettext("{count} run", "{count} runs", runs.length),
    ngettext("{count} NOT CONFORM", "{count} NOT CONFORM", bad),
    ngettext("{count} value breaks a rule", "{count} values break a rule", broken.size),
  ].join("; ");
}

/**
 * @param {TrendIndex} index
 * @param {boolean} isToldOnce whether a note tells the reason, which all indices share
 */
function indexElement({ name, value, lower, upper, reason }, isToldOnce) {
  const element = document.createElement("div"), told = make("dd", value === null ? NONE : fixed(value, 2));
  const limits = lower === null || upper === null ? "" : `${fixed(lower, 2)} .. ${fixed(upper, 2)}`;
  told.append(make("small", limits || (isToldOnce ? "" : translate(reason))));
  element.append(make("dt", name), told);
  return element;
}
