// The part view: choose a plan, see that it can be run, enter the part, test the device.

import { List } from "./list.js";
import { byId, put } from "./panels.js";

export class Work {
  // ask(what, more) sends a command and gives a promise of its answer.
  constructor(ask, onStart) {
    this.ask = ask;
    this.list = new List(byId("plans"), (name) => this.choose(name));
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

  async choose(name) {
    const answer = await this.ask("choose", { plan: name });
    if (answer.ok) this.entering = name;
  }

  show(station) {
    byId("no-plans").hidden = station.plans.length > 0;
    this.list.show(station.plans, station.choice?.name, station.choice?.problem);
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
    this.enterNext(station);
  }

  // The cursor goes to the serial number once what belongs to the plan stands there, so that nothing typed is overwritten.
  enterNext(station) {
    if (!this.entering || this.entering !== station.choice?.name || !station.can_start) return;
    this.entering = null;
    byId("serial").focus();
    byId("serial").select();
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
