"""The audit of U: numbers of sections measured anew with drawn errors, whose scatter is held against what is stated of them.

    python -m tests.benchmarks.uncertainty_audit [DRAWS]

For four sections (cambered, thin, with round edges, and goe404) errors of device, tip, temperature and noise are drawn together, all
points are judged as a run does, and the scatter of every number is compared with the combined standard uncertainty that the budget
gives. Below 0.75 too little is stated, which ends with exit status 1.
"""

import sys
from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from inspection import (
    CharacteristicResult,
    LiveInspection,
    NominalProfile,
    Outline,
    RigidTransform,
    SectionCharacteristic,
    SectionKind,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    deviations,
    discretize,
    find_airfoil,
    with_nominal,
)
from tests.inspection import profiles
from tests.inspection.evaluation.test_drawn_numbers import blade
from tests.inspection.reference_parts import nominal_of
from tests.inspection.test_uncertainty import covariance_of_field

Array = NDArray[np.float64]

BUDGET = UncertaintyBudget(0.002, 0.0018, 1 / 300e3, 0.0008, 0.5, 11.5e-6, 8.0, 1e-6)
HERE = RigidTransform.identity()
COUNT = 400
TOO_LITTLE = 0.75
TYPES: tuple[SectionKind, ...] = ("thickness", "chord", "chord-angle", "edge-radius", "edge-thickness", "camber", "twist", "displacement")
SECTIONS: dict[str, Callable[[], NominalProfile]] = {
    "naca 4412": lambda: discretize(profiles.naca("4412"), samples=3000),
    "naca 6409": lambda: discretize(profiles.naca("6409"), samples=3000),
    "round edges": blade,
    "goe404": lambda: nominal_of("goe404"),
}


def asked_of(profile: NominalProfile, types: tuple[SectionKind, ...]) -> tuple[SectionCharacteristic, ...]:
    """Every kind of number of some types, with its usual method."""

    @cache
    def outline() -> Outline:
        return Outline(find_airfoil(profile))

    kinds = (
        SectionCharacteristic("thickness, inscribed", "thickness", "inscribed", -5, 5),
        SectionCharacteristic("thickness, two-point", "thickness", "two-point", -5, 5),
        SectionCharacteristic("chord, tangent", "chord", "tangent", -5, 5),
        SectionCharacteristic("chord, maximum-distance", "chord", "maximum-distance", -5, 5),
        SectionCharacteristic("chord angle, nose-tail", "chord-angle", "nose-tail", -5, 5, datum=HERE),
        SectionCharacteristic("leading radius, 40 deg", "edge-radius", "circle", -5, 5, window_deg=40.0),
        SectionCharacteristic("leading thickness at 5 mm", "edge-thickness", "tip-arc", -5, 5, offset_mm=5.0),
        SectionCharacteristic("camber, inscribed", "camber", "inscribed", -5, 5),
        SectionCharacteristic("twist, best-fit", "twist", "best-fit", -5, 5, datum=HERE),
        SectionCharacteristic("displacement y", "displacement", "best-fit", -5, 5, datum=HERE, axis="y"),
    )
    return tuple(with_nominal(kind, outline) for kind in kinds if kind.type in types)


def judge(
    profile: NominalProfile, points: Array, asked: tuple[SectionCharacteristic, ...], budget: UncertaintyBudget | None
) -> tuple[CharacteristicResult, ...]:
    """What comes of points (m, 2) where the part was measured at its datum."""
    stated = None if budget is None else StatedUncertainty(budget, 1.0)
    live = LiveInspection(profile, ToleranceZone(-0.1, 0.1), fit="none", uncertainty=stated, characteristics=asked, provisional=False)
    live.add(points)
    return live.finish().characteristics


def measured(profile: NominalProfile) -> Array:
    """A part (m, 2) with a form, even along the profile."""
    u = profiles.even_in_arc_length(profile.curve, COUNT)
    s = 2 * np.pi * profile.curve.station_mm(u) / profile.length_mm
    form = 0.02 * np.sin(2 * s + 0.4) + 0.015 * np.cos(5 * s) + 0.01 * np.sin(13 * s + 1)
    return np.asarray(profile.curve.point(u) + form[:, None] * profile.outward * profiles.left_normal(profile.curve, u))


def ratios(profile: NominalProfile, draws: int, rng: np.random.Generator, types: tuple[SectionKind, ...] = TYPES) -> dict[str, float]:
    """What is stated of each number over what it scatters by."""
    asked, points = asked_of(profile, types), measured(profile)
    normal = deviations(points, profile).normal
    values, vectors = np.linalg.eigh(covariance_of_field(points, BUDGET))
    root, drawn = vectors * np.sqrt(np.maximum(values, 0)), np.empty((draws, len(asked)))
    for i in range(draws):
        along = BUDGET.repeatability_mm * rng.normal(0, 1, COUNT) + BUDGET.tip_radius_mm * rng.normal()
        moved = points + root @ rng.normal(0, 1, (COUNT, 2)) + BUDGET.growth * rng.normal() * points + along[:, None] * normal
        drawn[i] = [one.value for one in judge(profile, moved, asked, None)]
    stated = np.array([one.uncertainty for one in judge(profile, points, asked, BUDGET)])
    scatter = drawn.std(axis=0, ddof=1)
    return {one.name: float(ratio) for one, ratio in zip(asked, stated / scatter, strict=True)}


def main() -> int:
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    found = {name: ratios(profile(), draws, np.random.default_rng(31)) for name, profile in SECTIONS.items()}
    sys.stdout.write(f"stated over scatter, {draws} draws\n{'':28}{''.join(f'{name:>14}' for name in found)}\n")
    for kind in next(iter(found.values())):
        sys.stdout.write(f"{kind:28}{''.join(f'{of[kind]:14.2f}' for of in found.values())}\n")
    every = [ratio for of in found.values() for ratio in of.values()]
    sys.stdout.write(f"least {min(every):.2f}, largest {max(every):.2f}\n")
    return 0 if min(every) >= TOO_LITTLE else 1


if __name__ == "__main__":
    sys.exit(main())
