// The right-hand side, the lamps, the banners and the buttons: words and numbers of the run.

import { cardOf } from "./card.js";
import { buttonOf, byId, fillBar, make, put, putInto, showSymbol, styleOf, within } from "./dom.js";
import { faultParts } from "./faults.js";
import { count, digitsFor, fixed, flooredShare, signed } from "./numbers.js";
import { toleranceUse } from "./points.js";
import { POSE_MOVES } from "./protocol.js";
import { dated, gettext, ngettext, translate } from "./words.js";

/** @import { RunState } from "./protocol.js" */
/** @import { Card, Heard, Worst } from "./card.js" */
/** @typedef {[symbol: string, word: string]} Lamp */
/** @typedef {"live" | "take control" | "start again"} BannerAct */
/** @typedef {{ words: string, kind: "none" | "note" | "warning" | "fault", button: string, act: BannerAct }} Banner */

const NONE = "\u2013";
const NEEDS_ADDRESS = gettext("This page has no access. An address opens one page, once, within a minute: "
  + "press Enter where the console runs, or Another page on a page that is open, and open the new address here.");
const SIGNS = { over: "\u25b2", under: "\u25bc", "not-proven": "\u25c6", in: "\u25cf", near: "\u25cf" };

/** @type {Readonly<Record<RunState["link"], Lamp>>} */
const LINK_LAMPS = {
  connecting: ["lamp-wait", gettext("connecting")], up: ["lamp-on", gettext("up")], down: ["lamp-fault", gettext("LOST")],
  closed: ["lamp-off", gettext("closed")],
};
/** @type {Lamp} */
const DARK = ["lamp-off", gettext("none")];

/** @param {Heard} heard */
export function showRun(heard) {
  const card = cardOf(heard), { run } = card;
  put("part", card.part || gettext("No part"));
  put("serial-number", card.serial);
  byId("serial-number").style.setProperty("--letters", String(card.serial.length)); // on the wall a longer one is smaller
  byId("serial-number").title = card.serial; // a long one is cut
  put("plan-operator", card.names.filter(Boolean).join("  \u00b7  "));
  byId("before").hidden = !card.before;
  put("before", card.before);
  byId("kind").hidden = !card.badge;
  put("kind", card.badge);
  showVerdict(card);
  showAnswer(run?.answer ?? null);
  byId("report").hidden = !card.record;
  showRemarks(card);
  const band = heard.hasBand ? gettext("shaded around the limits: the U of each station") : "";
  const rule = [translate(run?.zone.decision_rule ?? ""), band].filter(Boolean).join("; ");
  put("rule", rule);
  byId("rule").title = rule; // a long one is cut
  document.body.dataset.card = run ? cardKind(run) : "summary";
  showWorst(card);
  showRegistration(run);
  showCoverage(run?.coverage ?? 0, run?.coverage_min ?? 0);
  showNumbers(run);
}

/**
 * Of a run of another day nothing goes on now: it has no rate, and the badge says when it was.
 * @param {RunState} run
 */
const cardKind = ({ kind }) => (kind === "replay" || kind === "recorded" ? "past" : "run");

/** @param {Card} shown */
function showVerdict({ word: told, shape, final, of: whose, why: reason, phase }) {
  const word = translate(told), of = translate(whose), why = translate(faultParts(reason).words);
  const card = byId("verdict");
  document.body.dataset.verdict = shape;
  card.dataset.final = String(final);
  card.style.setProperty("--letters", String(Math.max(7, ...word.split(" ").map((part) => part.length)))); // a longer word is smaller
  showSymbol(within(card, ".shape"), `shape-${shape}`);
  put("verdict-word", word);
  byId("verdict-of").hidden = !of;
  put("verdict-of", of);
  byId("verdict-of").title = of; // a long one is cut
  put("verdict-why", why);
  byId("verdict-why").title = reason; // a long one is cut, and so is what the system said
  put("provisional", phase);
  byId("provisional").hidden = !phase;
}

/**
 * Whether the machine that waits for the verdict was told it.
 * @param {RunState["answer"]} answer
 */
function showAnswer(answer) {
  const element = byId("answer");
  element.hidden = !answer;
  element.dataset.state = answer?.state ?? "";
  put("answer", answer ? answerWords(answer) : "");
  element.title = answer?.problem ?? ""; // a long one is cut
}

/** @param {NonNullable<RunState["answer"]>} answer */
export function answerWords({ state, at_ms: atMs, request, problem, told }) {
  if (state === "awaited") return gettext("The machine waits for the verdict");
  if (state === "not sent") return `\u2715 ${gettext("NOT SENT to the machine: {why}", { why: translate(problem) })}`;
  const time = new Date(atMs ?? 0).toTimeString().slice(0, 8);
  const values = { time, verdict: translate(told), number: String(request) };
  return `\u2713 ${gettext("Sent to the machine at {time}: {verdict}, request {number}", values)}`;
}

/**
 * What was judged later, every further reason of the verdict, and all that was assumed about nominal and points.
 * @param {Card} card
 */
function showRemarks({ reasons, notes, judged }) {
  byId("remarks").hidden = !reasons.length && !notes.length && !judged.length;
  showList("judgements", judged);
  showList("reasons", reasons);
  showList("notes", notes);
}

/**
 * @param {string} id of a heading and its list
 * @param {readonly string[]} sentences
 */
function showList(id, sentences) {
  const part = byId(id), list = within(part, "ul"), shown = JSON.stringify(sentences);
  part.hidden = !sentences.length;
  if (part.dataset.shown === shown) return;
  part.dataset.shown = shown;
  list.replaceChildren(...sentences.map((sentence) => make("li", translate(sentence))));
}

/** @param {Card} card */
function showWorst({ worst, run }) {
  byId("worst").dataset.kind = worst?.kind ?? "none";
  put("worst-shape", worst ? SIGNS[worst.kind] : "");
  put("worst-value", worst ? signed(worst.deviation, digitsFor(worst.zone)) : NONE);
  const nowhere = run ? gettext("no point judged") : "";
  put("worst-where", worst ? whereWords(worst) : nowhere);
  put("worst-place", worst?.place && worst.place.length < 3
    ? gettext("x {x} mm, y {y} mm", { x: fixed(worst.place[0], 3), y: fixed(worst.place[1], 3) }) : "");
  const share = worst ? Math.round(100 * toleranceUse(worst.deviation, worst.zone)) : 0;
  put("worst-use", worst ? gettext("{share} % of the tolerance", { share }) : "");
}

/**
 * Where the worst point lies: at a station of a profile, or at a place of a surface.
 * @param {Worst} worst
 */
function whereWords({ station, place }) {
  if (place?.[2] === undefined) return gettext("at station {station} mm", { station: fixed(station, 2) });
  const [x, y, z] = place.map((value) => fixed(value ?? 0, 2));
  return gettext("at x {x}, y {y}, z {z} mm", { x, y, z });
}

/** @param {RunState | null} run */
function showRegistration(run) {
  const isOver = run?.phase === "finished", state = isOver && run.registration.state === "seeking" ? "" : run?.registration.state;
  for (const step of byId("registration").querySelectorAll("li")) step.toggleAttribute("aria-current", step.dataset.step === state);
  put("can-move", moveWords(run));
}

/**
 * Whether values can still move. By how much is not said, since no bound is known while the pose moves.
 * @param {Pick<RunState, "registration" | "phase"> | null} run
 */
export function moveWords(run) {
  if (!run) return NONE;
  const { state, other_poses: others } = run.registration;
  if (others) return ngettext("final, but {count} other pose fits as well", "final, but {count} other poses fit as well", others);
  if (state === "provisional") return run.phase === "finished" ? gettext("not settled") : translate(POSE_MOVES);
  return state === "settled" ? gettext("final") : NONE;
}

/**
 * @param {number} share
 * @param {number} needed
 */
function showCoverage(share, needed) {
  put("coverage", flooredShare(share));
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
  byId("rejected").title = reasons.map(([reason, points]) => `${count(points)} ${translate(reason)}`).join(", ");
  put("rate", count(Math.round(run?.rate_per_s ?? 0)));
  put("buffer", `${run ? Math.round((100 * run.buffered) / run.buffer_capacity) : 0} %`);
  byId("buffer").title = run ? bufferWords(run) : "";
}

/** @param {RunState} run */
function bufferWords({ buffered, buffer_capacity, buffer_peak, stalls }) {
  const values = { held: count(buffered), room: count(buffer_capacity), peak: count(buffer_peak), count: count(stalls) };
  return ngettext("{held} of {room} points, at most {peak}; full {count} time",
    "{held} of {room} points, at most {peak}; full {count} times", stalls, values);
}

/**
 * How old the newest verdict is, by the server's clock as last heard.
 * @param {RunState | null} run
 * @param {number} nowMs
 */
export function ageWords(run, nowMs) {
  if (!run?.verdict_at_ms) return NONE;
  if (run.kind === "replay" || run.kind === "recorded") return dated(run.began.slice(0, 19)); // not of today
  if (run.phase === "finished") return gettext("at {time}", { time: new Date(run.verdict_at_ms).toTimeString().slice(0, 8) });
  const age = Math.max(0, nowMs - run.verdict_at_ms) / 1000;
  return gettext("{age} s ago", { age: age < 10 ? fixed(age, 1) : Math.round(age) });
}

/** @param {Heard} heard */
export function showLamps(heard) {
  const { run, hasFault, link } = heard;
  byId("simulated").hidden = !cardOf(heard).simulated;
  showLamp("lamp-link", run && link === "live" ? LINK_LAMPS[run.link] : DARK);
  showLamp("lamp-streaming", pointsLamp(run));
  showLamp("lamp-faults", hasFault ? ["lamp-fault", gettext("FAULT")] : DARK);
}

/**
 * @param {RunState | null} run
 * @returns {Lamp}
 */
function pointsLamp(run) {
  if (run?.streaming) return ["lamp-on", gettext("coming")];
  const isAwaited = run && run.phase !== "finished" && run.link !== "connecting";
  return isAwaited ? ["lamp-wait", gettext("none")] : DARK;
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

let shownBanners = "";

/**
 * @param {Heard} heard
 * @param {(act: Banner["act"]) => void} onPress
 */
export function showBanners(heard, onPress) {
  document.body.dataset.stale = String(heard.link !== "live");
  const banners = bannersOf(heard), words = JSON.stringify(banners);
  if (words === shownBanners) return;
  shownBanners = words;
  byId("banners").hidden = !banners.length;
  byId("banners").replaceChildren(...banners.map((banner) => bannerElement(banner, onPress)));
}

/**
 * @param {Banner} banner
 * @param {(act: Banner["act"]) => void} onPress
 */
function bannerElement({ words, kind, button, act }, onPress) {
  const element = document.createElement("div"), text = make("span", words);
  element.dataset.kind = kind;
  element.append(text);
  if (button) {
    const pressed = document.createElement("button");
    pressed.type = "button";
    pressed.textContent = button;
    pressed.addEventListener("click", () => onPress(act));
    element.append(pressed);
  }
  return element;
}

/**
 * What the operator has to know, the most urgent first; one thing never hides another.
 * @param {Heard} heard
 * @returns {Banner[]}
 */
export function bannersOf({ run, isRecorded, station, control, isRemote, link }) {
  /** @type {(words: string, kind: Banner["kind"], button?: string, act?: Banner["act"]) => Banner} */
  const banner = (words, kind, button = "", act = "live") => ({ words, kind, button, act });
  if (link === "refused") return [banner(NEEDS_ADDRESS, "fault")];
  if (link === "connecting") return [banner(gettext("Connecting to the station \u2026"), "note")];
  const banners = [];
  if (link !== "live") {
    banners.push(banner(gettext("STALE: the station does not answer. What you see is old. Trying again \u2026"), "fault"));
  }
  if (run?.link === "down" && run.phase !== "finished") {
    banners.push(banner(gettext("LINK LOST. The device cannot be reached; trying again \u2026"), "fault"));
  }
  banners.push(...questionsOf(station, control));
  if (isRecorded) banners.push(banner(translate(run?.number ?? ""), "note", gettext("Back to live")));
  else if (run?.kind === "replay") {
    banners.push(banner(translate(run.remark) || gettext("Replaying the run of {began}", { began: dated(run.began) }), "note"));
  } else if (run?.remark) banners.push(banner(translate(run.remark), "note"));
  if (control && !control.controls && link === "live") {
    const words = control.taken ? gettext("Watching: another page is in control.") : gettext("Watching: no page is in control.");
    banners.push(banner(words, "note", gettext("Take control"), "take control"));
  }
  if (isRemote) {
    const words = gettext("This station is open to the network, unencrypted: whoever listens there can control it.");
    banners.push(banner(words, "warning"));
  }
  return banners;
}

/**
 * What the page in control is asked before a part is measured.
 * @param {Heard["station"]} station
 * @param {Heard["control"]} control
 * @returns {Banner[]}
 */
function questionsOf(station, control) {
  if (!station?.question || !control?.controls) return [];
  const question = translate(station.question);
  const words = gettext("Measure this part again? {question}. Else enter another serial number.", { question });
  return [{ words, kind: "warning", button: gettext("Measure again"), act: "start again" }];
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
