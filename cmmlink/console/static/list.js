// A list of names, one of them chosen: arrows point, Enter or a click chooses.

export class List {
  constructor(element, choose) {
    Object.assign(this, { element, choose, names: [], at: 0 });
    element.addEventListener("keydown", (event) => this.key(event));
  }

  get pointed() {
    return this.names[this.at];
  }

  key(event) {
    const to = { ArrowDown: this.at + 1, ArrowUp: this.at - 1, Home: 0, End: this.names.length - 1 }[event.key];
    if (to !== undefined) {
      event.preventDefault();
      this.point(Math.min(Math.max(to, 0), this.names.length - 1));
    } else if ((event.key === "Enter" || event.key === " ") && this.pointed) {
      event.preventDefault();
      this.choose(this.pointed);
    }
  }

  point(at) {
    this.at = at;
    [...this.element.children].forEach((item, k) => item.classList.toggle("pointed", k === at));
    this.element.children[at]?.scrollIntoView({ block: "nearest" });
  }

  show(names, chosen, bad) {
    const told = JSON.stringify([names, chosen, bad]);
    if (told === this.told) return;
    this.told = told;
    this.names = names;
    this.element.replaceChildren(...names.map((name) => this.item(name, name === chosen, bad)));
    this.point(Math.max(0, names.indexOf(chosen)));
  }

  item(name, chosen, bad) {
    const item = document.createElement("div");
    item.setAttribute("role", "option");
    item.setAttribute("aria-selected", String(chosen));
    item.dataset.bad = String(chosen && Boolean(bad));
    item.textContent = name;
    item.addEventListener("click", () => {
      this.point(this.names.indexOf(name));
      this.choose(name);
    });
    return item;
  }
}
