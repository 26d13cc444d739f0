// Speaks one language from a gettext catalogue whose keys are the English texts: what the page says, and what the station told it.

/** @typedef {Readonly<Record<string, string | number>>} Places what stands in the places of a text */
/** @typedef {{ locale: string, texts: Readonly<Record<string, string | readonly string[]>> }} Catalogue texts, with plurals in a list */

const PLACE = /\{(\w+)\}/g;
const CATEGORIES = ["zero", "one", "two", "few", "many", "other"]; // of CLDR, in the order of the plural forms of a catalogue
const ISO_DATE = /\b(\d{4})-(\d\d)-(\d\d)\b/g;
/** What stands between sentences, and between their parts. @type {readonly (readonly [RegExp, string])[]} */
const BETWEEN = [[/(?<=[.!?]) (?=[A-Z\u00c0-\u00de0-9])/, " "], [/; /, "; "], [/: /, ": "], [/, /, ", "]];
/** A whole number, with commas between its thousands, and decimals; no part of a name, a version or an address. */
const NUMBER = /(?<![\w.,])(\d{1,3}(?:,\d{3})+|\d+)(?:\.(\d+))?(?!\w|[.,]\w)/g;
const FEWEST_LETTERS = 6; // of a text that a sentence is looked for by: "at {time}" would find itself in everything
const MOST_KEPT = 500; // sentences whose translation is remembered

/** @type {Catalogue} */
export const ENGLISH = { locale: "en", texts: {} };

export class Speech {
  /** @param {Catalogue} catalogue */
  constructor({ locale, texts }) {
    this.locale = locale;
    this.texts = texts;
    this.rules = new Intl.PluralRules(locale);
    this.categories = CATEGORIES.filter((name) => this.rules.resolvedOptions().pluralCategories.some((one) => one === name));
    this.point = new Intl.NumberFormat(locale).formatToParts(0.5).find(({ type }) => type === "decimal")?.value ?? ".";
    this.whole = new Intl.NumberFormat(locale);
    this.date = new Intl.DateTimeFormat(locale, { year: "numeric", month: "2-digit", day: "2-digit", timeZone: "UTC" });
    const isTelling = (/** @type {string} */ text) => typeof texts[text] === "object" || lettersOf(text) >= FEWEST_LETTERS;
    const withPlaces = Object.keys(texts).filter((text) => text.includes("{") && isTelling(text)).sort(byFixedLetters);
    this.patterns = withPlaces.map((text) => ({ text, find: patternOf(text) }));
    /** @type {Map<string, string>} */
    this.kept = new Map();
  }

  get isEnglish() {
    return this.locale.startsWith("en");
  }

  /**
   * A text of the page, with values in its places; English where the catalogue does not have it.
   * @param {string} text
   * @param {Places} [values]
   */
  gettext(text, values = {}) {
    const said = this.texts[text];
    return filled(typeof said === "string" ? said : text, values);
  }

  /**
   * A text about some number of things, which stands in the place {count} too.
   * @param {string} one
   * @param {string} many
   * @param {number} count
   * @param {Places} [values]
   */
  ngettext(one, many, count, values = {}) {
    const forms = this.texts[one], category = this.rules.select(count);
    const known = typeof forms === "object" ? forms : [one, many];
    const at = typeof forms === "object" ? this.categories.indexOf(category) : Number(count !== 1);
    return filled(known[Math.min(Math.max(at, 0), known.length - 1)], { count, ...values });
  }

  /**
   * A sentence that the station made, in this language as far as the catalogue knows of what it was made.
   * @param {string} told
   * @returns {string}
   */
  translate(told) {
    if (this.isEnglish || !told) return told;
    const before = this.kept.get(told);
    if (before !== undefined) return before;
    if (this.kept.size >= MOST_KEPT) this.kept.clear();
    const said = this.wholeOf(told) ?? this.partsOf(told);
    this.kept.set(told, said);
    return said;
  }

  /**
   * @param {string} told
   * @returns {string | undefined}
   */
  wholeOf(told) {
    const said = this.texts[told];
    if (said !== undefined) return typeof said === "string" ? said : said[0];
    for (const { text, find } of this.patterns) {
      const found = find.exec(told)?.groups;
      if (found) return this.filledAnew(text, found);
    }
    return undefined;
  }

  /**
   * The translation of a text, with what was found in its places.
   * @param {string} text
   * @param {Record<string, string>} found
   */
  filledAnew(text, found) {
    const forms = this.texts[text];
    const values = Object.fromEntries(Object.entries(found).map(([name, value]) => [name, this.translate(value)]));
    const count = Number((found.count ?? "").replaceAll(",", ""));
    const form = typeof forms === "string" ? forms : forms[Math.min(this.categories.indexOf(this.rules.select(count)), forms.length - 1)];
    return filled(form, values);
  }

  /**
   * Whether a part of a sentence can stand in a translated one: half a sentence in another language is worse than none. Names can.
   * @param {string} part
   * @returns {boolean}
   */
  knows(part) {
    if (!part.trim().includes(" ") || this.wholeOf(part) !== undefined) return true;
    return BETWEEN.some(([between]) => {
      const parts = part.split(between);
      return parts.length > 1 && parts.every((one) => this.knows(one));
    });
  }

  /**
   * Several sentences, or what names a place or a file and then says what is wrong, each part by itself.
   * @param {string} told
   */
  partsOf(told) {
    for (const [between, sign] of BETWEEN) {
      const parts = told.split(between);
      const isName = (/** @type {string} */ part, /** @type {number} */ k) => sign === ": " && k === 0 && !(part in this.texts);
      if (parts.length < 2 || !parts.every((part, k) => isName(part, k) || this.knows(part))) continue;
      return parts.map((part, k) => (isName(part, k) ? part : this.translate(part))).join(sign); // a name stays as it was given
    }
    return this.figures(told);
  }

  /**
   * The numbers and dates of a written text as people of this language read them.
   * @param {string} written
   */
  figures(written) {
    const inWords = (/** @type {string} */ whole) => (whole.includes(",") ? this.whole.format(Number(whole.replaceAll(",", ""))) : whole);
    return this.dated(written).replace(NUMBER, (_, whole, decimals) => inWords(whole) + (decimals ? this.point + decimals : ""));
  }

  /**
   * Dates as people of this language read them; in English they stay in the order of ISO 8601, which nobody can take for another.
   * @param {string} written
   */
  dated(written) {
    if (this.isEnglish) return written;
    return written.replace(ISO_DATE, (_, year, month, day) => this.date.format(Date.UTC(Number(year), Number(month) - 1, Number(day))));
  }
}

/**
 * @param {string} text
 * @param {Places} values
 */
const filled = (text, values) => text.replace(PLACE, (place, name) => String(values[name] ?? place));

/** @param {string} text */
const lettersOf = (text) => text.replace(PLACE, "").match(/\p{L}/gu)?.length ?? 0;

/**
 * Texts that say more stand first: one that begins with a place would take the sentence of another.
 * @param {string} one
 * @param {string} other
 */
const byFixedLetters = (one, other) => other.replace(PLACE, "").length - one.replace(PLACE, "").length;

/**
 * What finds the sentences that were made of a text.
 * @param {string} text
 */
function patternOf(text) {
  const escaped = text.replace(/[.*+?^$()|[\]\\]/g, "\\$&");
  const seen = new Set();
  return new RegExp(`^${escaped.replace(PLACE, (_, name) => {
    if (seen.has(name)) return `\\k<${name}>`;
    seen.add(name);
    return `(?<${name}>.+?)`;
  })}$`, "s");
}
