// The page: what the station says, put on the screen; what the operator does, sent to the station.

import { showAlarms, toggleAlarmList } from "./alarms.js";
import { cardOf } from "./card.js";
import { Characteristics } from "./characteristics.js";
import { CtView } from "./ct.js";
import { listenToDisplay } from "./display.js";
import { buttonOf, byId, inputOf, put } from "./dom.js";
import { Downloads } from "./downloads.js";
import { listen } from "./gestures.js";
import { History } from "./history.js";
import { Link } from "./link.js";
import { NewPlan, isDialogOpen } from "./new_plan.js";
import { ageWords, showBanners, showButtons, showLamps, showRun } from "./panels.js";
import { PartView } from "./part_view.js";
import { Scan } from "./points.js";
import { Profile } from "./profile.js";
import { Question } from "./question.js";
import { RegistersView } from "./registers.js";
import { Strip } from "./strip.js";
import { SurfaceScan } from "./surface_scan.js";
import { SurfaceView } from "./surface_view.js";
import { Timing } from "./timing.js";
import { TrendsView } from "./trends.js";
import { gettext, translate, translateElements } from "./words.js";

/** @import { AlarmRow, CharacteristicList, Command, Hello, Message, PlanSaved, ShownRun } from "./protocol.js" */
/** @import { Cursor } from "./drawing.js" */
/** @import { LinkState, Outcome } from "./link.js" */
/** @import { Heard } from "./card.js" */

translateElements(document.documentElement);

const VIEWS = ["live", "part", "history", "ct", "trends", "registers", "wall"];
const MOST_MAGNIFICATION = 5000;
const SLIDER_STEPS = 1000;
const SAID_MS = 8000; // so long the answer to a command stays
const SILENT = ["enter", "devices", "keep map", "search"]; // commands whose success is not worth a word

/** @type {Heard} */
const heard = {
  view: "part", chosen: null, surface: null, run: null, isRecorded: false, station: null, control: null, hasFault: false, hasBand: false,
  isRemote: false, link: "connecting",
};
/** @type {{ nowMs: number, at: number }} */
let clock = { nowMs: 0, at: 0 }; // the station's time of day, and when it was heard
/** @type {readonly AlarmRow[]} */
let alarms = [];
let version = "";
let page = 0; // the number that the station has given this page
let newest = NaN; // the number of the newest run that the station told of, 0 before the first; not known before it tells
/** @type {Cursor | null} */
let cursor = null;
let isPainting = false;
let outdated = { drawings: true, words: true };
let saidAt = 0;

const scan = new Scan();
const timing = new Timing();
const profile = new Profile(byId("profile"), redraw);
const strip = new Strip(byId("strip"), redraw);
const drawings = [profile, strip];
const surfaceScan = new SurfaceScan();
const surfaceView = new SurfaceView(surfaceScan, redraw);
const link = new Link(location.hash.slice(1), { onMessage, onBinary, onLink });
const downloads = new Downloads(() => link.token, say);
const partView = new PartView(ask, start);
new NewPlan((path, answers, content) => link.post(path, { ...answers, page: String(page) }, content), showSaved);
const history = new History({
  open: (run) => askToSee({ do: "open", run }),
  replay: (run) => askToSee({ do: "replay", run }),
  export: (run) => downloads.export(run),
  report: (run) => downloads.report(run),
  compare: (run) => downloads.compare(run),
}, rewrite, (sought) => ask(sought));
const characteristics = new Characteristics(showChosen);
/** @type {CharacteristicList} */
let told = { rows: [], more: 0, uncertainty: [], final: false, type: "characteristics" };
const ctView = new CtView((plan) => ask({ do: "import", plan }), (section) => askToSee({ do: "section", section }));

const trendsView = new TrendsView((path, asked) => link.get(path, asked), (address, name) => downloads.download(address, name));
const registersView = new RegistersView(ask);

// What the station says.

/** @param {Message} message */
function onMessage(message) {
  if (message.type === "hello") greet(message);
  else if (message.type === "run") takeRun(message);
  else if (message.type === "characteristics") takeCharacteristics(message);
  else if (message.type === "station") heard.station = message;
  else if (message.type === "control") heard.control = message;
  else if (message.type === "alarms") [alarms, heard.hasFault] = [message.alarms, message.fault];
  else if (message.type === "history") history.show(message.runs);
  else if (message.type === "found" || message.type === "results") history.hear(message);
  else if (message.type === "ct") ctView.show((heard.surface = message));
  else if (message.type === "registers") registersView.show(message);
  else if (message.type === "alive") clock = { nowMs: message.now_ms, at: performance.now() };
  if (message.type === "results") trendsView.renew(); // a run may have been added
  rewrite();
}

/**
 * A connection begins: the station says everything anew, so that nothing heard before may stay.
 * @param {Hello} hello
 */
function greet(hello) {
  if (version && version !== hello.version) location.reload();
  version = hello.version;
  page = hello.page;
  heard.isRemote = hello.remote && location.protocol !== "https:";
  heard.run = heard.station = heard.control = cursor = null;
  newest = NaN;
  scan.clear();
  surfaceScan.clear();
}

/**
 * A run that is new is looked at, also one so short that the page first hears of it when it is finished.
 * @param {ShownRun} message
 */
function takeRun({ run, recorded }) {
  const number = run ? Number(run.number) : 0;
  const isNew = run && (run.phase === "finished" ? !recorded && number > newest : heard.run?.number !== run.number);
  if (!recorded) newest = number;
  heard.run = run;
  heard.isRecorded = recorded;
  if (isNew && heard.view !== "wall") go("live");
  redraw();
}

/** @param {CharacteristicList} message */
function takeCharacteristics(message) {
  told = message;
  heard.hasBand = message.uncertainty.length > 0;
  characteristics.show(message);
  redraw();
}

/**
 * Show the chosen characteristic on the drawings, and go to it where it was opened.
 * @param {boolean} isOpened
 */
function showChosen(isOpened) {
  redraw();
  if (!isOpened) return;
  paintDrawings(); // they know the chosen one from here on
  for (const drawing of drawings) if (drawing.isReady) drawing.revealChosen();
}

/** @param {ArrayBuffer} buffer */
function onBinary(buffer) {
  timing.bytes += buffer.byteLength;
  const { nominal } = scan;
  if (!surfaceScan.take(buffer)) scan.take(buffer);
  if (scan.nominal !== nominal) cursor = null;
  redraw();
}

/** @param {LinkState} state */
function onLink(state) {
  heard.link = state;
  rewrite();
}

// What is put on the screen, in step with it, and only when something changed.

function redraw() {
  outdated.drawings = true;
  paintSoon();
}

function rewrite() {
  outdated.words = true;
  paintSoon();
}

function paintSoon() {
  if (isPainting) return;
  isPainting = true;
  requestAnimationFrame(paint);
}

function paint() {
  isPainting = false;
  const began = performance.now(), { drawings: mustDraw, words } = outdated;
  outdated = { drawings: false, words: false };
  if (words) paintWords();
  if (!mustDraw || document.body.dataset.view !== "live") return;
  paintDrawings();
  timing.note(performance.now() - began, heard.run?.surface ? surfaceScan.newestMs : scan.points.newestMs);
}

function paintDrawings() {
  const { run } = heard;
  if (run?.surface) return surfaceView.draw();
  for (const drawing of drawings) {
    if (!run) drawing.clear();
    else {
      drawing.show(scan, run.zone, run.worst);
      drawing.mark(told.rows, characteristics.chosen, told.uncertainty);
      drawing.draw(cursor);
    }
  }
  put("magnification-words", profile.isReady ? `\u00d7 ${Math.round(profile.magnified)}` : "");
  if (profile.isReady && profile.magnification === null) inputOf("magnification").value = String(sliderOf(profile.magnified));
}

function paintWords() {
  heard.chosen = history.table.chosen ?? null;
  showRun(heard);
  surfaceView.show(heard.run);
  showLamps(heard);
  showAlarms(alarms, heard.run?.kind ?? "run");
  if (heard.station) {
    partView.show(heard.station);
    history.choosePlan(heard.station.choice?.name ?? "");
    byId("tab-trends").hidden = !heard.station.has_trends;
    byId("new-device").hidden = !heard.station.can_make_plans;
    ctView.showPlans(heard.station.ct_plans, heard.station.running);
  }
  showBanners(heard, (act) => ask({ do: act }));
  showButtons(heard);
  if (question.isAsked && !heard.station?.running) question.answer(false);
  showAge();
}

function showAge() {
  put("age", ageWords(cardOf(heard).run, clock.nowMs + performance.now() - clock.at));
}

/** @param {number} magnification */
const sliderOf = (magnification) => Math.round((SLIDER_STEPS * Math.log(magnification)) / Math.log(MOST_MAGNIFICATION));

/** @param {number} slider */
const magnificationOf = (slider) => MOST_MAGNIFICATION ** (slider / SLIDER_STEPS);

// What the operator does.

/** @param {Command} command */
async function ask(command) {
  const answer = await link.ask(command);
  if (!answer.ok || !SILENT.includes(command.do)) say(answer);
  return answer;
}

/**
 * Ask for a run to look at, and look at it.
 * @param {Command} command
 */
async function askToSee(command) {
  const answer = await ask(command);
  if (answer.ok) go("live");
}

/** @param {Outcome} outcome */
function say({ ok, message }) {
  saidAt = performance.now();
  byId("said").dataset.ok = String(ok);
  put("said", `${ok ? "\u2713" : "\u2715"} ${translate(message)}`);
}

/** Get an address for one more page, here or at another computer. */
async function invite() {
  const { ok, message } = await link.ask({ do: "another page" });
  const address = `${location.origin}/#${message}`;
  say({ ok, message: ok ? gettext("For one more page, within a minute: {address}", { address }) : message });
}

async function start() {
  if (document.body.dataset.view === "part") {
    const answer = await partView.enter();
    if (!answer.ok) return;
  }
  await ask({ do: "start" });
}

/** Save the report of the run whose verdict stands at the right. */
function reportShown() {
  const { record } = cardOf(heard);
  if (record) downloads.report(record);
}

/** @param {string} view */
function go(view) {
  if (!VIEWS.includes(view)) return;
  document.body.dataset.view = heard.view = view;
  trendsView.turn(view === "trends");
  for (const button of viewButtons()) button.toggleAttribute("aria-current", button.dataset.go === view);
  redraw();
  rewrite();
}

/** @returns {NodeListOf<HTMLElement>} */
const viewButtons = () => document.querySelectorAll("[data-go]");

/**
 * A new plan was saved: that of a scan is the chosen one.
 * @param {PlanSaved} saved
 */
function showSaved({ name, surface }) {
  say({ ok: true, message: gettext("{name} is saved.", { name }) });
  if (surface) return go("ct");
  go("part");
  partView.awaitEntry(name);
}

function nextPart() {
  go("part");
  partView.enterSerialNumber();
}

/** A page that watches is refused here: the station may have given it the control meanwhile, and would abort without a question. */
function abort() {
  if (heard.control?.taken && !heard.control.controls) say({ ok: false, message: gettext("another page is in control; this one watches") });
  else question.ask();
}

/** Leave what is in front: the list of alarms, a recorded run, a view. */
function leave() {
  if (heard.station?.running) abort();
  else if (!byId("alarm-list").hidden) toggleAlarmList();
  else if (heard.isRecorded) ask({ do: "live" });
  else go("live");
}

const question = new Question(() => ask({ do: "abort" }));

const worstPoint = () => (heard.run ? scan.points.worst(heard.run.zone) : null);

/** @param {Cursor | null} point */
function readOut(point) {
  cursor = point;
  for (const drawing of drawings) drawing.outdated.cursor = true;
  redraw();
}

/** @param {string} id */
const press = (id) => () => {
  const button = buttonOf(id);
  if (!button.disabled && !button.hidden) button.click();
};

/**
 * @param {string} view
 * @param {string} id
 */
const pressIn = (view, id) => () => {
  if (document.body.dataset.view === view) press(id)();
};

/** What keys do, some of them according to the view. @type {Readonly<Record<string, (() => void)[]>>} */
const KEYS = {
  1: [() => go("live")], 2: [() => go("part")], 3: [() => go("history")], 4: [press("tab-ct")], 5: [press("tab-trends")],
  s: [press("start")], e: [press("end")], n: [press("next")], a: [press("acknowledge")], l: [press("alarm-list-button")],
  t: [press("test")], o: [pressIn("history", "open-run"), pressIn("ct", "open-section")], r: [pressIn("history", "replay-run")],
  x: [pressIn("history", "export-run")], p: [reportShown], c: [pressIn("history", "compare-run")], i: [pressIn("ct", "import-ct")],
  escape: [leave],
};

/** @param {KeyboardEvent} event */
function pressKey(event) {
  if (isDialogOpen()) return;
  const key = event.key.toLowerCase(), acts = KEYS[key];
  const isTyping = event.target instanceof Element && event.target.matches("input:not([type=range]), textarea, select");
  const isForPage = !isTyping && !event.ctrlKey && !event.metaKey && !event.altKey;
  if (!acts || !(isForPage || key === "escape")) return;
  event.preventDefault();
  for (const act of acts) act();
}

document.addEventListener("keydown", pressKey);
for (const button of viewButtons()) button.addEventListener("click", () => go(button.dataset.go ?? ""));
buttonOf("another-page").addEventListener("click", invite);
buttonOf("start").addEventListener("click", start);
buttonOf("run-demo").addEventListener("click", () => ask({ do: "demo" }));
buttonOf("report-shown").addEventListener("click", reportShown);
buttonOf("end").addEventListener("click", () => ask({ do: "end" }));
buttonOf("abort").addEventListener("click", abort);
buttonOf("next").addEventListener("click", nextPart);
buttonOf("acknowledge").addEventListener("click", () => ask({ do: "acknowledge" }));
buttonOf("alarm-list-button").addEventListener("click", toggleAlarmList);
inputOf("magnification").addEventListener("input", (event) => {
  profile.magnify(magnificationOf(Number(/** @type {HTMLInputElement} */ (event.target).value)));
});
buttonOf("magnification-auto").addEventListener("click", () => profile.magnify(null));
for (const drawing of drawings) listen(drawing, readOut, worstPoint);
window.addEventListener("beforeprint", paintDrawings);
listenToDisplay();
setInterval(() => {
  showAge();
  if (performance.now() - saidAt > SAID_MS) put("said", "");
}, 250);
Object.assign(window, { timing: () => ({ ...timing.summary(), held: heard.run?.surface ? surfaceScan.points.count : scan.points.held }) });
go(new URLSearchParams(location.search).has("wall") ? "wall" : "part");
