// What the reader chooses of the page itself: its language and its colours. Paper is always light.

import { buttonOf, elementOf, selectOf } from "./dom.js";
import { LANGUAGES } from "./languages.js";
import { readInk } from "./sheet.js";
import { chooseLanguage, chosenLanguage } from "./words.js";

const KEY = "cmmlink-theme";
/** Which screens get the dark colours, by what was chosen. @type {Readonly<Record<string, string>>} */
const SCREENS = { "": "screen and (prefers-color-scheme: dark)", light: "not all", dark: "screen" };

/** Let the reader choose, and show what was chosen before. */
export function listenToDisplay() {
  const language = selectOf("language"), theme = selectOf("theme"), system = matchMedia("(prefers-color-scheme: dark)");
  language.append(...LANGUAGES.map((tag) => new Option(new Intl.DisplayNames([tag], { type: "language" }).of(tag), tag)));
  language.value = chosenLanguage();
  language.addEventListener("change", () => {
    chooseLanguage(language.value);
    location.assign(location.pathname); // without the language of the address
  });
  theme.value = kept();
  theme.addEventListener("change", () => {
    keep(theme.value);
    paintIn(theme.value);
  });
  system.addEventListener("change", () => paintIn(theme.value));
  window.addEventListener("beforeprint", () => paintIn("light"));
  window.addEventListener("afterprint", () => paintIn(theme.value));
  buttonOf("print").addEventListener("click", () => window.print());
  document.addEventListener("click", closeMenu);
  paintIn(theme.value);
}

/** The menu closes when something else is pressed, or its wall view. @param {MouseEvent} event */
function closeMenu({ target }) {
  const menu = elementOf("display", HTMLDetailsElement);
  if (!(target instanceof Element) || !menu.contains(target) || target.matches("a")) menu.open = false;
}

/** @param {string} theme light, dark or, empty, that of the system */
function paintIn(theme) {
  elementOf("dark", HTMLLinkElement).media = SCREENS[theme] ?? SCREENS[""];
  readInk();
}

function kept() {
  try {
    return localStorage.getItem(KEY) ?? "";
  } catch {
    return "";
  }
}

/** @param {string} theme */
function keep(theme) {
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // it lasts until the page is closed
  }
}
