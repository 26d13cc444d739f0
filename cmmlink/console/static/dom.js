// Elements of the page, and words put into them only where they changed.

const RIGHT_TO_LEFT = /[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufefc]/;

/**
 * A name among other words. One that is read from right to left is set apart, so that it does not turn round what stands beside it.
 * @param {string} name
 */
export const apart = (name) => (RIGHT_TO_LEFT.test(name) ? `\u2068${name}\u2069` : name);

/** @param {string} id */
export const byId = (id) => elementOf(id, HTMLElement);

/** @param {string} id */
export const buttonOf = (id) => elementOf(id, HTMLButtonElement);

/** @param {string} id */
export const inputOf = (id) => elementOf(id, HTMLInputElement);

/** @param {string} id */
export const selectOf = (id) => elementOf(id, HTMLSelectElement);

/**
 * @template {HTMLElement} Kind
 * @param {string} id
 * @param {new () => Kind} kind
 * @returns {Kind}
 */
export function elementOf(id, kind) {
  const element = document.getElementById(id);
  if (!(element instanceof kind)) throw new Error(`the page has no ${kind.name} with the id ${id}`);
  return element;
}

/**
 * All elements that a selector names.
 * @param {string} selector
 * @returns {NodeListOf<HTMLElement>}
 */
export const elementsOf = (selector) => document.querySelectorAll(selector);

/**
 * The first part of an element that a selector names.
 * @param {Element} element
 * @param {string} selector
 */
export function within(element, selector) {
  const part = element.querySelector(selector);
  if (!part) throw new Error(`nothing in the element is called ${selector}`);
  return part;
}

/**
 * @param {string} id
 * @param {string} words
 */
export function put(id, words) {
  putInto(byId(id), words);
}

/**
 * @param {Element} element
 * @param {string} words
 */
export function putInto(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

/**
 * Have an element show one of the page's symbols.
 * @param {Element} element
 * @param {string} symbol
 */
export function showSymbol(element, symbol) {
  const link = within(element, "use");
  if (link.getAttribute("href") !== `#${symbol}`) link.setAttribute("href", `#${symbol}`);
}

/**
 * How much of a bar is filled, from 0 to 1.
 * @param {string} id
 * @param {number} share
 */
export function fillBar(id, share) {
  styleOf(within(byId(id), "span")).width = `${100 * share}%`;
}

/** @param {Element} element */
export const styleOf = (element) => /** @type {HTMLElement} */ (element).style;

/**
 * A new element with words in it.
 * @param {string} tag
 * @param {string} words
 */
export function make(tag, words) {
  const element = document.createElement(tag);
  element.textContent = words;
  return element;
}
