// What the page says: the banner, the word before a run, how far values can move, and which alarm.

import assert from "node:assert/strict";
import { test } from "node:test";

import { alarmWords } from "../../cmmlink/console/static/alarms.js";
import { CODE_OF, SHAPE_OF, wordOf } from "../../cmmlink/console/static/verdicts.js";
import { cardOf, readiness } from "../../cmmlink/console/static/card.js";
import { flooredShare } from "../../cmmlink/console/static/numbers.js";
import { ageWords, bannersOf, moveWords } from "../../cmmlink/console/static/panels.js";

const HEARD = { view: "live", chosen: null, surface: null, run: null, isRecorded: false,
  station: null, control: null, hasFault: false, hasBand: false, isRemote: false, link: "live" };
const RUN = { number: "run 7", phase: "measuring", link: "up", remark: "" };

test("the most urgent thing stands in the banner", () => {
  const lost = { ...RUN, link: "down" };
  const watching = { controls: false, taken: true };
  const bannerOf = (heard) => bannersOf(heard)[0];
  assert.deepEqual(bannersOf(HEARD), []);
  assert.match(bannerOf({ ...HEARD, link: "refused", run: lost }).words, /no access/);
  assert.match(bannerOf({ ...HEARD, link: "stale", run: lost }).words, /STALE/);
  assert.match(bannerOf({ ...HEARD, link: "away" }).words, /STALE/);
  assert.match(bannerOf({ ...HEARD, run: lost, control: watching }).words, /LINK LOST/);
  assert.deepEqual(bannersOf({ ...HEARD, run: { ...lost, phase: "finished" } }), []);
  assert.deepEqual(bannerOf({ ...HEARD, run: RUN, isRecorded: true }),
    { words: "run 7", kind: "note", button: "Back to live", act: "live" });
  assert.match(bannerOf({ ...HEARD, control: watching }).words, /another page is in control/);
  assert.match(bannerOf({ ...HEARD, control: { ...watching, taken: false } }).words, /no page is in control/);
  assert.equal(bannerOf({ ...HEARD, run: { ...RUN, remark: "identical" }, isRemote: true }).words, "identical");
  assert.match(bannerOf({ ...HEARD, run: RUN, isRemote: true }).words, /open to the network/);
});

test("banners stack: one thing never hides another", () => {
  const replay = { ...RUN, kind: "replay", began: "2026-03-14 15:09:26 +0000", link: "down" };
  const words = bannersOf({ ...HEARD, run: replay, control: { controls: false, taken: true }, isRemote: true }).map((one) => one.words);
  assert.deepEqual(words.map((one) => one.split(/[ .:]/)[0]), ["LINK", "Replaying", "Watching", "This"]);
});

test("the card belongs to what the view shows", () => {
  const verdict = { word: "CONFORM", shape: "conform", final: true, why: "all within", reasons: ["also this"] };
  const run = { ...RUN, kind: "run", phase: "finished", part: "blade", serial_number: "B-1", began: "then", verdict,
    notes: [], worst: null };
  const station = { can_start: true, choice: { name: "a.yaml", part: "vane" }, serial_number: "B-2" };
  const heard = { ...HEARD, run, station };
  assert.deepEqual([cardOf(heard).word, cardOf(heard).reasons], ["CONFORM", ["also this"]]);
  const next = cardOf({ ...heard, view: "part" });
  assert.deepEqual([next.part, next.serial, next.word, next.run], ["vane", "B-2", "READY", null]);
  assert.match(next.before, /B-1.*CONFORM.*then/);
  const surface = { plan: "ct.yaml", word: "NOT CONFORM", shape: "not-conform", state: "done", message: "",
    notes: [], sections: [], done: 3, total: 3 };
  const ct = cardOf({ ...heard, view: "ct", surface });
  assert.deepEqual([ct.part, ct.serial, ct.word], ["ct.yaml", "", "NOT CONFORM"]);
  const chosen = { part: "blade", serial_number: "B-0", word: "ABORTED AT 32 %",
    shape: "ended-early", counted: false, began: "once", run: "r" };
  const row = cardOf({ ...heard, view: "history", chosen });
  assert.deepEqual([row.serial, row.word, row.final, row.badge], ["B-0", "ABORTED AT 32 %", false, "RECORDED once"]);
  const isOn = { ...run, phase: "measuring", verdict: { ...verdict, final: false } };
  for (const view of ["live", "part", "history", "ct"]) assert.equal(cardOf({ ...heard, run: isOn, view, chosen, surface }).run, isOn);
  assert.equal(cardOf({ ...heard, run: { ...run, kind: "replay" } }).badge, "REPLAY of then");
});

test("values are final only where the registration is, and no number is claimed before", () => {
  const words = (state, other_poses = 0, phase = "finished") =>
    moveWords({ phase, registration: { state, can_move_mm: null, other_poses } });
  assert.equal(moveWords(null), "\u2013");
  assert.equal(words("seeking", 0, "measuring"), "\u2013");
  assert.equal(words("provisional", 0, "measuring"), "the pose still moves");
  assert.equal(words("provisional"), "not settled");
  assert.equal(words("settled"), "final");
  assert.equal(words("settled", 1), "final, but 1 other pose fits as well");
  assert.equal(words("settled", 2), "final, but 2 other poses fit as well");
});

test("a share is never rounded up", () => {
  assert.deepEqual([1, 0.99999, 0.7498, 0.95, 0].map(flooredShare), ["100 %", "99.9 %", "74.9 %", "95.0 %", "0.0 %"]);
});

test("a card without a run shows the worst point of its row, and never zeros for numbers", () => {
  const zone = { lower_mm: -0.05, upper_mm: 0.05 };
  const row = { ...zone, worst_mm: -0.3919, worst_station_mm: 19.9, verdict: "nonconform" };
  const card = (chosen) => cardOf({ ...HEARD, view: "history", chosen });
  assert.deepEqual(card(row).worst, { deviation: -0.3919, station: 19.9, place: null, zone, kind: "under" });
  assert.equal(card({ ...row, verdict: "uncertain" }).worst.kind, "not-proven");
  assert.equal(card({ ...row, worst_mm: 0.01, verdict: "uncertain" }).worst.kind, "in");
  assert.equal(card({ ...row, worst_mm: null }).worst, null);
  assert.equal(card(row).run, null);
  const sections = [
    { ...row, worst_mm: 0.02, verdict: "conform" }, row,
    { ...row, worst_mm: null, worst_station_mm: null, verdict: "uncertain" }];
  const surface = { plan: "ct.yaml", word: "NOT CONFORM", shape: "not-conform", state: "done", message: "two of three", notes: ["n"],
    sections };
  const ct = cardOf({ ...HEARD, view: "ct", surface });
  assert.deepEqual([ct.worst.deviation, ct.notes, ct.why], [-0.3919, ["n"], "two of three"]);
});

test("before a run the page says whether one can be started", () => {
  assert.equal(readiness(null).word, "NO PLAN");
  assert.equal(readiness({ can_start: true, choice: { name: "a.yaml" } }).word, "READY");
  assert.equal(readiness({ can_start: false, choice: { name: "a.yaml" } }).why, "a.yaml cannot be run");
});

test("the age of the newest verdict is never negative", () => {
  const run = { phase: "measuring", verdict_at_ms: 5000 };
  assert.equal(ageWords(null, 0), "\u2013");
  assert.equal(ageWords({ ...run, verdict_at_ms: null }, 0), "\u2013");
  assert.equal(ageWords(run, 4000), "0.0 s ago");
  assert.equal(ageWords(run, 6234), "1.2 s ago");
  assert.equal(ageWords(run, 65_400), "60 s ago");
  assert.match(ageWords({ ...run, phase: "finished" }, 9000), /^at \d\d:\d\d:\d\d$/);
});

test("an alarm that came more than once says how often", () => {
  assert.equal(alarmWords({ what: "Link lost", count: 1, detail: "the port is gone" }), "Link lost: the port is gone");
  assert.equal(alarmWords({ what: "Data lost", count: 1200, detail: "gap" }), "Data lost (1,200): gap");
});

test("each verdict has a word and a shape of its own", () => {
  assert.deepEqual([0, 1, 2].map(wordOf), ["CONFORM", "NOT PROVEN", "NOT CONFORM"]);
  assert.deepEqual(Object.keys(CODE_OF), Object.keys(SHAPE_OF));
  assert.deepEqual(CODE_OF, { conform: 0, uncertain: 1, nonconform: 2 });
  assert.equal(wordOf(7), "");
});
