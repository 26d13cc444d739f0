// A new plan: hand in the nominal, see what was understood of it, answer six questions, save. What is wrong stands beside its field.

import { buttonOf, byId, inputOf, make, put, selectOf } from "./dom.js";
import { drawNominal } from "./nominal_picture.js";
import { fixed } from "./numbers.js";
import { LARGEST_NOMINAL } from "./protocol.js";
import { gettext, translate } from "./words.js";

/** @import { FormMistake, PlanSaved, Understood } from "./protocol.js" */
/** @import { Posted } from "./link.js" */
/** @typedef {(path: string, answers: Record<string, string>, content: Blob) => Promise<Posted>} Post */

const PLANNED = ["part", "tolerance", "source", "radius", "results", "name"];
const OF_NOMINAL = ["unit", "curve", "ends", "side"]; // asked for where the file leaves them open, the unit always
const SUGGESTED = /** @type {const} */ (["part", "name"]);

export class NewPlan {
  /**
   * @param {Post} post
   * @param {(saved: PlanSaved) => void} onSaved
   */
  constructor(post, onSaved) {
    this.post = post;
    this.onSaved = onSaved;
    /** @type {File | null} */
    this.file = null;
    /** What this file left open at any time: its field stays, so that an answer can be changed. @type {Set<Understood["asks"][number]>} */
    this.asked = new Set();
    this.reads = 0; // how often the station was asked what it understands: an older answer is void
    this.listen();
  }

  listen() {
    buttonOf("open-new-plan").addEventListener("click", () => this.open());
    buttonOf("first-plan").addEventListener("click", () => this.open());
    buttonOf("leave-new-plan").addEventListener("click", () => this.dialog.close());
    inputOf("nominal-file").addEventListener("change", () => this.take(inputOf("nominal-file").files));
    for (const name of ["unit", "curve", "ends"]) byId(`plan-${name}`).addEventListener("change", () => this.read());
    byId("new-plan-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.save();
    });
    for (const place of [this.dialog, byId("plans-card")]) this.listenToDrops(place);
  }

  /** @param {HTMLElement} place */
  listenToDrops(place) {
    const turn = (/** @type {DragEvent} */ event, /** @type {boolean} */ isOver) => {
      event.preventDefault();
      place.toggleAttribute("data-over", isOver);
    };
    place.addEventListener("dragover", (event) => turn(event, true));
    place.addEventListener("dragleave", (event) => turn(event, false));
    place.addEventListener("drop", (event) => {
      turn(event, false);
      if (buttonOf("open-new-plan").hidden || !event.dataTransfer?.files.length) return;
      this.open();
      this.take(event.dataTransfer.files);
    });
  }

  get dialog() {
    const dialog = byId("new-plan");
    if (!(dialog instanceof HTMLDialogElement)) throw new Error("the new plan is no dialog");
    return dialog;
  }

  open() {
    if (!this.dialog.open) this.dialog.showModal();
  }

  /** @param {FileList | null} files */
  take(files) {
    const file = files?.item(0);
    if (!file) return;
    this.file = file;
    this.asked.clear();
    for (const name of OF_NOMINAL) fieldOf(name).value = "";
    for (const name of SUGGESTED) if (fieldOf(name).value === fieldOf(name).dataset.offered) fieldOf(name).value = "";
    put("nominal-name", file.name);
    return this.read();
  }

  /** The answers as the station takes them. @returns {Record<string, string>} */
  answers() {
    const named = [...PLANNED, ...OF_NOMINAL].map((name) => [name, fieldOf(name).value]);
    return { nominal: this.file?.name ?? "", ...Object.fromEntries(named) };
  }

  /** Ask what the station understands of the nominal with the answers that there are. */
  async read() {
    if (!this.file) return;
    if (this.file.size > LARGEST_NOMINAL) return this.showProblem(gettext("The file is too large."));
    const number = ++this.reads, posted = await this.post("/nominal", this.answers(), this.file);
    if (number !== this.reads) return;
    if (posted.ok) this.show(/** @type {Understood} */ (posted.given));
    else this.showProblem(translate(posted.message));
  }

  /** @param {string} problem */
  showProblem(problem) {
    byId("nominal-read").hidden = true;
    showMistakes([{ field: "nominal", words: problem }]);
  }

  /** @param {Understood} understood */
  show(understood) {
    if (understood.problem) return this.showProblem(translate(understood.problem));
    byId("nominal-read").hidden = false;
    showMistakes(understood.mistakes);
    for (const question of understood.asks) this.asked.add(question);
    drawNominal(understood);
    put("nominal-words", wordsOf(understood));
    byId("nominal-notes").replaceChildren(...understood.notes.map((note) => make("li", translate(note))));
    put("label-unit", this.asked.has("chord") ? gettext("How long is the chord, in mm?") : gettext("Unit of the file"));
    inputOf("plan-unit").required = this.asked.has("chord") || this.asked.has("unit");
    byId("field-curve").hidden = !understood.curves.length;
    for (const name of /** @type {const} */ (["ends", "side"])) byId(`field-${name}`).hidden = !this.asked.has(name);
    this.showCurves(understood.curves);
    for (const name of SUGGESTED) suggest(name, understood[name]);
    byId("plan-files").replaceChildren(...understood.files.map((name) => new Option(name, name)));
  }

  /** @param {Understood["curves"]} curves */
  showCurves(curves) {
    const select = selectOf("plan-curve"), chosen = select.value;
    const options = curves.map(([number, words]) => new Option(`${number}: ${translate(words)}`, String(number)));
    select.replaceChildren(new Option(gettext("choose"), ""), ...options);
    select.value = chosen;
  }

  async save() {
    if (!this.file) return showMistakes([{ field: "nominal", words: gettext("Drop the nominal file here, or choose it.") }]);
    const replace = inputOf("replace-plan").checked ? "yes" : "";
    const posted = await this.post("/plan", { ...this.answers(), replace }, this.file);
    if (!posted.ok) return showMistakes([{ field: "name", words: translate(posted.message) }]);
    const saved = /** @type {PlanSaved} */ (posted.given);
    byId("replace-label").hidden = !saved.taken || Boolean(saved.name);
    if (!saved.taken || saved.name) inputOf("replace-plan").checked = false;
    showMistakes(saved.mistakes);
    if (!saved.name) return;
    this.dialog.close();
    this.onSaved(saved);
  }
}

/**
 * The field of an answer.
 * @param {string} name
 * @returns {HTMLInputElement | HTMLSelectElement}
 */
const fieldOf = (name) => (["curve", "ends", "side"].includes(name) ? selectOf(`plan-${name}`) : inputOf(`plan-${name}`));

/**
 * Offer an answer where none was typed.
 * @param {(typeof SUGGESTED)[number]} name
 * @param {string} offered
 */
function suggest(name, offered) {
  const field = fieldOf(name);
  if (field.value && field.value !== field.dataset.offered) return;
  field.value = field.dataset.offered = offered;
}

/**
 * Put what is wrong beside its field, and go to the first of them.
 * @param {readonly FormMistake[]} mistakes
 */
function showMistakes(mistakes) {
  for (const name of [...PLANNED, ...OF_NOMINAL, "nominal"]) {
    const wrong = mistakes.filter(({ field }) => field === name), field = name === "nominal" ? inputOf("nominal-file") : fieldOf(name);
    put(`mistake-${name}`, wrong.map(({ words }) => `\u2715 ${translate(words)}`).join("\n"));
    field.setAttribute("aria-invalid", String(wrong.length > 0));
    if (wrong.length) byId(`field-${name}`).hidden = false;
  }
  const first = byId("new-plan").querySelector("[aria-invalid=true]");
  if (first instanceof HTMLElement) first.focus();
}

/**
 * What was understood of a nominal, for whoever compares it with the drawing.
 * @param {Understood} understood
 */
export function wordsOf({ closed, turns_left, length_mm, size_mm, points_mm, unit_known, asks, source_format }) {
  const [width, height] = size_mm.map((size) => fixed(size, 3)), [x, y] = points_mm[0].map((value) => fixed(value, 3));
  const values = { length: fixed(length_mm, 3), width, height };
  const size = unit_known
    ? gettext("{length} mm long, {width} x {height} mm", values)
    : gettext("{length} units of the file long, {width} x {height} units", values);
  const turn = turns_left ? gettext("runs counter-clockwise") : gettext("runs clockwise");
  const ends = closed ? gettext("closed") : gettext("open");
  const start = gettext("starts at ({x}, {y})", { x, y });
  return [source_format, ends, size, start, asks.includes("side") ? "" : turn].filter(Boolean).join(", ");
}

/** Whether a dialog is in front, which alone hears the keys. */
export const isDialogOpen = () => document.querySelector("dialog[open]") !== null;
