// The language of this page: the one the address asks for, the one that was chosen here, or the browser's; its catalogue is loaded first.

import { LANGUAGES } from "./languages.js";
import { ENGLISH, Speech } from "./speech.js";

/** @import { Catalogue, Places } from "./speech.js" */

const KEY = "cmmlink-language";

const speech = new Speech(await catalogueOf(wished()));

/** How the reader writes numbers and dates, and which language the page is in. */
export const { locale } = speech;

/** @type {(text: string, values?: Places) => string} */
export const gettext = (text, values) => speech.gettext(text, values);

/** @type {(one: string, many: string, count: number, values?: Places) => string} */
export const ngettext = (one, many, count, values) => speech.ngettext(one, many, count, values);

/** A sentence that the station made. @type {(told: string) => string} */
export const translate = (told) => speech.translate(told);

/** Dates in a text. @type {(written: string) => string} */
export const dated = (written) => speech.dated(written);

/** The languages that the reader wants, best first: of the address, of an earlier choice, of the browser. */
function wished() {
  if (typeof document === "undefined") return [];
  const asked = new URLSearchParams(location.search).get("lang");
  if (asked !== null) chooseLanguage(asked);
  return [...[asked ?? chosenLanguage()].filter(Boolean), ...navigator.languages];
}

/**
 * The catalogue of the first language wished for that there is one of. Where it cannot be loaded the page is in English.
 * @param {readonly string[]} tags
 * @returns {Promise<Catalogue>}
 */
async function catalogueOf(tags) {
  const known = tags.map((tag) => tag.split("-")[0].toLowerCase());
  const language = known.find((one) => LANGUAGES.includes(one)) ?? "en";
  const tag = tags.find((one) => one.toLowerCase().startsWith(`${language}-`)) ?? language; // of a country, where one is known
  if (typeof document !== "undefined") document.documentElement.lang = language;
  if (language === "en") return { ...ENGLISH, locale: tag };
  const answer = await fetch(`${language}.json`);
  return answer.ok ? { locale: tag, texts: await answer.json() } : ENGLISH;
}

/** The language chosen on this page before; empty where it is the browser's. */
export function chosenLanguage() {
  try {
    return localStorage.getItem(KEY) ?? "";
  } catch {
    return "";
  }
}

/** @param {string} language empty for the browser's */
export function chooseLanguage(language) {
  try {
    localStorage.setItem(KEY, language);
  } catch {
    // the address keeps it
  }
}

const SPOKEN = ["aria-label", "title", "placeholder"];
const UNSPOKEN = "[translate=no], kbd, script, style, svg";

/**
 * Put the words of the page's own elements into its language.
 * @param {Element} root
 */
export function translateElements(root) {
  if (speech.isEnglish) return;
  const texts = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const node = texts.currentNode, said = node.nodeValue ?? "", words = said.trim();
    if (words && !node.parentElement?.closest(UNSPOKEN)) node.nodeValue = said.replace(words, () => gettext(words.replace(/\s+/g, " ")));
  }
  for (const name of SPOKEN) {
    for (const element of root.querySelectorAll(`[${name}]:not([translate=no])`)) {
      element.setAttribute(name, gettext(element.getAttribute(name) ?? ""));
    }
  }
}
