// The right-hand side, the lamps, the banner and the buttons: words and numbers of the run.

import { buttonOf, byId, fillBar, put, putInto, showSymbol, styleOf, within } from "./dom.js";
import { count, digitsFor, signed } from "./numbers.js";
import { classOf, toleranceUse } from "./points.js";
import { CODE_OF } from "./verdicts.js";

/** @import { Control, RegistrationState, RunState, StationState } from "./protocol.js" */
/** @import { LinkState } from "./link.js" */
/** @typedef {[symbol: string, word: string]} Lamp */
/** @typedef {{ words: string, kind: "none" | "note" | "warning" | "fault", button: string }} Banner */
/**
 * What the station says, as far as it was heard.
 * @typedef {object} Heard
 * @property {RunState | null} run the run that is shown
 * @property {boolean} isRecorded whether that run comes from the records
 * @property {StationState | null} station
 * @property {Control | null} control
 * @property {boolean} hasFault
 * @property {boolean} isRemote whether the station is open to the network
 * @property {LinkState} link
 */

const NONE = "\u2013";
const SIGNS = { over: "\u25b2", under: "\u25bc", "not-proven": "\u25c6", in: "\u25cf", near: "\u25cf" };
const PHASES = { preparing: "preparing", starting: "connecting", measuring: "so far", ending: "ending", finished: "" };

/** @type {Readonly<Record<RunState["link"], Lamp>>} */
const LINK_LAMPS = {
  connecting: ["lamp-wait", "connecting"], up: ["lamp-on", "up"], down: ["lamp-fault", "LOST"], closed: ["lamp-off", "closed"],
};
/** @type {Lamp} */
const DARK = ["lamp-off", "none"];

/** @param {Heard} heard */
export function showRun({ run, station }) {
  const choice = station?.choice;
  put("part", run?.part || choice?.part || "No part");
  put("serial-number", run?.serial_number ?? station?.serial_number ?? "");
  byId("serial-number").title = byId("serial-number").textContent ?? ""; // a long one is cut
  const names = run ? [run.plan, run.operator] : [choice?.name, station?.operator];
  put("plan-operator", names.filter(Boolean).join("  \u00b7  "));
  showVerdict(run, station);
  showWorst(run);
  showRegistration(run?.registration);
  showCoverage(run?.coverage ?? 0, run?.coverage_min ?? 0);
  showNumbers(run);
}

/**
 * @param {RunState | null} run
 * @param {StationState | null} station
 */
function showVerdict(run, station) {
  const { word, why } = run?.verdict ?? readiness(station), card = byId("verdict");
  const shape = run?.verdict.shape ?? "none", phase = run && !run.verdict.final ? PHASES[run.phase] : "";
  document.body.dataset.verdict = shape;
  card.dataset.final = String(Boolean(run?.verdict.final));
  showSymbol(within(card, ".shape"), `shape-${shape}`);
  put("verdict-word", word);
  put("verdict-why", why);
  byId("verdict-why").title = why; // a long one is cut
  put("provisional", phase);
  byId("provisional").hidden = !phase;
}

/**
 * What stands in the verdict's place before a run.
 * @param {StationState | null} station
 */
export function readiness(station) {
  if (station?.can_start) return { word: "READY", why: "start when the part is in place" };
  return { word: "NO PLAN", why: station?.choice ? `${station.choice.name} cannot be run` : "choose a plan" };
}

/** @param {RunState | null} run */
function showWorst(run) {
  const worst = run?.worst;
  const kind = worst ? classOf(worst.deviation_mm, CODE_OF[worst.verdict], run.zone) : null;
  byId("worst").dataset.kind = kind ?? "none";
  put("worst-shape", kind ? SIGNS[kind] : "");
  put("worst-value", worst ? signed(worst.deviation_mm, digitsFor(run.zone)) : NONE);
  put("worst-where", worst ? `at station ${worst.station_mm.toFixed(2)} mm` : "no point judged");
  put("worst-use", worst ? `${Math.round(100 * toleranceUse(worst.deviation_mm, run.zone))} % of the tolerance` : "");
}

/** @param {RegistrationState | undefined} registration */
function showRegistration(registration) {
  for (const step of byId("registration").querySelectorAll("li")) {
    step.toggleAttribute("aria-current", step.dataset.step === registration?.state);
  }
  put("can-move", moveWords(registration));
}

/**
 * By how much values can still move.
 * @param {RegistrationState | undefined} registration
 */
export function moveWords(registration) {
  const move = registration?.can_move_mm ?? null, others = registration?.other_poses ?? 0;
  if (others) return `final, but ${others} other pose${others > 1 ? "s fit" : " fits"} as well`;
  if (move === null) return NONE;
  if (move === 0) return "nothing: final";
  return move < 0.1 ? `\u00b1${(move * 1000).toFixed(1)} \u00b5m` : `\u00b1${move.toFixed(2)} mm`;
}

/**
 * @param {number} share
 * @param {number} needed
 */
function showCoverage(share, needed) {
  put("coverage", `${(100 * share).toFixed(share < 0.9995 ? 1 : 0)} %`);
  const bar = byId("coverage-bar"), limit = within(bar, "em");
  fillBar("coverage-bar", share);
  styleOf(limit).left = `${100 * needed}%`;
  limit.toggleAttribute("hidden", !needed);
  bar.dataset.enough = String(share >= needed);
}

/** @param {RunState | null} run */
function showNumbers(run) {
  put("received", count(run?.received ?? 0));
  put("judged", count(run?.judged ?? 0));
  put("rejected", count(run?.rejected ?? 0));
  put("lost", count(run?.lost ?? 0));
  byId("rejected").dataset.bad = String((run?.rejected ?? 0) > 0);
  byId("lost").dataset.bad = String((run?.lost ?? 0) !== 0);
  const reasons = Object.entries(run?.rejected_by_reason ?? {});
  byId("rejected").title = reasons.map(([reason, points]) => `${count(points)} ${reason}`).join(", ");
  put("rate", count(Math.round(run?.rate_per_s ?? 0)));
  put("buffer", `${run ? Math.round((100 * run.buffered) / run.buffer_capacity) : 0} %`);
  byId("buffer").title = run ? bufferWords(run) : "";
}

/** @param {RunState} run */
function bufferWords({ buffered, buffer_capacity, buffer_peak, stalls }) {
  return `${count(buffered)} of ${count(buffer_capacity)} points, at most ${count(buffer_peak)}; full ${count(stalls)} times`;
}

/**
 * How old the newest verdict is, by the server's clock as last heard.
 * @param {RunState | null} run
 * @param {number} nowMs
 */
export function ageWords(run, nowMs) {
  if (!run?.verdict_at_ms) return NONE;
  if (run.phase === "finished") return `at ${new Date(run.verdict_at_ms).toTimeString().slice(0, 8)}`;
  const age = Math.max(0, nowMs - run.verdict_at_ms) / 1000;
  return `${age < 10 ? age.toFixed(1) : Math.round(age)} s ago`;
}

/** @param {Heard} heard */
export function showLamps({ run, hasFault, link }) {
  byId("simulated").hidden = !run?.simulated;
  showLamp("lamp-link", run && link === "live" ? LINK_LAMPS[run.link] : DARK);
  showLamp("lamp-streaming", pointsLamp(run));
  showLamp("lamp-faults", hasFault ? ["lamp-fault", "FAULT"] : DARK);
}

/**
 * @param {RunState | null} run
 * @returns {Lamp}
 */
function pointsLamp(run) {
  if (run?.streaming) return ["lamp-on", "coming"];
  const isAwaited = run && run.phase !== "finished" && run.link !== "connecting";
  return isAwaited ? ["lamp-wait", "none"] : DARK;
}

/**
 * @param {string} id
 * @param {Lamp} lamp
 */
function showLamp(id, [symbol, word]) {
  const element = byId(id);
  element.dataset.lamp = symbol;
  showSymbol(within(element, "svg"), symbol);
  putInto(within(element, "i"), word);
}

/** @param {Heard} heard */
export function showBanner(heard) {
  const { words, kind, button } = bannerOf(heard);
  byId("banner").hidden = !words;
  byId("banner").dataset.kind = kind;
  put("banner-text", words);
  byId("banner-button").hidden = !button;
  put("banner-button", button);
  document.body.dataset.stale = String(heard.link !== "live");
}

/**
 * The one thing that the operator has to know first.
 * @param {Heard} heard
 * @returns {Banner}
 */
export function bannerOf({ run, isRecorded, control, isRemote, link }) {
  /** @type {(words: string, kind: Banner["kind"], button?: string) => Banner} */
  const banner = (words, kind, button = "") => ({ words, kind, button });
  if (link === "refused") return banner("This address is not valid any more: open the one the program printed.", "fault");
  if (link === "connecting") return banner("Connecting to the station \u2026", "note");
  if (link !== "live") return banner("STALE: the station does not answer. What you see is old. Trying again \u2026", "fault");
  if (run?.link === "down" && run.phase !== "finished") {
    return banner("LINK LOST. The device cannot be reached; trying again \u2026", "fault");
  }
  if (isRecorded) return banner(run?.number ?? "", "note", "Back to live");
  if (control && !control.controls) {
    return banner(`Watching: ${control.taken ? "another" : "no"} page is in control.`, "note", "Take control");
  }
  if (run?.remark) return banner(run.remark, "note");
  if (isRemote) return banner("This station is open to the network: whoever knows the address can control it.", "warning");
  return banner("", "none");
}

/** @param {Heard} heard */
export function showButtons({ station, control, run, link }) {
  const mayAct = Boolean(control?.controls) && link === "live", isRunning = Boolean(station?.running);
  buttonOf("start").disabled = !mayAct || !station?.can_start;
  buttonOf("end").disabled = !mayAct || !isRunning || run?.phase !== "measuring";
  buttonOf("abort").disabled = !mayAct || !isRunning;
  buttonOf("next").disabled = !mayAct || isRunning;
  buttonOf("acknowledge").disabled = !mayAct;
  document.body.dataset.running = String(isRunning);
}
