"""How soon a measuring machine is told to stop, and how much of the scan of a bad part `stop_when_failed` saves.

    python -m tests.benchmarks.machine_stops [PARTS]

First runs at 1,000 points/s are stopped at a moment of their own: from the call by which the page's Esc stops the source, and from the
event that Ctrl-C sets, to the AbortE that the simulated machine hears. Then each of the parts has a defect somewhere: how much of the scan
is left when the machine is told. A bad part that is not NOT CONFORM fails this, and so does a good one that is stopped, however little of
its zone is left.
"""

import sys
import threading
import time
from dataclasses import dataclass, field

import numpy as np

from cmmlink.events import RunStarted
from cmmlink.pipeline import CutShort, RunOutcome, run_inspection
from drivers.codecs.dme_commands import curve_density, scans_on_curve
from drivers.codecs.dme_points import PointCheck
from drivers.codecs.dme_session import DmeJob
from drivers.links.dme_machine import DmeMachine
from inspection import LiveInspection, NurbsCurve, ToleranceZone, Verdict, discretize
from simulators.devices.dme import Server
from simulators.dme_controller import Controller
from simulators.dme_part import PathPart
from simulators.faults import Injector
from simulators.line import open_line
from simulators.motion import Motion
from tests.benchmarks.machine import machine

RADIUS_MM, STEP_MM, RATE_HZ, DEFECT_MM, STOPS = 1.5, 0.1, 1000.0, 0.15, 40
GOOD_MM = 0.045  # form error of the parts that pass
TURN = np.linspace(0.0, 2.0 * np.pi, 4001)
PART_MM = np.column_stack([40.0 * np.cos(TURN) + 4.0 * np.cos(2.0 * TURN), 15.0 * np.sin(TURN)])
LENGTH_MM = float(np.hypot(*np.diff(PART_MM, axis=0).T).sum())
NOMINAL = discretize(NurbsCurve.interpolate(PART_MM[::20], closed=True), 2000)
ZONE = ToleranceZone(-0.05, 0.05)
_TANGENT = np.gradient(PART_MM, axis=0)
_OUTWARD = np.column_stack([_TANGENT[:, 1], -_TANGENT[:, 0]]) / np.hypot(*_TANGENT.T)[:, None]
_FLAT = np.zeros((len(PART_MM), 1))
JOB = DmeJob(
    PointCheck(RADIUS_MM, 0.001, 50.0),
    scans_on_curve(np.hstack([PART_MM, _FLAT, _OUTWARD, _FLAT])[:-1:20], closed=True),
    preparations=(curve_density(STEP_MM, 10.0),),
)


class ListeningServer(Server):
    """A server that notes when it heard that it has to stop."""

    heard_s = float("nan")

    def _listen(self, wait_s: float) -> None:
        before = self.aborts
        super()._listen(wait_s)
        if self.aborts > before:
            self.heard_s = time.monotonic()


@dataclass(slots=True)
class Stopped:
    """One run: how it ended, when the machine heard that it has to stop, and how many points it had sent."""

    outcome: RunOutcome
    heard_s: float
    sent: int
    asked_s: list[float] = field(default_factory=list)


def run(seed: int, defect: tuple[float, float], stop_after_s: float | None, *, by_event: bool = False, form_mm: float = 0.02) -> Stopped:
    """Measure one part on a machine of this process. stop_after_s : when somebody stops it; None: nobody does."""
    motion = Motion(
        STEP_MM * RATE_HZ, RATE_HZ, None, True, form_mm, 0.001, *defect, tip_radius_mm=RADIUS_MM, seed=seed
    )  # form error, noise, then height and station of the defect
    wire = open_line("127.0.0.1:0")
    controller = Controller(PathPart(PART_MM, motion), homed=True, tool="Probe1", points_a_line=10, point_s=1.0 / RATE_HZ)
    server = ListeningServer(wire, controller, Injector((), seed), paced=True)
    serving = threading.Thread(target=server.serve_client, daemon=True)
    serving.start()
    source, stop, asked = DmeMachine(wire.address, JOB, 30.0), threading.Event(), list[float]()

    def ask() -> None:
        asked.append(time.monotonic())
        (stop.set if by_event else source.stop)()

    timer = threading.Timer(stop_after_s or 0.0, ask)
    if stop_after_s is not None:
        timer.start()
    live = LiveInspection(NOMINAL, ZONE, tip_radius_mm=RADIUS_MM)
    started = RunStarted("part", "", "", "machine", simulated=True)
    cut_short: CutShort = "when failed" if stop_after_s is None else "never"
    outcome = run_inspection(source, live, [], started, buffer_points=100_000, clock=time.monotonic, stop=stop, cut_short=cut_short)
    serving.join(5.0)
    wire.close()
    return Stopped(outcome, server.heard_s, server.points, asked)


def main() -> int:
    """Print what was found; 1 where a verdict is wrong."""
    parts = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    rng = np.random.default_rng(1)
    lines = [machine("numpy")]
    for name, by_event in (("the page's Esc", False), ("Ctrl-C", True)):
        stops = [run(seed, (0.0, 0.0), float(rng.uniform(0.2, 0.6)), by_event=by_event) for seed in range(STOPS)]
        late_ms = np.array([1000.0 * (one.heard_s - one.asked_s[0]) for one in stops])
        lines.append(f"{name} to AbortE: median {np.median(late_ms):.0f} ms, p99 {np.percentile(late_ms, 99):.0f} ms, {STOPS} runs")
    good = [run(seed, (0.0, 0.0), None, form_mm=GOOD_MM).outcome for seed in range(-(-parts // 5))]
    passed = sum(one.result is not None and one.result.complete and one.result.verdict is Verdict.CONFORM for one in good)
    wrong = passed < len(good)
    lines.append(
        f"of parts that pass with {GOOD_MM / ZONE.upper_mm:.0%} of their zone used, {passed} of {len(good)} were measured to the end"
    )
    saved = list[float]()
    for seed in range(parts):
        one = run(seed, (DEFECT_MM, float(rng.uniform(0.0, LENGTH_MM))), None)
        wrong |= one.outcome.result is None or one.outcome.result.verdict is not Verdict.NONCONFORM
        saved.append(1.0 - one.sent * STEP_MM / LENGTH_MM)
    lines.append(
        f"saved of the scans of {parts} bad parts: mean {np.mean(saved):.0%}, median {np.median(saved):.0%}, "
        f"{np.mean(np.array(saved) > 0.01):.0%} of them stopped before their end"
    )
    sys.stdout.write("\n".join(lines) + "\n")
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
