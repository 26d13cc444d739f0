// The right-hand side and the lamps: words and numbers of the run, written only where they changed.

import { digitsFor, signed } from "./sheet.js";
import { classOf, toleranceUse } from "./points.js";

export const byId = (id) => document.getElementById(id);
export const SHAPES = { CONFORM: "conform", "NOT CONFORM": "not-conform", "NOT PROVEN": "not-proven" };
export const WORDS = { conform: "CONFORM", nonconform: "NOT CONFORM", uncertain: "NOT PROVEN" };
const COUNT = new Intl.NumberFormat("en");
const SIGNS = { over: "\u25b2", under: "\u25bc", unsure: "\u25c6", in: "\u25cf", near: "\u25cf" };

export function put(id, words) {
  const element = byId(id);
  if (element.textContent !== words) element.textContent = words;
}

export function use(svg, name) {
  const link = svg.querySelector("use");
  if (link.getAttribute("href") !== `#${name}`) link.setAttribute("href", `#${name}`);
}

export const count = (value) => COUNT.format(value);

export function showRun(run, ready) {
  put("part", run?.part || ready.part || "No part");
  put("serial-number", run ? run.serial_number : ready.serial_number);
  byId("serial-number").title = byId("serial-number").textContent;  // a long one is cut
  put("plan-operator", [run ? run.plan : ready.plan, run ? run.operator : ready.operator].filter(Boolean).join("  \u00b7  "));
  showVerdict(run, ready);
  showWorst(run);
  showQuality(run);
  showNumbers(run);
}

function showVerdict(run, ready) {
  const card = byId("verdict"), verdict = run?.verdict;
  const shape = verdict ? SHAPES[verdict.word] : "none";
  document.body.dataset.verdict = shape;
  card.dataset.final = String(verdict?.final ?? false);
  use(card.querySelector(".shape"), `shape-${shape}`);
  put("verdict-word", verdict?.word ?? (ready.can_start ? "READY" : "NO PLAN"));
  put("verdict-why", verdict?.why ?? (ready.can_start ? "start when the part is in place" : ready.plan ? `${ready.plan} cannot be run` : "choose a plan"));
  const going = run && !verdict.final;
  byId("provisional").hidden = !going;
  if (going) put("provisional", { preparing: "preparing", starting: "connecting", measuring: "so far", ending: "ending" }[run.phase] ?? "");
}

function showWorst(run) {
  const worst = run?.worst, card = byId("worst");
  const kind = worst ? classOf(worst.deviation_mm, { conform: 0, uncertain: 1, nonconform: 2 }[worst.verdict], run.zone) : "none";
  card.dataset.kind = kind;
  put("worst-shape", SIGNS[kind] ?? "");
  put("worst-value", worst ? signed(worst.deviation_mm, digitsFor(run.zone)) : "\u2013");
  put("worst-where", worst ? `at station ${worst.station_mm.toFixed(2)} mm` : "no point judged");
  put("worst-use", worst ? `${Math.round(100 * toleranceUse(worst.deviation_mm, run.zone))} % of the tolerance` : "");
}

function showQuality(run) {
  const registration = run?.registration, state = registration?.state;
  for (const step of byId("registration").children) step.toggleAttribute("aria-current", Boolean(run) && step.dataset.step === state);
  const move = registration?.can_move_mm;
  const others = registration?.other_poses ?? 0;
  put("can-move", others ? `final, but ${others} other pose${others > 1 ? "s fit" : " fits"} as well` : move === 0 ? "nothing: final" : move ? `\u00b1${move < 0.1 ? (move * 1000).toFixed(1) + " \u00b5m" : move.toFixed(2) + " mm"}` : "\u2013");
  const share = run?.coverage ?? 0, needed = run?.coverage_min ?? 0;
  put("coverage", `${(100 * share).toFixed(share < 0.9995 ? 1 : 0)} %`);
  const bar = byId("coverage-bar");
  bar.firstElementChild.style.width = `${100 * share}%`;
  bar.lastElementChild.style.left = `${100 * needed}%`;
  bar.lastElementChild.hidden = !needed;
  bar.dataset.enough = String(share >= needed);
}

function showNumbers(run) {
  for (const name of ["received", "judged", "rejected", "lost"]) put(name, count(run?.[name] ?? 0));
  byId("rejected").dataset.bad = String((run?.rejected ?? 0) > 0);
  byId("lost").dataset.bad = String((run?.lost ?? 0) !== 0);
  byId("rejected").title = run ? Object.entries(run.rejected_by_reason).map(([reason, n]) => `${n} ${reason}`).join(", ") : "";
  put("rate", count(Math.round(run?.rate_per_s ?? 0)));
  const fill = run ? run.buffered / run.buffer_capacity : 0;
  put("buffer", `${Math.round(100 * fill)} %`);
  byId("buffer").title = run ? `${count(run.buffered)} of ${count(run.buffer_capacity)}, at most ${count(run.buffer_peak)}; full ${run.stalls} times` : "";
}

// How old the newest verdict is, by the server's clock as last heard.
export function showAge(run, nowMs) {
  if (!run?.verdict_at_ms) return put("age", "\u2013");
  if (run.phase === "finished") return put("age", `at ${new Date(run.verdict_at_ms).toTimeString().slice(0, 8)}`);
  const age = Math.max(0, nowMs - run.verdict_at_ms) / 1000;
  put("age", `${age < 10 ? age.toFixed(1) : Math.round(age)} s ago`);
}

export function showLamps(run, fault, link) {
  const going = run && run.phase !== "finished";
  byId("simulated").hidden = !run?.simulated;
  const words = { connecting: ["lamp-wait", "opening"], up: ["lamp-on", "up"], down: ["lamp-fault", "LOST"], closed: ["lamp-off", "closed"] };
  lamp("lamp-link", ...(run && link ? words[run.link] : ["lamp-off", "none"]));
  lamp("lamp-streaming", ...(run?.streaming ? ["lamp-on", "coming"] : going && run.link !== "connecting" ? ["lamp-wait", "none"] : ["lamp-off", "none"]));
  lamp("lamp-faults", ...(fault ? ["lamp-fault", "FAULT"] : ["lamp-off", "none"]));
}

function lamp(id, shape, word) {
  const element = byId(id);
  element.dataset.lamp = shape;
  use(element.querySelector("svg"), shape);
  const words = element.querySelector("i");
  if (words.textContent !== word) words.textContent = word;
}

export function showAlarms(alarms) {
  const open = alarms.filter((alarm) => !alarm.acknowledged || alarm.active);
  const first = open.find((alarm) => alarm.severity === "fault") ?? open[0];
  const strip = byId("alarms");
  strip.dataset.severity = first ? first.severity : "none";
  strip.dataset.acknowledged = String(Boolean(first?.acknowledged));
  use(strip.querySelector("svg"), first ? "lamp-fault" : "lamp-off");
  const more = open.length > 1 ? `  (+${open.length - 1})` : "";
  put("alarm-text", first ? alarmWords(first) + more : "No alarm");
  byId("alarm-text").title = first ? alarmWords(first) : "";
  byId("acknowledge").hidden = !alarms.some((alarm) => !alarm.acknowledged);
  byId("alarm-list-button").hidden = !alarms.length;
  const items = alarms.map((alarm) => {
    const item = document.createElement("li");
    item.dataset.severity = alarm.severity;
    item.dataset.acknowledged = String(alarm.acknowledged && !alarm.active);
    item.textContent = `${alarm.since}  ${alarmWords(alarm)}${alarm.active ? "  \u00b7 still so" : ""}${alarm.acknowledged ? "  \u00b7 seen" : ""}`;
    return item;
  });
  byId("alarm-list").querySelector("ul").replaceChildren(...items);
}

function alarmWords(alarm) {
  return `${alarm.what}${alarm.count > 1 ? ` (${count(alarm.count)})` : ""}: ${alarm.detail}`;
}
