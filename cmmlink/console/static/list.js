// A list of names, one of them chosen: arrows point, Enter or a click chooses.

export class List {
  /**
   * @param {HTMLElement} element
   * @param {(name: string) => void} choose
   */
  constructor(element, choose) {
    this.element = element;
    this.choose = choose;
    /** @type {readonly string[]} */
    this.names = [];
    this.at = 0;
    this.shown = "";
    element.addEventListener("keydown", (event) => this.act(event));
  }

  /** @returns {string | undefined} */
  get pointed() {
    return this.names[this.at];
  }

  choosePointed() {
    if (this.pointed !== undefined) this.choose(this.pointed);
  }

  /** @param {KeyboardEvent} event */
  act(event) {
    const last = this.names.length - 1;
    const targets = new Map([["ArrowDown", this.at + 1], ["ArrowUp", this.at - 1], ["Home", 0], ["End", last]]);
    const target = targets.get(event.key);
    if (target === undefined && event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    if (target === undefined) this.choosePointed();
    else this.point(Math.min(Math.max(target, 0), last));
  }

  /** @param {number} at */
  point(at) {
    this.at = at;
    [...this.element.children].forEach((item, k) => item.classList.toggle("pointed", k === at));
    this.element.children[at]?.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {readonly string[]} names
   * @param {string} chosen
   * @param {boolean} isBad whether the chosen one cannot be used
   */
  show(names, chosen, isBad) {
    const shown = JSON.stringify([names, chosen, isBad]);
    if (shown === this.shown) return;
    this.shown = shown;
    this.names = names;
    this.element.replaceChildren(...names.map((name) => this.item(name, name === chosen, isBad)));
    this.point(Math.max(0, names.indexOf(chosen)));
  }

  /**
   * @param {string} name
   * @param {boolean} isChosen
   * @param {boolean} isBad
   */
  item(name, isChosen, isBad) {
    const item = document.createElement("div");
    item.setAttribute("role", "option");
    item.setAttribute("aria-selected", String(isChosen));
    item.dataset.bad = String(isChosen && isBad);
    item.textContent = name;
    item.addEventListener("click", () => {
      this.point(this.names.indexOf(name));
      this.choose(name);
    });
    return item;
  }
}
