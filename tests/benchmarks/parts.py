"""The parts that benchmarks of registration measure: nominals, actual parts with known errors, and the true best pose.

The true best pose is found with the tests' closest point, which shares no code with the inspection.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from inspection import NominalProfile, NurbsCurve, RigidTransform, discretize
from inspection.synthetic import SyntheticScan, form_error_mm, scan
from tests.inspection import profiles
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import Array

SAMPLES = 10_000
AIRFOIL_CHORD_MM = 60.0
FORM_MM = ((0.020, (2,)), (0.010, (5,)))  # amplitude and waves around: what METHOD's cross-sections have
NOISE_MM, NOISE_REACH_MM = 0.0065, 0.05  # of a CT surface: standard deviation, and over what length neighbours share it


@dataclass(frozen=True, slots=True)
class Missing:
    """A profile that cannot be measured here, and why."""

    reason: str


def airfoil(path: Path, chord_mm: float = AIRFOIL_CHORD_MM) -> NurbsCurve | Missing:
    """Open curve through the coordinates of a UIUC file (Selig order), or why there is none."""
    if not path.is_file():
        return Missing(f"no {path.name}: airfoil files are not shipped but looked for beside the checkout; --mh42 FILE names that of MH 42")
    return profiles.through_airfoil(chord_mm * np.loadtxt(path, skiprows=1), chord_mm)


def curves(mh42: Path | None = None) -> dict[str, NurbsCurve | Missing]:
    """Six profiles: three of the published kind, two airfoils it used, and a computed one with a sharp trailing edge."""
    return {
        "P1": profiles.p1(),
        "P2": profiles.p2(),
        "P3": profiles.p3(),
        "GOE404": airfoil(profiles.AIRFOILS / "goe404.dat"),
        "MH42": airfoil(mh42 or profiles.AIRFOILS / "mh42.dat"),
        "NACA 2412 sharp": profiles.naca("2412", AIRFOIL_CHORD_MM),
    }


def nominals(mh42: Path | None = None) -> dict[str, NominalProfile | Missing]:
    """The six profiles with 10,000 samples each, as the paper has them."""
    return {name: curve if isinstance(curve, Missing) else nominal(curve) for name, curve in curves(mh42).items()}


def nominal(curve: NurbsCurve) -> NominalProfile:
    """With the published number of samples, even in the parameter."""
    return discretize(curve, samples=SAMPLES, step_min=1 / SAMPLES)


def cross_section(
    profile: NominalProfile,
    station_mm: Array,
    pose: RigidTransform,
    rng: np.random.Generator,
    form_mm: tuple[tuple[float, tuple[int, ...]], ...] = FORM_MM,
) -> SyntheticScan:
    """A section of a part with waves of 20 and 10 um around it and correlated noise of 6.5 um, seen in that pose."""
    form = sum((form_error_mm(station_mm, profile.length_mm, rng, size, waves) for size, waves in form_mm), np.zeros(len(station_mm)))
    return scan(profile, station_mm, form + _noise(len(station_mm), profile, rng), pose)


def _noise(count: int, profile: NominalProfile, rng: np.random.Generator) -> Array:
    white = rng.normal(0, 1, count)
    smooth = gaussian_filter1d(white, NOISE_REACH_MM / (profile.length_mm / count), mode="wrap")
    return np.asarray(NOISE_MM * smooth / smooth.std())


def random_pose(rng: np.random.Generator) -> RigidTransform:
    """Any rotation, up to 100 mm of translation along each axis."""
    return RigidTransform(float(rng.uniform(-np.pi, np.pi)), rng.uniform(-100, 100, 2))


def best_place(curve: NurbsCurve, placed_mm: Array) -> tuple[Array, float]:
    """Points (m, 2) moved to their least-squares pose, and the mean square there, mm^2; they start near it.

    Gauss-Newton on the independent distances until the gradient vanishes to the last digit; points beyond ends take no part.
    """
    place = placed_mm
    for _ in range(15):
        closest = closest_point(curve, place)
        e, used = closest.left_mm, ~closest.beyond_end
        off = np.abs(e) > 1e-6
        gradient = np.where(
            off[:, None], (place - closest.foot_mm) / np.where(off, e, 1.0)[:, None], profiles.left_normal(curve, closest.parameter)
        )
        centre = place.mean(axis=0)
        arm = place - centre
        J = np.column_stack([gradient, arm[:, 0] * gradient[:, 1] - arm[:, 1] * gradient[:, 0]])[used]
        step = np.linalg.solve(J.T @ J, J.T @ e[used])
        place = profiles.rotated(arm, -np.rad2deg(step[2])) + centre - step[:2]
        if np.abs(step[:2]).max() + abs(step[2]) * np.abs(arm).max() < 1e-12:
            break
    else:
        raise ArithmeticError("the independent optimum did not settle")
    return place, float(np.mean(e[used] ** 2))


def farthest_mm(pose: RigidTransform, points_mm: Array, place_mm: Array) -> float:
    """How far the pose puts any of the points from where it belongs."""
    return float(np.hypot(*(pose.apply(points_mm) - place_mm).T).max())
