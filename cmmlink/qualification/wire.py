"""From the wire to the verdict: a simulated scanner in a process of its own, at a stated rate, around a part whose every point is known.

The nominal is an exact circle, so that the deviation of a point is its distance from the middle less the radius. The scanner walks along
a polygon that waves about the circle across both limits: where each of its points lies is worked out here anew, in a few lines that
share nothing with the simulator, the driver or the inspection.
"""

import json
import math
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.devices import Connected, source_of, words_of
from cmmlink.events import Event, Judged, Sink
from cmmlink.from_plan import profile_of
from cmmlink.plan import load_plan
from cmmlink.qualification.budget import ARRIVED, LOST, WIRE_DEVIATION, WIRE_VERDICTS, FoundError
from cmmlink.run import FinishedRun, carry_out
from cmmlink.simulated import simulated_device
from inspection import Verdict

Array = NDArray[np.float64]

RATE_HZ = 5000
_NAME = "wire"
_QUANTITIES = (LOST, ARRIVED, WIRE_DEVIATION, WIRE_VERDICTS)
_RADIUS_MM, _WAVE_MM, _WAVES, _LIMIT_MM = 25.0, 0.03, 7, 0.02
_CORNERS = 720  # of the polygon
_ROTATION_DEG, _TRANSLATION_MM = 37.0, (210.0, 145.0)  # of the part on the machine
_DIGIT_MM = 1e-6  # the last one of the line: no verdict is known of a point that lies as near to a limit


@dataclass(frozen=True, slots=True, eq=False)
class WireToVerdict:
    """What came of the scan. Latency is from the arrival of a point until its verdict, told without a limit: computers are busy."""

    errors: tuple[FoundError, ...]
    rate_hz: float
    sent: int
    received: int
    latency_s: Array

    def document(self) -> dict[str, Any]:
        """How it went, as the certificate holds it."""
        shares = {"median": 0.5, "p99": 0.99, "largest": 1.0}
        latency = {name: float(np.quantile(self.latency_s, share)) * 1e3 for name, share in shares.items()} if self.latency_s.size else None
        return {"rate_hz": self.rate_hz, "sent": self.sent, "received": self.received, "latency_ms": latency}


def scan_on_the_wire(folder: Path, points: int, rate_hz: float = RATE_HZ) -> WireToVerdict:
    """Measure the circle with a simulated scanner. What the plan needs is written into a folder."""
    live: list[Judged] = []

    def listen(event: Event) -> None:
        if isinstance(event, Judged):
            live.append(event)

    sent_mm, deviation_mm = _sent(points)
    try:
        run = _scan(folder, points, rate_hz, listen)
    except Exception as error:  # a broken installation may raise anything
        failed = tuple(FoundError(quantity, math.inf, _NAME, 1, f"{_NAME}: {error}") for quantity in _QUANTITIES)
        return WireToVerdict(failed, rate_hz, points, 0, np.empty(0))
    latency = np.concatenate([np.empty(0), *(np.full(one.update.stop - one.update.first, one.age_s) for one in live)])
    errors = tuple(_errors(run, live, sent_mm, deviation_mm))
    return WireToVerdict(errors, rate_hz, points, run.outcome.counts.received, latency)


def _scan(folder: Path, points: int, rate_hz: float, listen: Sink) -> FinishedRun:
    path, plan_file = folder / "wire-path.csv", folder / "wire.yaml"
    corners = _corners()
    path.write_text("".join(f"{x!r},{y!r}\n" for x, y in corners.tolist()), encoding="ascii")
    (folder / "wire-nominal.yaml").write_text(_spelled(_circle()), encoding="ascii")
    plan_file.write_text(_spelled(_plan()), encoding="ascii")
    motion = {"rate": rate_hz, "speed": _step_mm(points) * rate_hz, "count": points, "rotation-deg": _ROTATION_DEG}
    arguments = [text for name, value in motion.items() for text in (f"--{name}", repr(value))]
    arguments += ["--path", str(path), "--translation-mm", *(repr(value) for value in _TRANSLATION_MM), "0"]
    with simulated_device("serial", arguments) as address:
        plan = load_plan(plan_file).with_address(address)
        device = Connected(source_of(plan), words_of(plan.device), simulated=True)
        stop, now = threading.Event(), lambda: datetime.now(UTC)
        return carry_out(plan, profile_of(plan), device, records=None, clock=time.monotonic, now=now, stop=stop, sinks=[listen])


def _errors(run: FinishedRun, live: list[Judged], sent_mm: Array, deviation_mm: Array) -> Iterator[FoundError]:
    """What was lost, and of what arrived where it lies, its deviation, and its verdict both in mid-scan and at the end."""
    counts, result, points = run.outcome.counts, run.outcome.result, len(sent_mm)
    missing = abs(points - counts.judged) + counts.lost + counts.damaged_bytes + counts.rejected
    yield FoundError(LOST, float(missing), _NAME, points)
    if result is None or missing:
        problem = f"{_NAME}: {counts.judged} of {points} points were judged. {run.outcome.failure or run.refusal or ''}"
        yield from (FoundError(quantity, math.inf, _NAME, 1, problem) for quantity in _QUANTITIES[1:])
        return
    arrived = result.section_at(slice(None))
    yield FoundError(ARRIVED, float(np.linalg.norm(arrived - sent_mm, axis=1).max()), _NAME, points)
    yield FoundError(WIRE_DEVIATION, float(np.abs(result.deviation_mm - _deviation_of(arrived)).max()), _NAME, points)
    clear = np.abs(np.abs(deviation_mm) - _LIMIT_MM) > _DIGIT_MM
    true = np.where(np.abs(deviation_mm) > _LIMIT_MM, Verdict.NONCONFORM, Verdict.CONFORM)
    in_mid_scan = np.concatenate([one.update.verdicts for one in live])
    wrong = clear & ((result.verdicts != true) | (in_mid_scan != true))
    yield FoundError(WIRE_VERDICTS, float(wrong.sum()), _NAME, int(clear.sum()))


def _corners() -> Array:
    """The polygon (k, 2) on the part."""
    turn = 2 * np.pi * np.arange(_CORNERS) / _CORNERS
    radius = _RADIUS_MM + _WAVE_MM * np.sin(_WAVES * turn)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])


def _step_mm(points: int) -> float:
    """How far apart points lie that go once around the polygon."""
    corners = _corners()
    return float(np.hypot(*(np.roll(corners, -1, axis=0) - corners).T).sum()) / points


def _sent(points: int) -> tuple[Array, Array]:
    """Where the points (m, 2) of the scan lie on the machine, and their deviations (m,)."""
    corners = np.vstack([_corners(), _corners()[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    station = _step_mm(points) * np.arange(points)
    on_part = np.column_stack([np.interp(station, along, corners[:, axis]) for axis in (0, 1)])
    turn = math.radians(_ROTATION_DEG)
    turned = on_part @ np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    return turned + np.array(_TRANSLATION_MM), np.hypot(on_part[:, 0], on_part[:, 1]) - _RADIUS_MM


def _deviation_of(points_mm: Array) -> Array:
    """The deviations of points (m, 2) on the machine, whatever the rotation: their distance from where the middle lies."""
    return np.asarray(np.hypot(*(points_mm - np.array(_TRANSLATION_MM)).T) - _RADIUS_MM)


def _circle() -> Mapping[str, Any]:
    """The circle as a rational curve of degree 2, four arcs of a quarter each."""
    r, half = _RADIUS_MM, math.sqrt(0.5)
    corners = [(r, 0.0), (r, r), (0.0, r), (-r, r), (-r, 0.0), (-r, -r), (0.0, -r), (r, -r), (r, 0.0)]
    knots = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0]
    return {"degree": 2, "closed": True, "knots": knots, "control_points_mm": corners, "weights": [1.0, half] * 4 + [1.0]}


def _plan() -> Mapping[str, Any]:
    # The section becomes the nominal by undoing what brought the part onto the machine.
    turn = math.radians(-_ROTATION_DEG)
    x, y = _TRANSLATION_MM
    back = [-(math.cos(turn) * x - math.sin(turn) * y), -(math.sin(turn) * x + math.cos(turn) * y)]
    return {
        "part": {"name": _NAME},
        "nominal": {"file": "wire-nominal.yaml"},
        "tolerance": {"lower_mm": -_LIMIT_MM, "upper_mm": _LIMIT_MM},
        "device": {"type": "serial", "address": "pty"},
        "registration": {"datum": {"rotation_deg": -_ROTATION_DEG, "translation_mm": back}},
        "out": None,
    }


def _spelled(content: Mapping[str, Any]) -> str:
    return "".join(f"{key}: {json.dumps(value)}\n" for key, value in content.items())
