"""The uncertainty of a number of a section from the budget of the run, by its sensitivities, linearised at the nominal section.

An error of the device is as stated over a length: two places differ by (A + L/K) / sqrt(3). Its part that is independent from place to
place is not taken to average over neighbouring points. Noise averages as far as the spline that draws the section lets it, and no farther
than where it leaves most. Places and angles by the best fit have the uncertainty of its pose in closed form.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.actual import ActualSection, knots_on
from inspection.characteristics.characteristic import SectionCharacteristic
from inspection.characteristics.error_fields import ENDS, Sensitivities, ValueSensitivity
from inspection.evaluation.basis import Basis
from inspection.freedoms import Freedoms
from inspection.profile_uncertainty import StatedUncertainty
from inspection.rigid import RigidTransform
from inspection.uncertainty import deviation_uncertainty

Array = NDArray[np.float64]

LINEARISED = "U is that of the budget, linearised at the nominal section"
OF_POSE = "U is that of the budget, by the covariance of the best fit"

_BETWEEN = 1.25  # noise that is drawn at knots is smaller between two of them, by so much at most


def uncertainty_of_value(found: Sensitivities, is_known: bool, basis: Basis, actual: ActualSection, stated: StatedUncertainty) -> float:
    """U of a number that was measured on the actual section, in its unit.

    is_known : it is counted from a known pose; otherwise a free fit has taken a part of every error away
    """
    known = basis.terms.known_pose or RigidTransform.identity()
    of = found.known if is_known else found.fitted
    growth = of.growth + float(np.dot(of.shift, found.middle_mm - known.apply(np.array([stated.fixed_mm]))[0]))
    noise = _noise(of, actual, is_round=actual.nominal.trailing == "round")
    standard = _standard(of, growth, noise, basis.nominal.size_mm, stated)
    return stated.coverage_factor * standard + abs(growth * stated.budget.growth_left)


class _Noise(NamedTuple):
    """What a unit of noise does to a number: of points, as far as the spline leaves it, and of places, which does not average."""

    of_points: float
    of_places: float


def _noise(of: ValueSensitivity, actual: ActualSection, is_round: bool) -> _Noise:
    """By the largest noise that the spline leaves at a knot that was measured; at the ends of the outline by that of each knot there.

    The knots of an end follow the same few points, so that what is left there adds up.
    """
    left, (stations, _) = actual.noise.value, knots_on(actual.nominal)
    unseen = np.any((stations[:, None] > actual.unseen_mm[:, 0]) & (stations[:, None] < actual.unseen_mm[:, 1]), axis=1)
    inside = float(left[ENDS:-ENDS][~unseen[ENDS:-ENDS]].max(initial=0.0))
    at_ends = np.full(2 * ENDS, inside) if is_round else left[np.arange(-ENDS, ENDS)]
    found = []
    for at_least in (0.0, 1.0):
        ends = (np.maximum(at_ends, at_least) * np.abs(of.ends)).reshape(2, ENDS).sum(axis=1)
        found.append(float(np.hypot(np.hypot(*ends), max(inside, at_least) * _BETWEEN * of.single)))
    return _Noise(*found)


def _standard(of: ValueSensitivity, growth: float, noise: _Noise, size_mm: float, stated: StatedUncertainty) -> float:
    """The combined standard uncertainty."""
    budget = stated.budget
    A, share = budget.mpe_mm, budget.mpe_share
    shared = float(np.sum(np.square(of.shift))) * (A + share * size_mm) ** 2 / 3
    apart = noise.of_places**2 * A**2 / 6 + of.grown**2 * A * share / 3 + float(np.sum(np.square(of.strain))) * share**2 / 3
    points = (budget.repeatability_mm * noise.of_points) ** 2
    return math.sqrt(points + shared + apart + (of.tip * budget.tip_radius_mm) ** 2 + (growth * budget.growth) ** 2)


def uncertainty_of_placing(
    asked: SectionCharacteristic, basis: Basis, fit: RigidTransform, moved: Array, stated: StatedUncertainty
) -> float:
    """U of a rotation in degrees, or of a displacement in mm, that the best fit of all points gives.

    fit   : nominal from section; moved : (2,) the direction of the displacement that is asked for, any length; zero for the worst one
    """
    points = fit.apply(basis.result.section_at(basis.few(basis.rows(None))))
    free = Freedoms.about(asked.place_mm)
    known = asked.datum or RigidTransform.identity()
    fixed = known.apply(np.array([stated.fixed_mm]))[0]
    terms = basis.terms
    found = deviation_uncertainty(
        points, basis.nominal, stated.budget, free, fixed_mm=fixed, tip_radius_mm=terms.tip_radius_mm, weights=terms.weights
    )
    left = found.grown * stated.budget.growth_left
    if asked.type == "twist":
        return math.degrees(stated.coverage_factor * math.sqrt(found.covariance[2, 2]) + abs(float(left[2])))
    P, length = found.covariance[:2, :2], float(np.hypot(*moved))
    variance = float(moved @ P @ moved) / length**2 if length > 0 else float(np.linalg.eigvalsh(P).max())
    return stated.coverage_factor * math.sqrt(variance) + float(np.hypot(*left[:2]))
