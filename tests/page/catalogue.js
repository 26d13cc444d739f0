// The page's words: found in its scripts and elements, kept in one gettext catalogue a language, and compiled for the page.
//
// `node tests/page/catalogue.js` adds to every cmmlink/console/LANGUAGE.po the texts that it lacks, drops those that are no longer said,
// and writes LANGUAGE.json and languages.js beside the page's scripts. With --check it changes nothing, and fails where something is
// missing, left over or out of date.
//
// A text is the argument of gettext or ngettext in a script, or words, a title or a label in index.html. What the station tells is
// written down by hand, with the comment `told by the program` above it; the catalogues of the reports are taken over as they are.

import { existsSync, readFileSync, readdirSync, writeFileSync } from "node:fs";

import * as acorn from "acorn";
import { simple } from "acorn-walk";
import { po } from "gettext-parser";
import { parse } from "parse5";

const CONSOLE = new URL("../../cmmlink/console/", import.meta.url);
const PAGE = new URL("static/", CONSOLE);
const REPORTS = new URL("../../cmmlink/report/", import.meta.url);
const TOLD = "told by the program";
const SPOKEN = ["aria-label", "title", "placeholder"]; // as translateElements of words.js has it, and so has the next line
const UNSPOKEN = ["kbd", "script", "style", "svg"];
const PLACE = /\{\w+\}/g;

/** Every text of a script with its plural, if it has one. */
function* textsOfScript(name, source) {
  const found = [];
  simple(acorn.parse(source, { ecmaVersion: "latest", sourceType: "module" }), {
    CallExpression({ callee, arguments: [one, many] }) {
      if (callee.name === "gettext") found.push([valueOf(one, name)]);
      else if (callee.name === "ngettext") found.push([valueOf(one, name), valueOf(many, name)]);
    },
  });
  for (const [one, many] of found) if (one !== null) yield { one, many, where: name };
}

/** A text that stands in a script, also where it is put together of pieces; null where it comes from elsewhere. */
function valueOf(node, name) {
  if (node.type === "Literal" && typeof node.value === "string") return node.value;
  if (node.type === "BinaryExpression" && node.operator === "+") return valueOf(node.left, name) + valueOf(node.right, name);
  if (name === "words.js") return null;
  throw new Error(`${name}: gettext is given something else than a text`);
}

/** Every text of the page's elements. */
function* textsOfElements(node, isSpoken = true) {
  const attributes = Object.fromEntries((node.attrs ?? []).map(({ name, value }) => [name, value]));
  const isTold = isSpoken && attributes.translate !== "no" && !UNSPOKEN.includes(node.nodeName);
  const words = isTold && node.nodeName === "#text" ? node.value.trim().replace(/\s+/g, " ") : "";
  const labels = attributes.translate === "no" ? [] : SPOKEN.map((name) => attributes[name]);
  for (const one of [words, ...labels]) if (/\p{L}/u.test(one ?? "")) yield { one, where: "index.html" };
  for (const child of node.childNodes ?? []) yield* textsOfElements(child, isTold);
}

/** Every text that the page says, in the order of its files. */
export function textsOfPage() {
  const found = new Map();
  for (const name of readdirSync(PAGE).sort()) {
    const source = () => readFileSync(new URL(name, PAGE), "utf8");
    let texts = [];
    if (name.endsWith(".js")) texts = textsOfScript(name, source());
    else if (name === "index.html") texts = textsOfElements(parse(source()));
    for (const text of texts) {
      const known = found.get(text.one);
      if (known && known.many !== text.many) throw new Error(`${text.where}: "${text.one}" is said with and without a plural`);
      if (!known) found.set(text.one, text);
    }
  }
  return found;
}

const read = (file) => (existsSync(file) ? po.parse(readFileSync(file), "utf-8") : null);
const entriesOf = (catalogue) => Object.values(catalogue?.translations[""] ?? {}).filter(({ msgid }) => msgid);
const isTold = ({ comments }) => comments?.extracted === TOLD;

/** The catalogue of a language with exactly the texts that are said, those of the page first and what the program tells after them. */
function renewed(catalogue, texts, reported) {
  const entries = new Map(entriesOf(catalogue).map((entry) => [entry.msgid, entry]));
  const kept = {};
  for (const { one, many, where } of texts.values()) {
    if (reported.has(one)) continue;
    const { msgstr } = entries.get(one) ?? {}, forms = many === undefined ? 1 : pluralsOf(catalogue);
    const said = msgstr?.length === forms ? msgstr : Array(forms).fill("");
    kept[one] = { msgid: one, ...(many !== undefined && { msgid_plural: many }), msgstr: said, comments: { reference: where } };
  }
  for (const entry of entries.values()) if (isTold(entry) && !texts.has(entry.msgid)) kept[entry.msgid] = entry;
  const header = catalogue.translations[""][""];
  return { ...catalogue, translations: { "": { "": header, ...kept } } };
}

const pluralsOf = ({ headers }) => Number(/nplurals=(\d)/.exec(headers["Plural-Forms"])[1]);

/** What is wrong with a translation, in words; nothing where it can be shown. */
function mistakeOf({ msgid, msgid_plural: many, msgstr }) {
  const places = (text) => new Set(text.match(PLACE) ?? []);
  if (msgstr.some((said) => !said)) return `"${msgid}" is not translated`;
  const known = places(msgid + (many ?? "")), asked = places(many ?? msgid);
  const isRight = msgstr.every((said) => [...places(said)].every((place) => known.has(place)));
  const isWhole = [...asked].every((place) => places(msgstr.at(-1)).has(place));
  return isRight && isWhole ? "" : `"${msgid}" has other places in its translation`;
}

/** Everything that belongs to one language: its catalogue, what the page is given, and what is wrong. */
function languageOf(name, texts) {
  const file = new URL(`${name}.po`, CONSOLE), catalogue = read(file);
  const reported = new Map(entriesOf(read(new URL(`${name}.po`, REPORTS))).map((entry) => [entry.msgid, entry]));
  const whole = renewed(catalogue, texts, reported);
  const all = [...reported.values(), ...entriesOf(whole)];
  const compiled = Object.fromEntries(all.flatMap((entry) => {
    const { msgid, msgid_plural: many, msgstr } = entry;
    if (many === undefined) return [[msgid, msgstr[0]]];
    return isTold(entry) ? [[msgid, msgstr], [many, msgstr]] : [[msgid, msgstr]]; // a sentence is found by each of its two forms
  }));
  return {
    written: [
      [file, po.compile(whole, { foldLength: 0 }).toString().trimEnd()],
      [new URL(`${name}.json`, PAGE), JSON.stringify(compiled, null, 1)],
    ],
    mistakes: [
      ...entriesOf(whole).map(mistakeOf).filter(Boolean),
      ...entriesOf(catalogue).filter((entry) => isTold(entry) && reported.has(entry.msgid))
        .map(({ msgid }) => `"${msgid}" stands in the catalogue of the reports`),
    ].map((mistake) => `${name}.po: ${mistake}`),
  };
}

function main() {
  const isCheck = process.argv.includes("--check"), texts = textsOfPage();
  const names = readdirSync(CONSOLE).filter((name) => name.endsWith(".po")).map((name) => name.replace(".po", "")).sort();
  const languages = names.map((name) => languageOf(name, texts));
  const list = "// Written by `node tests/page/catalogue.js`: the page's own language, and those there is a catalogue of.\n\n"
    + `export const LANGUAGES = ${JSON.stringify(["en", ...names]).replace(",", ", ")};`;
  const mistakes = languages.flatMap((language) => language.mistakes);
  for (const [file, content] of [...languages.flatMap(({ written }) => written), [new URL("languages.js", PAGE), list]]) {
    if (existsSync(file) && readFileSync(file, "utf8") === `${content}\n`) continue;
    if (isCheck) mistakes.push(`${file.pathname.split("/").at(-1)} is out of date: run node tests/page/catalogue.js`);
    else writeFileSync(file, `${content}\n`);
  }
  for (const mistake of mistakes) console.error(mistake);
  process.exitCode = Number(mistakes.length > 0);
}

main();
