// The alarms: the most urgent one at the foot of the page, all of them in a list.

import { apart, byId, make, put, showSymbol, within } from "./dom.js";
import { faultParts, showFault } from "./faults.js";
import { count } from "./numbers.js";
import { dated, gettext, translate } from "./words.js";

/** @import { AlarmRow, RunState } from "./protocol.js" */

let shownAlarms = "";

/**
 * @param {readonly AlarmRow[]} alarms newest first
 * @param {RunState["kind"]} kind what the page shows: beside a replay or a recorded run, no alarm is that run's
 */
export function showAlarms(alarms, kind) {
  const open = alarms.filter((alarm) => !alarm.acknowledged || alarm.active);
  const first = open.find((alarm) => alarm.severity === "fault" && alarm.current) ?? open.find((alarm) => alarm.current) ?? open[0];
  const isEarlier = first && (!first.current || kind === "replay" || kind === "recorded");
  const owner = first && isEarlier ? `${whose(first)}: ` : "";
  const words = first ? owner + alarmWords(first) : "", more = open.length > 1 ? `  (+${open.length - 1})` : "";
  const line = byId("alarms");
  line.dataset.severity = isEarlier ? "earlier" : first?.severity ?? "none";
  line.dataset.acknowledged = String(Boolean(first?.acknowledged));
  showSymbol(within(line, "svg"), first ? "lamp-fault" : "lamp-off");
  put("alarm-text", words ? words + more : gettext("No alarm"));
  byId("alarm-text").title = first ? first.detail : "";
  byId("acknowledge").hidden = alarms.every((alarm) => alarm.acknowledged);
  byId("alarm-list-button").hidden = !alarms.length;
  const shown = JSON.stringify(alarms);
  if (shown === shownAlarms) return; // a fold that was opened stays open
  shownAlarms = shown;
  within(byId("alarm-list"), "ul").replaceChildren(...alarms.map(itemOf));
}

/** @param {AlarmRow} alarm */
function itemOf(alarm) {
  const marks = [alarm.active && gettext("still active"), alarm.acknowledged && gettext("acknowledged")].filter(Boolean);
  const item = make("li", "");
  showFault(item, [whose(alarm), ...marks, alarmTitle(alarm)].join("  \u00b7 "), alarm.detail);
  item.dataset.severity = alarm.current ? alarm.severity : "earlier";
  item.dataset.acknowledged = String(alarm.acknowledged && !alarm.active);
  return item;
}

/**
 * Which run an alarm belongs to, and when it was raised.
 * @param {AlarmRow} alarm
 */
export function whose({ run, since, current }) {
  return [current ? "" : gettext("earlier run"), apart(run), dated(since)].filter(Boolean).join(" ");
}

/** @param {AlarmRow} alarm */
export function alarmWords({ what, count: times, detail }) {
  return alarmTitle({ what, count: times }) + translate(faultParts(detail).words);
}

/** @param {Pick<AlarmRow, "what" | "count">} alarm */
const alarmTitle = ({ what, count: times }) => `${translate(what)}${times > 1 ? ` (${count(times)})` : ""}: `;

export function toggleAlarmList() {
  const list = byId("alarm-list");
  list.hidden = !list.hidden;
  byId("alarm-list-button").setAttribute("aria-expanded", String(!list.hidden));
}
