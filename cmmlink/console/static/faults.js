// What went wrong with a device, in an operator's words: the cause first, and what the system said of it in a fold.

import { make } from "./dom.js";
import { gettext, translate } from "./words.js";

const OF_SYSTEM = /^(.*?(?:cannot be opened|the link was lost|cannot be read|no Modbus device opens there)): (.+?)(; [^;]+)?$/s;

/**
 * The words of a fault without what the system said, and what it said; that is empty where the fault is in our own words.
 * @param {string} told
 */
export function faultParts(told) {
  const [, cause, said, hint = ""] = OF_SYSTEM.exec(told) ?? [];
  if (!cause || !/errno|error|exception|WinError|[[({]/i.test(said)) return { words: told, said: "" };
  return { words: cause + hint, said };
}

/**
 * Show a fault in an element, after a sign: its cause, and a fold with the details where there are some.
 * @param {Element} element
 * @param {string} sign
 * @param {string} told
 */
export function showFault(element, sign, told) {
  const { words, said } = faultParts(told);
  element.replaceChildren(`${sign}${translate(words)}`);
  if (!said) return;
  const details = make("details", "");
  details.append(make("summary", gettext("Details")), make("span", said));
  element.append(" ", details);
}
