"""What a nominal curve is checked for before anything is judged by it: crossings, changes of curvature, its tightest hollow."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve
from inspection.methods import Material
from inspection.self_crossings import Crossing, find_crossings

Array = NDArray[np.float64]

_STRAIGHT = 1e-9  # curvature times size: less is round-off of a straight line, and has no sign
_NODES = (np.arange(16) + 0.5) / 16  # inside a knot span, never on its borders, where the curvature may jump
_HALVINGS = 50
_CLOSER_LOOKS = 5
_LOOK = np.linspace(-1, 1, 65)


@dataclass(frozen=True, slots=True)
class Hollow:
    """The tightest hollow of a profile: a ball of a larger radius does not reach the material there."""

    radius_mm: float
    station_mm: float
    x_mm: float
    y_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class CurveCheck:
    """What was found on a curve.

    crossings       : the places at which it crosses or touches itself, by their first station
    sign_changes_mm : (s,) stations at which its curvature changes the sign between two corners
    hollow          : its tightest hollow; None when it is convex throughout, or when the side of the material is not known
    """

    crossings: tuple[Crossing, ...]
    sign_changes_mm: Array
    hollow: Hollow | None

    def __post_init__(self) -> None:
        self.sign_changes_mm.setflags(write=False)


def check_curve(curve: NurbsCurve, material: Material | None) -> CurveCheck:
    """Check a curve whose material lies on the side named. Raises NominalError where the curve stands still."""
    crossings = find_crossings(curve)
    u, curvature = _sampled_curvature(curve)
    return CurveCheck(crossings, _sign_changes(curve, u, curvature), None if material is None else _hollow(curve, u, curvature, material))


def _sampled_curvature(curve: NurbsCurve) -> tuple[Array, Array]:
    """Rising parameters (n,) inside the knot spans, and the curvature there, exactly 0 where the curve is straight."""
    start, end = curve.domain
    knots = np.unique(np.clip(curve.knots, start, end))
    u = (knots[:-1, None] + np.diff(knots)[:, None] * _NODES).ravel()
    return u, _curvature(curve, u)


def _curvature(curve: NurbsCurve, u: Array) -> Array:
    curvature = curve.curvature(u)
    return np.where(np.abs(curvature) * np.ptp(curve.control_points_mm, axis=0).max() < _STRAIGHT, 0.0, curvature)


def _sign_changes(curve: NurbsCurve, u: Array, curvature: Array) -> Array:
    """Stations (s,) of the changes of sign, by bisection; on a straight stretch between two bends, its middle."""
    start, end = curve.domain
    bent = curvature != 0
    u, sign = u[bent], np.sign(curvature[bent])
    if curve.closed and len(u):
        u, sign = np.append(u, u[0] + end - start), np.append(sign, sign[0])
    low, high, before = u[:-1], u[1:], sign[:-1]
    changes = sign[1:] != before
    corners = np.concatenate([curve.corners, curve.corners + end - start])
    changes &= ~np.any((low[:, None] <= corners) & (corners <= high[:, None]), axis=1)
    low, high, before = low[changes], high[changes], before[changes]
    first, last = _end_of_sign(curve, low, high, before), _end_of_sign(curve, high, low, -before)
    return np.sort(curve.station_mm((first + last) / 2)) if len(low) else np.zeros(0)


def _end_of_sign(curve: NurbsCurve, inside: Array, outside: Array, sign: Array) -> Array:
    """Parameters (s,) up to which the curvature has the sign that it has inside, on the way to outside."""
    for _ in range(_HALVINGS if len(inside) else 0):
        middle = (inside + outside) / 2
        same = np.sign(_curvature(curve, middle)) == sign
        inside, outside = np.where(same, middle, inside), np.where(same, outside, middle)
    return inside


def _hollow(curve: NurbsCurve, u: Array, curvature: Array, material: Material) -> Hollow | None:
    """The place where the curve bends most towards the outside, looked at ever closer."""
    outward = -1.0 if material == "left" else 1.0
    best = float(u[np.argmax(curvature * outward)])
    reach = float(np.diff(u).max())
    for _ in range(_CLOSER_LOOKS):
        near = np.clip(best + reach * _LOOK, *curve.domain)
        best = float(near[np.argmax(_curvature(curve, near) * outward)])
        reach *= 2 * float(_LOOK[1] - _LOOK[0])
    at = np.array([best])
    tightest = float(_curvature(curve, at)[0]) * outward
    if tightest <= 0:
        return None
    (x, y), station = curve.point(at)[0], curve.station_mm(at)[0]
    return Hollow(1 / tightest, float(station), float(x), float(y))
