// Written by `python -m cmmlink.console.declarations`; change cmmlink/console/protocol.py, not this file.

export const WRONG_TOKEN = 4401;
export const LARGEST_NOMINAL = 33554432;
export const HEADER_BYTES = 32;
export const HEADER_AT = {"kind": 0, "generation": 4, "rows": 8, "flags": 12, "time_ms": 16, "number": 24};
export const POINTS = 1;
export const NOMINAL = 2;
export const SURFACE_POINTS = 3;
export const NOMINAL_SURFACE = 4;
export const CLOSED = 1;
export const STATION = 0;
export const DEVIATION = 1;
export const FOOT_X = 2;
export const FOOT_Y = 3;
export const NORMAL_X = 4;
export const NORMAL_Y = 5;
export const VERDICT = 6;
export const COLUMNS = 7;
export const CONFORM = 0;
export const UNCERTAIN = 1;
export const NONCONFORM = 2;
export const WORDS_OF_VERDICTS = {"conform": "CONFORM", "uncertain": "NOT PROVEN", "nonconform": "NOT CONFORM"};
export const POSE_MOVES = "the pose still moves";
export const SURFACE_COLOURS = {
  "lower": "#8fc1e3",
  "middle": "#f7f5ef",
  "upper": "#fbbe8a",
  "above": "#b3300b",
  "below": "#123f8f",
  "not_proven": "#e8c400",
  "not_measured": "#9aa1a8"
};
