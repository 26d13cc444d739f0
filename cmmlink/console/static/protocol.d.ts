// Written by `python -m cmmlink.console.declarations`; change cmmlink/console/protocol.py, not this file.

export const WRONG_TOKEN: 4401;
export const LARGEST_NOMINAL: 33554432;
export const HEADER_BYTES: 32;
export const HEADER_AT: { readonly kind: 0; readonly generation: 4; readonly rows: 8; readonly flags: 12; readonly time_ms: 16; readonly number: 24 };
export const POINTS: 1;
export const NOMINAL: 2;
export const SURFACE_POINTS: 3;
export const NOMINAL_SURFACE: 4;
export const CLOSED: 1;
export const STATION: 0;
export const DEVIATION: 1;
export const FOOT_X: 2;
export const FOOT_Y: 3;
export const NORMAL_X: 4;
export const NORMAL_Y: 5;
export const VERDICT: 6;
export const COLUMNS: 7;
export const CONFORM: 0;
export const UNCERTAIN: 1;
export const NONCONFORM: 2;
export const WORDS_OF_VERDICTS: { readonly conform: "CONFORM"; readonly uncertain: "NOT PROVEN"; readonly nonconform: "NOT CONFORM" };
export const POSE_MOVES: "the pose still moves";
export const SURFACE_COLOURS: { readonly lower: "#8fc1e3"; readonly middle: "#f7f5ef"; readonly upper: "#fbbe8a"; readonly above: "#b3300b"; readonly below: "#123f8f"; readonly not_proven: "#e8c400"; readonly not_measured: "#9aa1a8" };

/** The answer to a one-time address: the token, which the page keeps for as long as its tab is open. */
export interface Admitted {
  readonly token: string;
  readonly type: "admitted";
}

/** The first message: which version serves, which of its pages this is, and whether the network can reach it. */
export interface Hello {
  readonly version: string;
  readonly page: number;
  readonly remote: boolean;
  readonly type: "hello";
}

/** A sign of life twice a second, with the station's time of day, ms since 1970. */
export interface Alive {
  readonly now_ms: number;
  readonly type: "alive";
}

/** What came of a command: its number, and words for the operator. */
export interface Answer {
  readonly number: number | null;
  readonly do: string;
  readonly ok: boolean;
  readonly message: string;
  readonly type: "answer";
}

/** Whether this page controls the station, whether any page does, and how many pages are open. */
export interface Control {
  readonly controls: boolean;
  readonly taken: boolean;
  readonly pages: number;
  readonly type: "control";
}

/** The plan chosen. `problem` is empty when it can be run, `line` the line it points at; `facts` are label and value. */
export interface ChosenPlan {
  readonly name: string;
  readonly text: string;
  readonly problem: string;
  readonly line: number | null;
  readonly part: string;
  readonly facts: readonly (readonly [string, string])[];
  readonly has_address: boolean;
}

/** The last test of the device. */
export interface DeviceTest {
  readonly state: "none" | "testing" | "passed" | "failed" | "aborted";
  readonly message: string;
}

/** What the operator has chosen and entered, and what may be done next. `question` waits for `start again`; empty: none. */
export interface StationState {
  readonly plans: readonly string[];
  readonly ct_plans: readonly string[];
  readonly choice: ChosenPlan | null;
  readonly serial_number: string;
  readonly operator: string;
  readonly address: string;
  readonly test: DeviceTest;
  readonly question: string;
  readonly running: boolean;
  readonly can_start: boolean;
  readonly keeps_records: boolean;
  readonly can_make_plans: boolean;
  readonly can_run_demo: boolean;
  readonly has_trends: boolean;
  readonly type: "station";
}

/** Where the results of runs are pushed to, and how many runs wait since when, and why; empty address: nowhere. added : how many were pushed since the console was started */
export interface ResultsState {
  readonly address: string;
  readonly waiting: number;
  readonly since: string;
  readonly problem: string;
  readonly added: number;
  readonly type: "results";
}

/** One thing that went wrong: how often, since when, whether it still is so, whether somebody has seen it. since : date and time of day at this place run : the serial number, or the part, of the run it belongs to; empty before the first current : it belongs to the run that is on, or was the last; an earlier one says nothing about the part in front */
export interface AlarmRow {
  readonly number: number;
  readonly severity: "fault" | "warning";
  readonly what: string;
  readonly detail: string;
  readonly count: number;
  readonly since: string;
  readonly run: string;
  readonly current: boolean;
  readonly active: boolean;
  readonly acknowledged: boolean;
}

/** The newest alarms, newest first, and whether a fault of the current run is there that is active or unseen. */
export interface AlarmList {
  readonly fault: boolean;
  readonly alarms: readonly AlarmRow[];
  readonly type: "alarms";
}

/** How far the registration is, how far values can still move (mm; null: no bound is known), and how many other poses fit. */
export interface RegistrationState {
  readonly state: "seeking" | "provisional" | "settled";
  readonly can_move_mm: number | null;
  readonly other_poses: number;
}

/** The point farthest from the middle of the zone; its place in the coordinates of the nominal. Of a surface the station is 0. */
export interface WorstPoint {
  readonly station_mm: number;
  readonly deviation_mm: number;
  readonly x_mm: number;
  readonly y_mm: number;
  readonly verdict: "conform" | "uncertain" | "nonconform";
  readonly z_mm?: number | null;
}

/** The verdict, or how the run ended, in words; its sign; whether it is final; why it is so, and every further reason. of : which of several characteristics gave the part its verdict */
export interface VerdictState {
  readonly word: string;
  readonly shape: "conform" | "not-proven" | "not-conform" | "ended-early" | "none";
  readonly final: boolean;
  readonly why: string;
  readonly of: string;
  readonly reasons: readonly string[];
}

/** Whether the machine that waits for the verdict was told it: when, ms since 1970, to which of its requests, and why not. told : the verdict in words that it was told; empty where it was told nothing */
export interface AnswerState {
  readonly state: "awaited" | "sent" | "not sent";
  readonly at_ms?: number | null;
  readonly request?: number | null;
  readonly problem: string;
  readonly told: string;
}

/** The tolerance zone and the expanded uncertainty of one deviation, mm; how that uncertainty counts, in words. */
export interface ZoneLimits {
  readonly lower_mm: number;
  readonly upper_mm: number;
  readonly uncertainty_mm: number;
  readonly decision_rule: string;
}

/** A region of a surface that is out of tolerance: its number, from 1, its worst deviation and where on the nominal that is. */
export interface SurfaceRegion {
  readonly number: number;
  readonly worst_mm: number;
  readonly area_mm2: number;
  readonly points: number;
  readonly x_mm: number;
  readonly y_mm: number;
  readonly z_mm: number;
}

/** What is known of a whole surface beside its points: nothing before its end. gap_max_mm : the diameter of the widest place without a point that counts as measured regions : those out of tolerance, the worst first; `more` there are besides unmeasured : how many places were not measured, and their area together */
export interface WholeSurface {
  readonly gap_max_mm: number;
  readonly regions: readonly SurfaceRegion[];
  readonly more: number;
  readonly unmeasured: number;
  readonly unmeasured_mm2: number;
}

/** Everything that is shown of a run in numbers and words, as it was at one moment. run : its id in the records; empty where it is not kept there, or is not over kind : a run that is measured, or what poses as none: a replay, a run from the records, a section of a surface notes : what was assumed about the nominal and the points began : when the points were measured: date, time of day and offset from UTC ending : null while the run is on; message says why a run has no result, or what failed link_detail : why the link was lost, or how long it was away; empty while it never was streaming : whether the device shows itself alive now expected : number of points the device announced latency_s : how long the newest judged point waited for its verdict verdict_at_ms : when the newest verdict was given, ms since 1970 answer : null where no machine waits for the verdict surface : of a run of a whole surface, which has no stations; null of a section */
export interface RunState {
  readonly number: string;
  readonly run: string;
  readonly kind: "run" | "replay" | "recorded" | "section";
  readonly plan: string;
  readonly part: string;
  readonly serial_number: string;
  readonly operator: string;
  readonly device: string;
  readonly address: string;
  readonly simulated: boolean;
  readonly notes: readonly string[];
  readonly began: string;
  readonly phase: "preparing" | "starting" | "measuring" | "ending" | "finished";
  readonly ending: "complete" | "aborted" | "interrupted" | "failed" | "running" | null;
  readonly message: string;
  readonly remark: string;
  readonly link: "connecting" | "up" | "down" | "closed";
  readonly link_detail: string;
  readonly streaming: boolean;
  readonly received: number;
  readonly judged: number;
  readonly rejected: number;
  readonly pending: number;
  readonly lost: number;
  readonly damaged_bytes: number;
  readonly rejected_by_reason: { readonly [key: string]: number };
  readonly expected: number | null;
  readonly rate_per_s: number;
  readonly buffered: number;
  readonly buffer_peak: number;
  readonly buffer_capacity: number;
  readonly stalls: number;
  readonly latency_s: number | null;
  readonly verdict_at_ms: number | null;
  readonly registration: RegistrationState;
  readonly coverage: number;
  readonly coverage_min: number;
  readonly out_of_tolerance: number;
  readonly worst: WorstPoint | null;
  readonly verdict: VerdictState;
  readonly answer: AnswerState | null;
  readonly length_mm: number;
  readonly zone: ZoneLimits;
  readonly surface: WholeSurface | null;
}

/** The run the page looks at, null before the first; `recorded` when the page opened a run, or a section, itself. */
export interface ShownRun {
  readonly run: RunState | null;
  readonly recorded: boolean;
  readonly type: "run";
}

/** One characteristic as it is shown. word, shape : its verdict, or how it looks so far, and the sign of it value, nominal, deviation, lower, upper, uncertainty : in `unit`; null where there is none. The limits are those of the deviation method : how the value is found; `fit`, `filter`, `zone` and `region` in words, `fit` and `filter` "none" where there is none from_mm, to_mm : the stretch of the profile that it is of; null for the whole. From above to where it crosses the seam why : the first reason of the verdict worst : the point that consumes most of its tolerance places : places that its value was found at, with their names, in the coordinates of the nominal, mm */
export interface CharacteristicRow {
  readonly name: string;
  readonly type: string;
  readonly word: string;
  readonly shape: "conform" | "not-proven" | "not-conform" | "ended-early" | "none";
  readonly verdict: "conform" | "uncertain" | "nonconform";
  readonly value: number | null;
  readonly nominal: number | null;
  readonly unit: string;
  readonly lower: number | null;
  readonly upper: number | null;
  readonly deviation: number | null;
  readonly uncertainty: number;
  readonly method: string;
  readonly fit: string;
  readonly filter: string;
  readonly zone: string;
  readonly region: string;
  readonly rule: string;
  readonly from_mm: number | null;
  readonly to_mm: number | null;
  readonly why: string;
  readonly worst: WorstPoint | null;
  readonly places: readonly (readonly [string, number, number])[];
}

/** The characteristics of the run that the page looks at, and U along its profile: pairs of station and U, mm. more : how many there are besides; a page is told of a hundred at most, those with the worst verdicts final : they have their verdicts; before that every value is one so far */
export interface CharacteristicList {
  readonly rows: readonly CharacteristicRow[];
  readonly more: number;
  readonly uncertainty: readonly (readonly [number, number])[];
  readonly final: boolean;
  readonly type: "characteristics";
}

/** One line of the station's history. `worst_mm` is the deviation farthest from the middle of the zone. judged : every judgement of it that was made later, in words, oldest first section : which section of a surface it is, in words; empty for a run of a device word, shape : the verdict, or how early the run ended, and its sign; `counted`: the scan came to its end with a verdict of : of several characteristics, which gave a verdict that is not conform, by name; else empty */
export interface RunRow {
  readonly run: string;
  readonly began: string;
  readonly part: string;
  readonly serial_number: string;
  readonly operator: string;
  readonly plan: string;
  readonly section: string;
  readonly simulated: boolean;
  readonly state: string;
  readonly received: number;
  readonly verdict: "conform" | "uncertain" | "nonconform" | null;
  readonly word: string;
  readonly shape: "conform" | "not-proven" | "not-conform" | "ended-early" | "none";
  readonly counted: boolean;
  readonly of: string;
  readonly worst_mm: number | null;
  readonly worst_station_mm: number | null;
  readonly worst_x_mm: number | null;
  readonly worst_y_mm: number | null;
  readonly lower_mm: number | null;
  readonly upper_mm: number | null;
  readonly judged: readonly string[];
  readonly worst_z_mm?: number | null;
}

/** The newest runs on record, newest first. */
export interface History {
  readonly runs: readonly RunRow[];
  readonly type: "history";
}

/** The newest of the runs that the page looks for, newest first, and how many there are; null where it looks for none. */
export interface FoundRuns {
  readonly runs: readonly RunRow[] | null;
  readonly total: number;
  readonly type: "found";
}

/** One judged section of a CT surface. */
export interface SectionRow {
  readonly height_mm: number;
  readonly verdict: "conform" | "uncertain" | "nonconform";
  readonly received: number;
  readonly coverage: number;
  readonly worst_mm: number | null;
  readonly worst_station_mm: number | null;
  readonly lower_mm: number;
  readonly upper_mm: number;
  readonly warnings: readonly string[];
}

/** The CT surface that is inspected, or was inspected last. `word` and `shape` are those of its worst section, or say how early it ended; `message` says what came of it, `notes` what was assumed about the surface and its nominals. */
export interface SurfaceState {
  readonly plan: string;
  readonly word: string;
  readonly shape: "conform" | "not-proven" | "not-conform" | "ended-early" | "none";
  readonly state: "none" | "reading" | "inspecting" | "done" | "failed";
  readonly message: string;
  readonly notes: readonly string[];
  readonly done: number;
  readonly total: number;
  readonly remaining_s: number | null;
  readonly sections: readonly SectionRow[];
  readonly type: "ct";
}

/** One register: what it holds in hexadecimal, and the number that begins there in every column; all empty where there is none. */
export interface RegisterRow {
  readonly at: number;
  readonly hex: string;
  readonly values: readonly string[];
}

/** The registers that are read, or were read last. `columns` are type and word order, the latter empty for 16 bits. */
export interface RegisterTable {
  readonly state: "none" | "reading" | "over" | "failed";
  readonly message: string;
  readonly address: string;
  readonly table: string;
  readonly columns: readonly (readonly [string, string])[];
  readonly rows: readonly RegisterRow[];
  readonly type: "registers";
}

/** Choose a plan and have it checked. */
export interface Choose {
  readonly plan: string;
  readonly do: "choose";
}

/** Enter what belongs to the next part; null leaves a value as it is. */
export interface Enter {
  readonly serial_number?: string | null;
  readonly operator?: string | null;
  readonly address?: string | null;
  readonly do: "enter";
}

/** Mark one alarm as seen, or all. */
export interface Acknowledge {
  readonly alarm?: number | null;
  readonly do: "acknowledge";
}

/** Look at a recorded run, or measure it again. */
export interface OfRun {
  readonly run: string;
  readonly do: "open" | "replay";
}

/** Look for runs; what is empty asks for nothing. Days are written 2026-03-31; the verdict is a name of one, or none. */
export interface Search {
  readonly part: string;
  readonly serial_number: string;
  readonly operator: string;
  readonly plan: string;
  readonly verdict: string;
  readonly since: string;
  readonly until: string;
  readonly do: "search";
}

/** Look at one section of the CT surface. */
export interface OpenSection {
  readonly section: number;
  readonly do: "section";
}

/** Inspect the CT surface of a plan. */
export interface ImportSurface {
  readonly plan: string;
  readonly do: "import";
}

/** Read registers of a Modbus device over and over, until it is aborted. */
export interface LookAtRegisters {
  readonly address: string;
  readonly table: string;
  readonly first: number;
  readonly count: number;
  readonly device_id: number;
  readonly baud_rate: number;
  readonly parity: string;
  readonly do: "look at registers";
}

/** Save a register map beside the plans. The answer is a `MapSaved` as JSON. x, y, z, sequence : register and type, like 41:float32; empty where the device has none scale : mm per unit of coordinates that are whole numbers replace : a map of this name may be written over */
export interface KeepMap {
  readonly name: string;
  readonly device: string;
  readonly table: string;
  readonly word_order: string;
  readonly x: string;
  readonly y: string;
  readonly z: string;
  readonly sequence: string;
  readonly scale: string;
  readonly replace: boolean;
  readonly do: "keep map";
}

/** A command that needs no more words. The answer to `another page` is the code of a one-time address. */
export interface Plain {
  readonly do: "start" | "start again" | "end" | "abort" | "test" | "demo" | "take control" | "live" | "devices" | "another page";
}

/** A device that can be seen now. The answer to `devices` is a JSON list of them. */
export interface Device {
  readonly address: string;
  readonly description: string;
}

/** What is wrong with the answer in a field of a new plan. */
export interface FormMistake {
  readonly field: "nominal" | "unit" | "curve" | "ends" | "side" | "part" | "tolerance" | "source" | "radius" | "results" | "name";
  readonly words: string;
}

/** What is understood of a nominal that a page hands in. The answer to its post at `/nominal`, as JSON. problem : why it cannot be read; empty where it can asks : what it leaves open: the unit is that of the file, or the length of the chord that it is drawn in units of curves : number and words of each curve of a drawing; empty where there is one turns_left : a profile that goes round does so counter-clockwise points_mm : along the curve, from its start; in units of the file where the unit is not known, as are length and size part, name : names for part and plan that are offered; files: of points and surfaces beside the plans */
export interface Understood {
  readonly problem: string;
  readonly mistakes: readonly FormMistake[];
  readonly asks: readonly ("unit" | "chord" | "curve" | "ends" | "side")[];
  readonly curves: readonly (readonly [number, string])[];
  readonly closed: boolean;
  readonly turns_left: boolean;
  readonly length_mm: number;
  readonly size_mm: readonly [number, number];
  readonly unit_known: boolean;
  readonly source_format: string;
  readonly notes: readonly string[];
  readonly points_mm: readonly (readonly [number, number])[];
  readonly part: string;
  readonly name: string;
  readonly files: readonly string[];
}

/** What came of a new plan: its name once it is saved, else what is wrong. The answer to a post at `/plan`, as JSON. surface : it is a plan of a CT surface; taken: there was a plan of this name */
export interface PlanSaved {
  readonly name: string;
  readonly surface: boolean;
  readonly taken: boolean;
  readonly mistakes: readonly FormMistake[];
}

/** What came of a map: its name as a plan beside it calls it, else why there is none. `taken`: a map of this name is there. */
export interface MapSaved {
  readonly name: string;
  readonly problem: string;
  readonly taken: boolean;
}

/** Which parts have results, and of which stations. */
export interface TrendChoices {
  readonly parts: readonly string[];
  readonly stations: readonly string[];
}

/** One run: when it began, at this place; value and limits are null where there is none. */
export interface TrendRun {
  readonly run: string;
  readonly station: string;
  readonly serial_number: string;
  readonly began: string;
  readonly value: number | null;
  readonly lower: number | null;
  readonly upper: number | null;
  readonly verdict: string;
}

/** A rule of Western Electric that is broken at a plotted value. */
export interface BrokenRule {
  readonly at: number;
  readonly words: string;
  readonly above: boolean;
}

/** One line of a control chart; what is plotted is null where there is nothing. */
export interface TrendChart {
  readonly centre: number;
  readonly lower: number;
  readonly upper: number;
  readonly plotted: readonly (number | null)[];
  readonly broken: readonly BrokenRule[];
}

/** An index of capability with its limits of confidence; null where one is not stated, and why. */
export interface TrendIndex {
  readonly name: string;
  readonly value: number | null;
  readonly lower: number | null;
  readonly upper: number | null;
  readonly reason: string;
}

/** The heat strip: a row a run, oldest first, and in each a value for every even part of the profile. names : serial number, or run, of each row worst_mm : the worst deviation, null where nothing was measured levels : from -3 to 3, out of tolerance at both ends; null has no colour slope_um : the drift of each part, micrometres a run stretches : from and to, mm, where the drift is significant */
export interface TrendStrip {
  readonly length_mm: number;
  readonly names: readonly string[];
  readonly worst_mm: readonly (readonly (number | null)[])[];
  readonly levels: readonly (readonly (number | null)[])[];
  readonly slope_um: readonly (number | null)[];
  readonly stretches: readonly (readonly [number, number])[];
}

/** The trend of one characteristic over the newest runs, oldest first. characteristics : the names of all that the part has rows : of each plotted value the run that it ends with basis : mean, standard deviation and distribution of the indices, in words; empty without any drifts : where the profile drifts, in words */
export interface TrendShown {
  readonly part: string;
  readonly characteristic: string;
  readonly characteristics: readonly string[];
  readonly unit: string;
  readonly is_form: boolean;
  readonly subgroup: number;
  readonly runs: readonly TrendRun[];
  readonly rows: readonly number[];
  readonly location: TrendChart | null;
  readonly spread: TrendChart | null;
  readonly indices: readonly TrendIndex[];
  readonly basis: string;
  readonly strip: TrendStrip | null;
  readonly drifts: readonly string[];
  readonly notes: readonly string[];
}

export type Message = Admitted | Hello | Alive | Answer | Control | StationState | ResultsState | AlarmList | ShownRun | CharacteristicList | History | FoundRuns | SurfaceState | RegisterTable;

export type Command = Choose | Enter | Acknowledge | OfRun | Search | OpenSection | ImportSurface | LookAtRegisters | KeepMap | Plain;
