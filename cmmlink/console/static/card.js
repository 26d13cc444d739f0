// The card at the right of the page: whose verdict it is, the verdict, and what it rests on.

import { apart } from "./dom.js";
import { classOf, toleranceUse } from "./points.js";
import { CODE_OF } from "./verdicts.js";
import { dated, gettext, translate } from "./words.js";

/** @import { Control, RunRow, RunState, SectionRow, StationState, SurfaceState } from "./protocol.js" */
/** @import { LinkState } from "./link.js" */
/** @import { PointClass } from "./points.js" */
/** @typedef {{ lower_mm: number, upper_mm: number }} Zone */
/** @typedef {readonly [x: number, y: number, z?: number]} Place z only of a surface */
/** @typedef {{ deviation: number, station: number, place: Place | null, kind: PointClass, zone: Zone }} Worst */
/**
 * What stands at the right of the page.
 * @typedef {object} Card
 * @property {string} part
 * @property {string} serial
 * @property {(string | undefined)[]} names plan, operator, run
 * @property {string} word
 * @property {RunState["verdict"]["shape"]} shape
 * @property {boolean} final
 * @property {string} of which characteristics gave the verdict
 * @property {string} why
 * @property {readonly string[]} reasons every further one
 * @property {readonly string[]} notes
 * @property {readonly string[]} judged every judgement of a recorded run that was made later
 * @property {string} phase
 * @property {string} badge
 * @property {string} before
 * @property {Worst | null} worst
 * @property {boolean} simulated
 * @property {RunState | null} run where the card is that of a run, its numbers
 * @property {string} record the id under which the records keep the run; empty where there is none to have a report of
 */
/**
 * What the station says, as far as it was heard.
 * @typedef {object} Heard
 * @property {RunState | null} run the run that is shown
 * @property {boolean} isRecorded whether that run comes from the records
 * @property {StationState | null} station
 * @property {Control | null} control
 * @property {string} view what the page shows: live, part, history or ct
 * @property {RunRow | null} chosen the run chosen in the history
 * @property {SurfaceState | null} surface
 * @property {boolean} hasFault
 * @property {boolean} hasBand whether U is known along the profile
 * @property {boolean} isRemote whether the station is open to the network, unencrypted
 * @property {LinkState} link
 */

/** @type {Card} */
const NO_CARD = {
  part: "", serial: "", names: [], word: "", shape: "none", final: false, of: "", why: "", reasons: [], notes: [], judged: [], phase: "",
  badge: "", before: "", worst: null, simulated: false, run: null, record: "",
};
const PHASES = {
  preparing: gettext("preparing"), starting: gettext("connecting"), measuring: gettext("so far"), ending: gettext("ending"), finished: "",
};
/** @type {Readonly<Record<RunState["kind"], (began: string) => string>>} */
const BADGES = {
  run: () => "", section: () => gettext("SECTION"), replay: (began) => gettext("REPLAY of {began}", { began }),
  recorded: (began) => gettext("RECORDED {began}", { began }),
};

/**
 * What stands at the right: it always belongs to what the view shows, and a run that is on stands there whatever is looked at.
 * @param {Heard} heard
 * @returns {Card}
 */
export function cardOf({ run, isRecorded, station, view, chosen, surface }) {
  const isOn = run !== null && run.phase !== "finished" && !isRecorded;
  if (!isOn && view === "part") return cardOfNextPart(run, station);
  if (!isOn && view === "history" && chosen) return cardOfRow(chosen);
  if (!isOn && view === "ct" && surface) return cardOfSurface(surface);
  const judged = isRecorded && chosen && chosen.run === run?.run ? chosen.judged : [];
  return run ? cardOfRun(run, judged) : cardOfNextPart(null, station);
}

/**
 * @param {RunState} run
 * @param {readonly string[]} judged
 * @returns {Card}
 */
function cardOfRun(run, judged) {
  const { part, serial_number: serial, plan, operator, began, notes, simulated, zone } = run;
  const { word, shape, final, of, why, reasons } = run.verdict;
  const badge = BADGES[run.kind](dated(began));
  const worst = run.worst && {
    deviation: run.worst.deviation_mm, station: run.worst.station_mm, place: placeOf(run.worst.x_mm, run.worst.y_mm, run.worst.z_mm), zone,
    kind: classOf(run.worst.deviation_mm, CODE_OF[run.worst.verdict], zone),
  };
  return {
    part, serial, names: [plan, operator], word, shape, final, of, why, reasons, notes, judged, phase: final ? "" : PHASES[run.phase],
    badge, before: "", worst, simulated, run, record: run.run,
  };
}

/**
 * While the next part is prepared, the verdict on the last one is a line with its own serial number and time.
 * @param {RunState | null} run
 * @param {StationState | null} station
 * @returns {Card}
 */
function cardOfNextPart(run, station) {
  const choice = station?.choice;
  const last = run && [apart(run.serial_number || run.part), translate(run.verdict.word), dated(run.began)].filter(Boolean);
  return {
    ...NO_CARD, ...readiness(station), part: choice?.part ?? "", serial: station?.serial_number ?? "",
    names: [choice?.name, station?.operator], before: last ? gettext("Before: {run}", { run: last.join("  \u00b7  ") }) : "",
  };
}

/**
 * @param {RunRow} row
 * @returns {Card}
 */
function cardOfRow(row) {
  const { part, serial_number: serial, section, word, shape, counted, began, run, simulated, state, judged } = row;
  return {
    ...NO_CARD, part, serial, names: [translate(section), run], word, shape, final: counted,
    why: gettext("as recorded; O opens the run"), badge: BADGES.recorded(dated(began)), worst: worstOf(row), simulated, judged,
    record: state === "running" || state === "damaged" ? "" : run,
  };
}

/**
 * @param {SurfaceState} surface
 * @returns {Card}
 */
function cardOfSurface({ plan, word, shape, state, message, notes, done, total, sections }) {
  const progress = total ? gettext("{done} of {total} sections", { done, total }) : gettext("choose a CT plan");
  const why = state === "done" || state === "failed" ? message : progress;
  const worst = sections.map(worstOf).reduce((one, other) => (useOf(other) > useOf(one) ? other : one), null);
  return {
    ...NO_CARD, part: plan || gettext("No surface"), names: [gettext("CT surface")], word: word || gettext("NO SURFACE"), shape,
    final: state === "done", why, notes, worst,
  };
}

/** @param {Worst | null} worst */
const useOf = (worst) => (worst ? toleranceUse(worst.deviation, worst.zone) : -1);

/**
 * The worst point of a run or a section as a table holds it; outside the zone it is out only where the verdict says so.
 * @param {Pick<RunRow | SectionRow, "worst_mm" | "worst_station_mm" | "lower_mm" | "upper_mm" | "verdict">
 *   & Partial<Pick<RunRow, "worst_x_mm" | "worst_y_mm" | "worst_z_mm">>} row
 * @returns {Worst | null}
 */
function worstOf(row) {
  const { worst_mm: deviation, worst_station_mm: station, worst_x_mm: x, worst_y_mm: y, worst_z_mm: z, lower_mm, upper_mm, verdict } = row;
  if (deviation === null || lower_mm === null || upper_mm === null || (station === null && typeof z !== "number")) return null;
  const zone = { lower_mm, upper_mm }, isOutside = deviation < lower_mm || deviation > upper_mm;
  const code = CODE_OF[verdict === "nonconform" ? "nonconform" : "uncertain"];
  const kind = classOf(deviation, isOutside ? code : CODE_OF.conform, zone);
  return { deviation, station: station ?? 0, place: placeOf(x, y, z), zone, kind };
}

/**
 * A place in the coordinates of the nominal, where it is known.
 * @param {number | null | undefined} x
 * @param {number | null | undefined} y
 * @param {number | null | undefined} z
 * @returns {Worst["place"]}
 */
function placeOf(x, y, z = null) {
  if (typeof x !== "number" || typeof y !== "number") return null;
  return typeof z === "number" ? [x, y, z] : [x, y];
}

/**
 * What stands in the verdict's place before a run.
 * @param {StationState | null} station
 */
export function readiness(station) {
  if (station?.can_start) return { word: gettext("READY"), why: gettext("start when the part is in place") };
  const name = station?.choice?.name;
  return { word: gettext("NO PLAN"), why: name ? gettext("{name} cannot be run", { name }) : gettext("choose a plan") };
}
