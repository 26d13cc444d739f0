"""Mistakes in the sources, each of which a qualification has to find: a copy of the program with one line changed qualifies itself.

    python -m tests.benchmarks.qualified_mutants [NUMBER ...]

Each copy compiles anew what its change is compiled into, runs `cmmlink qualify` in a process of its own, and has to end with the exit
status 1 and name the kind of the mistake. The program as it is has to pass.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("inspection", "drivers", "simulators", "cmmlink")


@dataclass(frozen=True, slots=True)
class Mutant:
    """A mistake: what it is, of which kind, and the text of a file that becomes another."""

    what: str
    kind: str
    file: str
    sound: str
    wrong: str


MUTANTS = (
    Mutant(
        "a projection that is off by a nanometre",
        "deviation",
        "inspection/kernels/blocks.py",
        "foot[FOOT_DISTANCE], foot[FOOT_CURVATURE] = values[LANE_DISTANCE + j],",
        "foot[FOOT_DISTANCE], foot[FOOT_CURVATURE] = values[LANE_DISTANCE + j] + 1e-6,",
    ),
    Mutant(
        "a sign that is flipped",
        "deviation",
        "inspection/kernels/feet.py",
        "= foot[FOOT_U], foot[FOOT_DISTANCE]",
        "= foot[FOOT_U], -foot[FOOT_DISTANCE]",
    ),
    Mutant(
        "a fit that ends twenty picometres off",
        "pose",
        "inspection/fine.py",
        "return RigidTransform(fit.pose[0], np.array(fit.pose[1:]))",
        "return RigidTransform(fit.pose[0], np.array(fit.pose[1:]) + 2e-8)",
    ),
    Mutant(
        "a zone that is a nanometre wider",
        "zone",
        "cmmlink/plan/deciding.py",
        "return ToleranceZone(self.lower_mm, self.upper_mm, self.uncertainty_mm)",
        "return ToleranceZone(self.lower_mm, self.upper_mm + 1e-6, self.uncertainty_mm)",
    ),
    Mutant(
        "a filter whose cutoff is wrong by a thousandth",
        "filter",
        "inspection/filters.py",
        "0: math.sqrt(math.log(2) / math.pi)",
        "0: 1.001 * math.sqrt(math.log(2) / math.pi)",
    ),
    Mutant(
        "a chord that is wrong by a millionth",
        "characteristics",
        "inspection/characteristics/chord.py",
        "length = float(np.hypot(*(trailing - leading)))",
        "length = 1.000001 * float(np.hypot(*(trailing - leading)))",
    ),
    Mutant(
        "a line whose numbers are off by ten nanometres",
        "wire to verdict",
        "drivers/codecs/ascii_frames.py",
        "(float(x), float(y), float(z))",
        "(float(x) + 1e-5, float(y), float(z))",
    ),
)


def qualified(mutant: Mutant | None) -> tuple[int, list[str]]:
    """Let a copy of the program with a mistake qualify itself. Returns its exit status and the kinds outside their limits."""
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place)
        for package in PACKAGES:
            shutil.copytree(ROOT / package, copy / package)  # with its compiled code, which knows its sources by their times
        if mutant is not None:
            file = copy / mutant.file
            text = file.read_text(encoding="utf-8")
            assert mutant.sound in text, f"{mutant.file} has changed: {mutant.sound}"
            file.write_text(text.replace(mutant.sound, mutant.wrong), encoding="utf-8")
        home = {name: str(copy / "data") for name in ("XDG_DATA_HOME", "XDG_STATE_HOME", "WIN_PD_OVERRIDE_LOCAL_APPDATA")}
        environment = {**os.environ, **home, "PYTHONPATH": place}
        command = [sys.executable, "-m", "cmmlink", "qualify", "--json"]
        ended = subprocess.run(command, env=environment, cwd=place, capture_output=True, text=True, check=False)
        return ended.returncode, json.loads(ended.stdout)["outside"]


def main(numbers: list[int]) -> int:
    """Try the program as it is, and every mistake or those of the numbers. Returns how many were not found."""
    asked: list[Mutant | None] = [None, *MUTANTS]
    missed = 0
    for number in numbers or range(len(asked)):
        mutant = asked[number]
        status, outside = qualified(mutant)
        found = (status, outside) == (0, []) if mutant is None else status == 1 and mutant.kind in outside
        missed += not found
        what = "the program as it is" if mutant is None else f"{mutant.what} ({mutant.kind})"
        told = f"exit status {status}, outside: {', '.join(outside) or 'nothing'}"
        print(f"{number}. {what}: {told}{'' if found else '   WRONG'}", flush=True)
    return missed


if __name__ == "__main__":
    sys.exit(main([int(word) for word in sys.argv[1:]]))
