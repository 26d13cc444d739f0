// Asks once before what is on is aborted; it goes on meanwhile, and also where nobody answers.

import { buttonOf, byId } from "./dom.js";

const LASTS_MS = 8000;
const NO_ANSWER = ["Shift", "Control", "Alt", "Meta", "Tab"];

export class Question {
  /** @param {() => void} abort */
  constructor(abort) {
    this.abort = abort;
    this.timer = 0;
    buttonOf("abort-now").addEventListener("click", () => this.answer(true));
    buttonOf("go-on").addEventListener("click", () => this.answer(false));
    document.addEventListener("keydown", (event) => this.take(event), true); // before a form or a table takes the key for itself
  }

  get isAsked() {
    return !byId("question").hidden;
  }

  ask() {
    byId("question").hidden = false;
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.answer(false), LASTS_MS);
  }

  /** @param {boolean} isYes */
  answer(isYes) {
    clearTimeout(this.timer);
    byId("question").hidden = true;
    if (isYes) this.abort();
  }

  /** @param {KeyboardEvent} event */
  take(event) {
    if (!this.isAsked || NO_ANSWER.includes(event.key)) return;
    const onButton = event.target instanceof Element && event.target.closest("#question");
    if (onButton && event.key !== "Escape") return; // the button that is in focus is pressed
    const isYes = event.key === "Escape" || event.key === "Enter";
    if (isYes) {
      event.preventDefault();
      event.stopPropagation();
    }
    if (!event.repeat) this.answer(isYes); // who holds the key down has pressed it once
  }
}
