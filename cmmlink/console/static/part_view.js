// The part view: choose a plan, see that it can be run, enter the part, test the device.

import { buttonOf, byId, inputOf, make, put } from "./dom.js";
import { showFault } from "./faults.js";
import { List } from "./list.js";
import { gettext, translate } from "./words.js";

const NAMED = ["Part", "Device"]; // facts whose value is a name

/** @import { ChosenPlan, Command, Device, StationState } from "./protocol.js" */
/** @import { Outcome } from "./link.js" */

const TEST_SIGNS = { none: "", testing: "\u2026 ", passed: "\u2713 ", failed: "\u2715 ", aborted: "\u2013 " };

export class PartView {
  /**
   * @param {(command: Command) => Promise<Outcome>} ask
   * @param {() => void} start
   */
  constructor(ask, start) {
    this.ask = ask;
    this.list = new List(byId("plans"), (name) => this.choose(name));
    this.shownChoice = this.shownTest = "";
    /** @type {StationState | null} */
    this.station = null;
    /** The plan whose serial number is to be entered next, once the station has told it. */
    this.entering = "";
    byId("entry").addEventListener("submit", (event) => {
      event.preventDefault();
      start();
    });
    for (const id of ["serial", "operator", "address"]) byId(id).addEventListener("change", () => this.enter());
    buttonOf("test").addEventListener("click", () => this.test());
    byId("address").addEventListener("focus", () => this.lookForDevices());
  }

  enter() {
    const [serial_number, operator, address] = ["serial", "operator", "address"].map((id) => inputOf(id).value);
    return this.ask({ do: "enter", serial_number, operator, address });
  }

  async test() {
    const answer = await this.enter();
    if (answer.ok) await this.ask({ do: "test" });
  }

  async lookForDevices() {
    const answer = await this.ask({ do: "devices" });
    if (!answer.ok) return;
    /** @type {Device[]} */
    const devices = JSON.parse(answer.message);
    byId("devices").replaceChildren(...devices.map(({ address, description }) => new Option(description, address)));
  }

  /** @param {string} name */
  async choose(name) {
    const answer = await this.ask({ do: "choose", plan: name });
    if (answer.ok) this.awaitEntry(name);
  }

  /** The serial number of a plan is entered next, once the station has told that the plan is chosen. @param {string} plan */
  awaitEntry(plan) {
    this.entering = plan;
    if (this.station) this.enterNext(this.station);
  }

  /** @param {StationState} station */
  show(station) {
    const { choice, running } = station, isEmpty = !station.plans.length && !station.ct_plans.length;
    this.station = station;
    byId("view-part").dataset.empty = String(isEmpty);
    byId("no-plans").hidden = !isEmpty;
    for (const id of ["open-new-plan", "first-plan"]) buttonOf(id).hidden = !station.can_make_plans;
    buttonOf("open-new-plan").disabled = running;
    buttonOf("run-demo").hidden = !station.can_run_demo;
    this.list.show(station.plans, choice?.name ?? "", Boolean(choice?.problem));
    this.showChoice(choice);
    this.showEntry("serial", station.serial_number, running);
    this.showEntry("operator", station.operator, running);
    this.showEntry("address", station.address, running);
    byId("address-label").hidden = !choice?.has_address;
    const { state, message } = station.test;
    byId("test-result").dataset.state = state;
    this.showTest(state === "none" ? "" : TEST_SIGNS[state], message);
    buttonOf("test").disabled = running;
    buttonOf("start-part").disabled = !station.can_start;
    this.enterNext(station);
  }

  /**
   * @param {string} sign
   * @param {string} message
   */
  showTest(sign, message) {
    if (this.shownTest === sign + message) return; // a fold that was opened stays open
    this.shownTest = sign + message;
    showFault(byId("test-result"), sign, message);
  }

  /**
   * Put into an input what the station says, once: what the operator types is not overwritten.
   * @param {string} id
   * @param {string} value
   * @param {boolean} isRunning
   */
  showEntry(id, value, isRunning) {
    const input = inputOf(id);
    input.disabled = isRunning;
    if (input.dataset.shown === value) return;
    if (input === document.activeElement && input.value !== (input.dataset.shown ?? "")) return; // it is being typed over
    input.value = input.dataset.shown = value;
    if (input === document.activeElement) input.select(); // so that typing replaces what was suggested
  }

  /**
   * The cursor goes to the serial number once what belongs to the plan stands there, so that nothing typed is overwritten.
   * @param {StationState} station
   */
  enterNext(station) {
    if (!this.entering || this.entering !== station.choice?.name || !station.can_start) return;
    this.entering = "";
    this.enterSerialNumber();
  }

  enterSerialNumber() {
    const input = inputOf("serial"), isTyped = input.value !== (input.dataset.shown ?? "");
    input.focus();
    if (!isTyped) input.select(); // so that typing replaces what was suggested, and nothing that was typed
  }

  /** @param {ChosenPlan | null} choice */
  showChoice(choice) {
    const shown = JSON.stringify(choice);
    if (shown === this.shownChoice) return;
    this.shownChoice = shown;
    const { state, words } = checkOf(choice);
    byId("check").dataset.state = state;
    put("check-word", words);
    const facts = choice?.facts ?? [];
    byId("check-facts").replaceChildren(...facts.flatMap(([name, value]) => [
      make("dt", translate(name)), make("dd", NAMED.includes(name) ? value : translate(value)),
    ]));
    this.showText(choice?.text ?? "", choice?.line ?? null);
  }

  /**
   * The text of the plan, its wrong line marked.
   * @param {string} text
   * @param {number | null} wrong
   */
  showText(text, wrong) {
    const lines = text ? text.replace(/\n$/, "").split("\n").map((line) => make("li", line)) : [];
    const line = wrong === null ? undefined : lines[wrong - 1];
    line?.classList.add("wrong");
    byId("plan-text").replaceChildren(...lines);
    line?.scrollIntoView({ block: "center" });
  }
}

/** @param {ChosenPlan | null} choice */
function checkOf(choice) {
  if (!choice) return { state: "none", words: gettext("No plan is chosen.") };
  if (choice.problem) return { state: "bad", words: gettext("\u2715 Cannot be run: {problem}", { problem: translate(choice.problem) }) };
  return { state: "good", words: gettext("\u2713 {name} can be run.", { name: choice.name }) };
}
