// What an operator is told of a fault, and what stands in the fold.

import assert from "node:assert/strict";
import { test } from "node:test";

import { faultParts } from "../../cmmlink/console/static/faults.js";

test("what the system said is folded away, the cause and what to do stay", () => {
  const said = "[Errno 2] could not open port /dev/ttyUSB9: [Errno 2] No such file; or directory: '/dev/ttyUSB9'";
  assert.deepEqual(faultParts(`/dev/ttyUSB9: cannot be opened: ${said}; is it plugged in?`),
    { words: "/dev/ttyUSB9: cannot be opened; is it plugged in?", said });
  assert.deepEqual(faultParts("h:502: the link was lost: [Errno 104] Connection reset by peer"),
    { words: "h:502: the link was lost", said: "[Errno 104] Connection reset by peer" });
});

test("our own words stay whole", () => {
  for (const told of ["COM3: cannot be opened: this computer has no such port; is it plugged in?", "COM3 does not answer any more",
    "COM3: silent for 3 s; is the device switched on and scanning?"]) assert.deepEqual(faultParts(told), { words: told, said: "" });
});
