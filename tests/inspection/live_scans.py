"""Simulated scans of six kinds, as they arrive live: good parts, noise alone, dents, steps, form that appears late, and a dense side."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from inspection import InspectionResult, LiveInspection, LiveUpdate, NominalProfile, ToleranceZone
from inspection.methods import FitName
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, scan, stations

Kind = Literal["good", "noise only", "dent", "step", "late form", "dense side"]
KINDS: tuple[Kind, ...] = get_args(Kind)
ZONE = ToleranceZone(-0.05, 0.05, 0.005)
_LOOKS = 20


@dataclass(frozen=True, eq=False)
class LiveScan:
    """Points of a scan in their order, and what they are measured against."""

    nominal: NominalProfile
    points_mm: Array


def live_scan(kind: Kind, seed: int, count: int = 800) -> LiveScan:
    """A scan of one kind; its seed decides form, noise, place, part, and where it begins."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    name = ("goe404", "mh42")[seed % 2]
    form = _form(kind, stations(name, count) / nominal_of(name).curve.length_mm, rng)
    points = scan(name, count, form, rng.uniform(-180, 180), (rng.uniform(-30, 30), rng.uniform(-30, 30)))
    points = np.roll(points, -int(rng.integers(count)), axis=0)
    if kind == "dense side":
        points = np.repeat(points, np.where(np.arange(count) < count // 4, 4, 1), axis=0)
        points = points + rng.normal(0, 0.002, points.shape)
    return LiveScan(nominal_of(name), points)


def _form(kind: Kind, share: Array, rng: np.random.Generator) -> Array:
    """Deviations (m,) at shares (m,) of the length; without a dent, a step or late form they stay inside the zone."""
    form = rng.normal(0, 0.003, len(share))
    turns = rng.uniform(0, 2 * np.pi, 4)
    if kind != "noise only":
        waves = ((0.012, 2), (0.008, 5), (0.004, 13))
        form += sum(height * np.sin(2 * np.pi * number * share + turn) for (height, number), turn in zip(waves, turns, strict=False))
    at = rng.uniform(0.2, 0.8)
    if kind == "dent":
        form -= 0.18 * np.exp(-(((share - at) / 0.012) ** 2))
    if kind == "step":
        form += 0.13 * ((share > at) & (share < at + 0.25))
    if kind == "late form":
        form += 0.09 * np.clip((share - 0.6) / 0.4, 0, 1) * np.sin(3 * np.pi * share + turns[3])
    return form


def followed(given: LiveScan, fit: FitName) -> tuple[list[LiveUpdate], InspectionResult]:
    """The provisional looks at every twentieth of a scan, and its result."""
    live, looks = LiveInspection(given.nominal, ZONE, fit=fit), []
    step = len(given.points_mm) // _LOOKS
    for first in range(0, len(given.points_mm), step):
        live.add(given.points_mm[first : first + step])
        looks.append(live.snapshot())
    return [look for look in looks if look.state == "provisional"], live.finish()


def proven_at(given: LiveScan, zone: ToleranceZone, every: int) -> int | None:
    """After how many points it is proven that a part will fail, looked at after `every` so many; None where it never is."""
    live = LiveInspection(given.nominal, zone)
    search = live.prefix_search()
    for first in range(0, len(given.points_mm), every):
        live.add(given.points_mm[first : first + every])
        prefix = live.prefix()
        if prefix is not None and search.refutes(prefix):
            return prefix.received
    return None
