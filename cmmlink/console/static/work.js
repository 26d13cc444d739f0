// The part view: choose a plan, see that it can be run, enter the part, test the device.

import { byId, put } from "./panels.js";

export class Work {
  // ask(what, more) sends a command and gives a promise of its answer.
  constructor(ask, onStart) {
    this.ask = ask;
    this.plans = [];
    this.at = 0;
    byId("plans").addEventListener("keydown", (event) => this.key(event));
    byId("entry").addEventListener("submit", (event) => {
      event.preventDefault();
      onStart();
    });
    for (const id of ["serial", "operator", "address"]) byId(id).addEventListener("change", () => this.enter());
    byId("test").addEventListener("click", () => this.test());
    byId("address").addEventListener("focus", () => this.lookForDevices());
  }

  async enter() {
    return this.ask("enter", { serial_number: byId("serial").value, operator: byId("operator").value, address: byId("address").value });
  }

  async test() {
    await this.enter();
    await this.ask("test");
  }

  async lookForDevices() {
    const answer = await this.ask("devices", {}, true);
    if (!answer.ok) return;
    byId("devices").replaceChildren(...JSON.parse(answer.message).map(({ address, description }) => new Option(description, address)));
  }

  key(event) {
    const to = { ArrowDown: this.at + 1, ArrowUp: this.at - 1, Home: 0, End: this.plans.length - 1 }[event.key];
    if (to !== undefined) {
      event.preventDefault();
      this.point(Math.min(Math.max(to, 0), this.plans.length - 1));
    } else if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      this.choose(this.plans[this.at]);
    }
  }

  point(at) {
    this.at = at;
    [...byId("plans").children].forEach((item, k) => item.classList.toggle("pointed", k === at));
    byId("plans").children[at]?.scrollIntoView({ block: "nearest" });
  }

  async choose(name) {
    if (!name) return;
    const answer = await this.ask("choose", { plan: name });
    if (answer.ok) byId("serial").focus();
    byId("serial").select();
  }

  show(station) {
    this.showPlans(station);
    this.showCheck(station.choice);
    for (const [id, value] of [["serial", station.serial_number], ["operator", station.operator], ["address", station.address]]) {
      const input = byId(id);
      if (input.dataset.told !== value) {
        input.value = input.dataset.told = value;
        if (input === document.activeElement) input.select(); // so that typing replaces what was suggested
      }
      input.disabled = station.running;
    }
    byId("address-label").hidden = !station.choice?.has_address;
    const { state, message } = station.test;
    byId("test-result").dataset.state = state;
    put("test-result", state === "none" ? "" : { testing: "\u2026 ", passed: "\u2713 ", failed: "\u2715 " }[state] + message);
    byId("test").disabled = station.running;
    byId("start-part").disabled = !station.can_start;
  }

  showPlans(station) {
    const { plans, choice } = station, told = JSON.stringify([plans, choice?.name, choice?.problem]);
    if (told === this.told) return;
    this.told = told;
    this.plans = plans;
    byId("no-plans").hidden = plans.length > 0;
    byId("plans").replaceChildren(...plans.map((name) => {
      const item = document.createElement("div");
      item.setAttribute("role", "option");
      item.setAttribute("aria-selected", String(name === choice?.name));
      item.dataset.bad = String(name === choice?.name && Boolean(choice.problem));
      item.textContent = name;
      item.addEventListener("click", () => this.choose(name));
      return item;
    }));
    this.point(Math.max(0, plans.indexOf(choice?.name)));
  }

  showCheck(choice) {
    const told = JSON.stringify(choice);
    if (told === this.toldCheck) return;
    this.toldCheck = told;
    const card = byId("check");
    card.dataset.state = !choice ? "none" : choice.problem ? "bad" : "good";
    put("check-word", !choice ? "No plan is chosen." : choice.problem ? `\u2715 Cannot be run: ${choice.problem}` : `\u2713 ${choice.name} can be run.`);
    byId("check-facts").replaceChildren(...(choice?.facts ?? []).flatMap(([name, value]) => [make("dt", name), make("dd", value)]));
    const lines = (choice?.text ?? "").replace(/\n$/, "").split("\n").map((text) => make("li", text));
    const wrong = choice?.line ? lines[choice.line - 1] : null;
    wrong?.classList.add("wrong");
    byId("plan-text").replaceChildren(...(choice ? lines : []));
    wrong?.scrollIntoView({ block: "center" });
  }
}

function make(tag, words) {
  const element = document.createElement(tag);
  element.textContent = words;
  return element;
}
