// One language of the page: places, plurals of every kind, sentences that the station made, numbers and dates.

import assert from "node:assert/strict";
import { test } from "node:test";

import { ENGLISH, Speech } from "../../cmmlink/console/static/speech.js";

const GERMAN = new Speech({ locale: "de", texts: {
  "{name} saved": "{name} gespeichert", "Link lost": "Verbindung verloren", "the port is gone": "der Anschluss ist weg",
  "{count} part": ["{count} Teil", "{count} Teile"], "{count} point": ["{count} Punkt", "{count} Punkte"],
  "{count} points": ["{count} Punkt", "{count} Punkte"],
  "all {points} within tolerance": "alle {points} innerhalb der Toleranz",
  "{points} points lie beyond {lower} mm.": "{points} Punkte liegen jenseits von {lower} mm.",
  "{points}.": "nie", "at {time}": "um {time}", "upper {limit}": "obere {limit}", "the scan of {began}": "der Scan vom {began}",
} });

test("what the catalogue lacks is said in English, with its places filled", () => {
  const english = new Speech(ENGLISH);
  assert.equal(english.gettext("{name} saved", { name: "a $& b" }), "a $& b saved");
  assert.equal(english.ngettext("{count} part", "{count} parts", 1), "1 part");
  assert.equal(english.ngettext("{count} part", "{count} parts", 0), "0 parts");
  assert.equal(english.translate("0.5 mm of 2026-11-27"), "0.5 mm of 2026-11-27");
  assert.equal(GERMAN.gettext("not there: {what}", { what: 1.5 }), "not there: 1.5");
});

test("plural forms follow the rules of the language", () => {
  assert.deepEqual([0, 1, 2].map((count) => GERMAN.ngettext("{count} part", "{count} parts", count)), ["0 Teile", "1 Teil", "2 Teile"]);
  const polish = new Speech({ locale: "pl", texts: { "{count} part": ["{count} one", "{count} few", "{count} many"] } });
  const said = [1, 2, 5, 22, 25].map((count) => polish.ngettext("{count} part", "{count} parts", count));
  assert.deepEqual(said, ["1 one", "2 few", "5 many", "22 few", "25 many"]);
  const japanese = new Speech({ locale: "ja", texts: { "{count} part": ["{count} x"] } });
  assert.equal(japanese.ngettext("{count} part", "{count} parts", 2), "2 x");
});

test("a sentence of the station is translated with what stands in it, the text that says most first", () => {
  assert.equal(GERMAN.translate("12 points lie beyond -0.05 mm."), "12 Punkte liegen jenseits von -0,05 mm.");
  assert.equal(GERMAN.translate("all 2,000 points within tolerance"), "alle 2.000 Punkte innerhalb der Toleranz");
  assert.equal(GERMAN.translate("all 1 point within tolerance"), "alle 1 Punkt innerhalb der Toleranz");
  assert.equal(GERMAN.translate("Link lost: the port is gone"), "Verbindung verloren: der Anschluss ist weg");
  assert.equal(GERMAN.translate("the scan of 2026-11-27 08:15:00 +0000"), "der Scan vom 27.11.2026 08:15:00 +0000");
  assert.equal(GERMAN.translate("it changes, at stations 5.5, Link lost"), "it changes, at stations 5,5, Link lost");
  assert.equal(GERMAN.translate("upper side: Link lost"), "upper side: Verbindung verloren", "the name of a characteristic");
  assert.equal(GERMAN.translate("nobody knows this of 3.25 mm"), "nobody knows this of 3,25 mm");
});

test("only a number has its point changed: no version, no address, no name of a file", () => {
  const names = ["1.2.3", "127.0.0.1", "blade.yaml", "COM3", "section7.5.csv", "1.5e-3", "v1.5"];
  assert.deepEqual(names.map((name) => GERMAN.figures(name)), names);
  assert.equal(GERMAN.figures("from 10.25 to 12.5 mm, \u22120.05 .. +0.05"), "from 10,25 to 12,5 mm, \u22120,05 .. +0,05");
  assert.equal(GERMAN.figures("12,345.5 mm (1,000). 2"), "12.345,5 mm (1.000). 2");
});
