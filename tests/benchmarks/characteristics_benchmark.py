"""Twenty characteristics of a section of 4,000 points with their certificates, one process, and how long each of them takes.

Run from the repository's root, on a quiet machine:  python -m tests.benchmarks.characteristics_benchmark [--budget]
Times are of the processor, the least of seven runs after one that compiles and that measures the nominal section.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from cmmlink.nominal_files import load_nominal
from inspection import (
    Characteristic,
    LineProfile,
    LiveInspection,
    NominalProfile,
    Outline,
    ProfileFilter,
    Region,
    RigidTransform,
    SectionCharacteristic,
    ToleranceZone,
    UncertaintyBudget,
    VaryingZone,
    discretize,
    find_airfoil,
    with_nominal,
)
from inspection.evaluation.region import features_of
from inspection.profile_uncertainty import StatedUncertainty
from tests.benchmarks.machine import machine
from tests.inspection.profiles import Array

FILE = Path(__file__).resolve().parents[1] / "data" / "airfoils" / "goe404.dat"
DATUM = RigidTransform(np.radians(20.0), np.array([5.0, -3.0]))
POINTS, RUNS = 4000, 7


def asked_of(nominal: NominalProfile) -> tuple[Characteristic, ...]:
    """Eight profiles with two minimum zones and a least consumption, and twelve numbers of the section."""
    length, closed, features = nominal.length_mm, nominal.curve.closed, features_of(nominal)
    outline = Outline(find_airfoil(nominal))

    def even(lower: float, upper: float) -> VaryingZone:
        return VaryingZone.constant(lower, upper, length, closed)

    def number(name: str, kind: Any, method: str, limit: float = 0.1, **told: Any) -> SectionCharacteristic:
        return with_nominal(SectionCharacteristic(name, kind, method, -limit, limit, datum=DATUM, **told), lambda: outline)

    limits = np.array([-0.04, -0.06, -0.04, -0.03]), np.array([0.04, 0.04, 0.05, 0.03])
    varying = VaryingZone(np.array([0.0, 60.0, 120.0, 180.0]), *limits, length, closed)
    return (
        LineProfile("contour", even(-0.05, 0.05), fit="minimum-zone", datum=DATUM),
        LineProfile("LE form", even(-0.02, 0.04), region=features.edge("LE", 15.0), fit="best-fit", rule="best-fit", datum=DATUM),
        LineProfile("flank", even(-0.06, 0.06), region=Region(0.1 * length, 0.35 * length), fit="none"),
        LineProfile("location", even(-0.09, 0.09), fit="datum", datum=DATUM),
        LineProfile("varying", varying, fit="tolerance", datum=DATUM),
        LineProfile("waviness", even(-0.05, 0.05), fit="none", filter=ProfileFilter(8.0, 0)),
        LineProfile("upper form", even(-0.05, 0.05), region=features.side("UPPER"), fit="minimum-zone", datum=DATUM),
        LineProfile("lower form", even(-0.05, 0.05), region=features.side("LOWER"), fit="best-fit", datum=DATUM),
        number("chord", "chord", "tangent"),
        number("longest chord", "chord", "maximum-distance"),
        number("thickness", "thickness", "inscribed"),
        number("LE radius", "edge-radius", "circle", window_deg=40.0),
        number("camber", "camber", "inscribed"),
        number("twist", "twist", "best-fit", 0.02),
        number("displacement", "displacement", "best-fit", place_mm=(40.0, 3.0), axis="x"),
        number("angle", "chord-angle", "nose-tail"),
        number("LE thickness", "edge-thickness", "tip-arc", offset_mm=5.0),
        number("TE thickness", "edge-thickness", "tip-arc", offset_mm=5.0, edge="trailing"),
        number("x extent", "chord", "x-extent"),
        number("two-point thickness", "thickness", "two-point"),
    )


def points_of(nominal: NominalProfile, seed: int) -> Array:
    """Even points (m, 2) with form of 2, 5 and 13 waves and 3 um of noise, a tenth of a degree off the datum."""
    rng, length = np.random.default_rng(seed), nominal.length_mm
    station = (np.arange(POINTS) + 0.5) / POINTS * length
    place, along = nominal.curve.derivatives(np.interp(station, nominal.station_mm, nominal.parameter), 1)
    normal = nominal.outward * np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    waves = ((0.01, 2), (0.006, 5), (0.004, 13))
    form = sum(high * np.sin(2 * np.pi * count * station / length + rng.uniform(0, 6)) for high, count in waves)
    moved = DATUM.inverse().apply(place + (form + rng.normal(0, 0.003, POINTS))[:, None] * normal)
    return RigidTransform(np.radians(0.1), np.array([0.02, 0.01])).apply(moved)


def seconds_of(nominal: NominalProfile, asked: tuple[Characteristic, ...], uncertainty: StatedUncertainty | None, seed: int) -> float:
    """The processor time of one inspection."""
    points, began = points_of(nominal, seed), time.process_time()
    zone = ToleranceZone(-0.05, 0.05)
    live = LiveInspection(nominal, zone, coverage_min=0.95, provisional=False, characteristics=asked, uncertainty=uncertainty)
    live.add(points)
    live.finish()
    return time.process_time() - began


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--budget", action="store_true", help="also with a budget of the uncertainty")
    options = parser.parse_args()
    nominal = discretize(load_nominal(FILE, 100.0, None, None).curve)
    print(machine("numpy", "scipy", "numba"))
    stated = StatedUncertainty(UncertaintyBudget(mpe_mm=0.0018, mpe_share=1 / 300_000, tip_radius_mm=0.0005, repeatability_mm=0.001))
    for words, uncertainty in (("without a budget", None), ("with a budget", stated))[: 1 + options.budget]:
        asked = asked_of(nominal)
        first = seconds_of(nominal, asked, uncertainty, 0)
        each = [seconds_of(nominal, asked, uncertainty, seed % 3) for seed in range(RUNS)]
        print(f"{words}: {len(asked)} characteristics of {POINTS} points in {min(each):.3f} s, the first in {first:.1f} s")


if __name__ == "__main__":
    main()
