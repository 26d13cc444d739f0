// The page: what the station says, put on the screen; what the operator does, sent to the station.

import { Ct } from "./ct.js";
import { Figures } from "./figures.js";
import { listen } from "./gestures.js";
import { History } from "./history.js";
import { Link } from "./link.js";
import { byId, put, showAge, showAlarms, showLamps, showRun } from "./panels.js";
import { Nominal, Points, VERDICT, kindOf } from "./points.js";
import { Profile } from "./profile.js";
import { Strip } from "./strip.js";
import { Work } from "./work.js";

const NOMINAL = 2;
const VIEWS = ["live", "part", "history", "ct"];

const told = { run: null, station: null, control: null, alarms: [], fault: false, recorded: false, nowMs: 0, nowAt: 0, version: null, remote: false };
const points = new Points();
const figures = new Figures();
let nominal = null, cursor = null, waiting = false, wanted = { draw: true, words: true }, linkState = "connecting";

const profile = new Profile(byId("profile"), () => soon("draw"));
const strip = new Strip(byId("strip"), () => soon("draw"));
const link = new Link(location.hash.slice(1), { onState, onBinary, onLink });
const work = new Work(ask, start);
const history = new History({
  open: async (run) => (await ask("open", { run })).ok && go("live"),
  replay: async (run) => (await ask("replay", { run })).ok && go("live"),
  export: download,
});

const ct = new Ct({
  inspect: (plan) => ask("import", { plan }),
  open: async (section) => (await ask("section", { section })).ok && go("live"),
});

// What the station says.

function onState(kind, content) {
  if (kind === "hello") hello(content);
  else if (kind === "run") newRun(content);
  else if (kind === "station") told.station = content;
  else if (kind === "control") told.control = content;
  else if (kind === "alarms") [told.alarms, told.fault] = [content.alarms, content.fault];
  else if (kind === "history") history.show(content.runs);
  else if (kind === "ct") ct.show(content);
  else if (kind === "alive") [told.nowMs, told.nowAt] = [content.now_ms, performance.now()];
  soon("words");
}

// A connection begins: the station says everything anew, so that nothing heard before may stay.
function hello(content) {
  if (told.version !== null && told.version !== content.version) location.reload();
  told.version = content.version;
  told.remote = content.remote;
  told.run = told.station = told.control = nominal = cursor = null;
  points.clear(0);
}

function newRun({ run, recorded }) {
  const before = told.run;
  told.run = run;
  told.recorded = recorded;
  if (run && run.phase !== "finished" && before?.number !== run.number) go("live");
  soon("draw");
}

function onBinary(buffer) {
  figures.bytes += buffer.byteLength;
  if (kindOf(buffer) === NOMINAL) [nominal, cursor] = [new Nominal(buffer), null];
  else points.take(buffer);
  soon("draw");
}

function onLink(state) {
  linkState = state;
  soon("words");
}

// What is put on the screen, in step with it, and only when something changed.

function soon(what) {
  wanted[what] = true;
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(paint);
}

function paint() {
  waiting = false;
  const began = performance.now(), { draw, words } = wanted;
  wanted = { draw: false, words: false };
  if (words) paintWords();
  if (!draw || document.body.dataset.view !== "live") return;
  const { run } = told;
  if (nominal && run) {
    for (const drawing of [profile, strip]) {
      drawing.show(points, nominal, run.zone, run.worst);
      drawing.draw(cursor);
    }
    put("magnification-words", `\u00d7 ${Math.round(profile.magnified)}`);
    if (profile.magnification === null) byId("magnification").value = String(sliderOf(profile.magnified));
  }
  figures.drew(performance.now() - began, points.newest);
}

function paintWords() {
  const { run, station } = told;
  const choice = station?.choice;
  showRun(run, { part: choice?.part, plan: choice?.name, serial_number: station?.serial_number ?? "", operator: station?.operator, can_start: station?.can_start });
  showLamps(run, told.fault, linkState === "live");
  showAlarms(told.alarms);
  if (station) work.show(station);
  if (station) ct.showPlans(station.ct_plans, station.running);
  showBanner();
  showButtons();
  age();
}

function age() {
  showAge(told.run, told.nowMs + performance.now() - told.nowAt);
}

function showBanner() {
  const { run, control } = told;
  const banner = (words, kind, button = "") => {
    byId("banner").hidden = !words;
    byId("banner").dataset.kind = kind;
    put("banner-text", words);
    byId("banner-button").hidden = !button;
    put("banner-button", button);
  };
  document.body.dataset.stale = String(linkState !== "live");
  if (linkState === "refused") return banner("This address is not valid any more: open the one the program printed.", "fault");
  if (linkState === "connecting") return banner("Connecting to the station \u2026", "note");
  if (linkState !== "live") return banner("STALE: the station does not answer. What you see is old. Trying again \u2026", "fault");
  if (run?.link === "down" && run.phase !== "finished") return banner("LINK LOST. The device cannot be reached; trying again \u2026", "fault");
  if (told.recorded) return banner(run?.number ?? "", "note", "Back to now");
  if (control && !control.controls) return banner(control.taken ? "Watching: another page is in control." : "Watching: no page is in control.", "note", "Take control");
  if (run?.remark) return banner(run.remark, "note");
  if (told.remote) return banner("This station is open to the network: whoever knows the address can control it.", "warning");
  banner("", "none");
}

function showButtons() {
  const { station, control, run } = told;
  const may = Boolean(control?.controls) && linkState === "live", going = Boolean(station?.running);
  byId("start").disabled = !may || !station?.can_start;
  byId("end").disabled = !may || !going || !run || run.phase !== "measuring";
  byId("abort").disabled = !may || !going;
  byId("next").disabled = !may || going;
  byId("acknowledge").disabled = !may;
  document.body.dataset.running = String(going);
}

// What the operator does.

async function ask(what, more = {}, silent = false) {
  const answer = await link.ask(what, more);
  if (!silent && what !== "enter") say(answer);
  else if (!answer.ok) say(answer);
  return answer;
}

let saidAt = 0;
function say({ ok, message }) {
  saidAt = performance.now();
  byId("said").dataset.ok = String(ok);
  put("said", `${ok ? "\u2713" : "\u2715"} ${message}`);
}

async function start() {
  if (document.body.dataset.view === "part" && !(await work.enter()).ok) return;
  await ask("start");
}

async function download(run) {
  const answer = await fetch(`/export/${encodeURIComponent(run)}`, { headers: { Authorization: `Bearer ${link.token}` } });
  if (!answer.ok) return say({ ok: false, message: await answer.text() });
  const address = URL.createObjectURL(await answer.blob());
  const anchor = document.createElement("a");
  anchor.href = address;
  anchor.download = `${run}.zip`;
  anchor.click();
  URL.revokeObjectURL(address);
  say({ ok: true, message: `${run}.zip saved` });
}

function go(view) {
  if (!VIEWS.includes(view)) return;
  document.body.dataset.view = view;
  for (const button of document.querySelectorAll("[data-go]")) button.toggleAttribute("aria-current", button.dataset.go === view);
  soon("draw");
  soon("words");
}

function nextPart() {
  go("part");
  byId("serial").focus();
  byId("serial").select();
}

function leave() {
  const list = byId("alarm-list");
  if (!list.hidden) return toggleAlarms();
  if (told.recorded) return ask("live");
  go("live");
}

function toggleAlarms() {
  const list = byId("alarm-list");
  list.hidden = !list.hidden;
  byId("alarm-list-button").setAttribute("aria-expanded", String(!list.hidden));
}

function worstPoint() {
  const { run } = told;
  if (!run?.worst || !points.bins) return null;
  const middle = (run.zone.lower_mm + run.zone.upper_mm) / 2;
  let best = null, most = -1;
  for (let side = 0; side < 2; side++) for (let bin = 0; bin < points.bins; bin++) {
    const far = Math.abs(points.sides[side][1][bin] - middle);
    if (far > most) [most, best] = [far, [side, bin]];
  }
  return best && points.at(...best);
}

const sliderOf = (magnification) => Math.round((1000 * Math.log10(magnification)) / Math.log10(5000));
const magnificationOf = (slider) => 5000 ** (slider / 1000);

const press = (id) => () => byId(id).disabled || byId(id).hidden || byId(id).click();
const KEYS = {
  1: () => go("live"), 2: () => go("part"), 3: () => go("history"), 4: () => byId("tab-ct").hidden || go("ct"),
  s: press("start"), e: press("end"), n: press("next"), a: press("acknowledge"), l: press("alarm-list-button"), t: press("test"),
  o: () => (within("history", press("open-run")), within("ct", press("open-section"))),
  r: () => within("history", press("replay-run")), x: () => within("history", press("export-run")), i: () => within("ct", press("import-ct")),
};
const within = (view, act) => document.body.dataset.view === view && act();

document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    event.preventDefault();
    if (told.station?.running) ask("abort");
    else leave();
    return;
  }
  const typing = event.target.matches("input:not([type=range]), textarea");
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  const act = KEYS[event.key.toLowerCase()];
  if (act) {
    event.preventDefault();
    act();
  }
});
for (const button of document.querySelectorAll("[data-go]")) button.addEventListener("click", () => go(button.dataset.go));
byId("start").addEventListener("click", start);
byId("end").addEventListener("click", () => ask("end"));
byId("abort").addEventListener("click", () => ask("abort"));
byId("next").addEventListener("click", nextPart);
byId("acknowledge").addEventListener("click", () => ask("acknowledge"));
byId("alarm-list-button").addEventListener("click", toggleAlarms);
byId("banner-button").addEventListener("click", () => ask(told.recorded ? "live" : "take control"));
byId("magnification").addEventListener("input", (event) => profile.magnify(magnificationOf(Number(event.target.value))));
byId("magnification-auto").addEventListener("click", () => profile.magnify(null));
const setCursor = (point) => {
  cursor = point;
  profile.cursorDirty = strip.cursorDirty = true;
  soon("draw");
};
listen(profile, setCursor, worstPoint);
listen(strip, setCursor, worstPoint);
setInterval(() => {
  age();
  if (performance.now() - saidAt > 8000) put("said", "");
}, 250);
window.figures = () => ({ ...figures.summary(), held: points.held });
go("part");
