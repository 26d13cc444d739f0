// The alarms: the most urgent one at the foot of the page, all of them in a list.

import { byId, make, put, showSymbol, within } from "./dom.js";
import { count } from "./numbers.js";

/** @import { AlarmRow } from "./protocol.js" */

/** @param {readonly AlarmRow[]} alarms newest first */
export function showAlarms(alarms) {
  const open = alarms.filter((alarm) => !alarm.acknowledged || alarm.active);
  const first = open.find((alarm) => alarm.severity === "fault") ?? open[0];
  const words = first ? alarmWords(first) : "", more = open.length > 1 ? `  (+${open.length - 1})` : "";
  const line = byId("alarms");
  line.dataset.severity = first?.severity ?? "none";
  line.dataset.acknowledged = String(Boolean(first?.acknowledged));
  showSymbol(within(line, "svg"), first ? "lamp-fault" : "lamp-off");
  put("alarm-text", words ? words + more : "No alarm");
  byId("alarm-text").title = words;
  byId("acknowledge").hidden = alarms.every((alarm) => alarm.acknowledged);
  byId("alarm-list-button").hidden = !alarms.length;
  within(byId("alarm-list"), "ul").replaceChildren(...alarms.map(itemOf));
}

/** @param {AlarmRow} alarm */
function itemOf(alarm) {
  const marks = [alarm.active ? "still active" : "", alarm.acknowledged ? "acknowledged" : ""].filter(Boolean);
  const item = make("li", [`${alarm.since}  ${alarmWords(alarm)}`, ...marks].join("  \u00b7 "));
  item.dataset.severity = alarm.severity;
  item.dataset.acknowledged = String(alarm.acknowledged && !alarm.active);
  return item;
}

/** @param {AlarmRow} alarm */
export function alarmWords({ what, count: times, detail }) {
  return `${what}${times > 1 ? ` (${count(times)})` : ""}: ${detail}`;
}

export function toggleAlarmList() {
  const list = byId("alarm-list");
  list.hidden = !list.hidden;
  byId("alarm-list-button").setAttribute("aria-expanded", String(!list.hidden));
}
