"""Measured point-sets whose true deviations are known: a nominal with form error, a defect, noise and a pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.nominal import NominalProfile
from inspection.rigid import RigidTransform

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SyntheticScan:
    """m section points of a part whose surface is known.

    points_mm    : (m, 2) as measured, in section coordinates
    station_mm   : (m,) where on the nominal each was taken
    deviation_mm : (m,) true signed deviation of each, noise included
    nominal_from_section : the true pose
    """

    points_mm: Array
    station_mm: Array
    deviation_mm: Array
    nominal_from_section: RigidTransform


def even_stations(nominal: NominalProfile, count: int, start: float = 0.0, coverage: float = 1.0) -> Array:
    """Stations (count,) even in arc length over a share of the profile, beginning at a share of its length."""
    whole_loop = nominal.curve.closed and coverage >= 1
    share = start + coverage * np.linspace(0, 1, count, endpoint=not whole_loop)
    return np.mod(share, 1.0) * nominal.length_mm if nominal.curve.closed else np.clip(share, 0, 1) * nominal.length_mm


def stations_even_in_parameter(nominal: NominalProfile, count: int) -> Array:
    """Stations (count,) even in the curve's parameter, as the paper's simulation takes them."""
    start, end = nominal.curve.domain
    return nominal.curve.station_mm(np.linspace(start, end, count, endpoint=not nominal.curve.closed))


def form_error_mm(
    station_mm: Array, length_mm: float, rng: np.random.Generator, amplitude_mm: float, harmonics: tuple[int, ...] = (2, 3, 5)
) -> Array:
    """Smooth form error (m,): a wave of random phase for each number of periods over the length.

    The root sum square of the amplitudes of the waves is `amplitude_mm`.
    """
    share = amplitude_mm / np.sqrt(len(harmonics))
    phases = rng.uniform(0, 2 * np.pi, len(harmonics))
    waves = [np.sin(2 * np.pi * k * station_mm / length_mm + phase) for k, phase in zip(harmonics, phases, strict=True)]
    return np.asarray(share * np.sum(waves, axis=0))


def scan(
    nominal: NominalProfile,
    station_mm: ArrayLike,
    deviation_mm: ArrayLike,
    nominal_from_section: RigidTransform,
    tip_radius_mm: float = 0.0,
) -> SyntheticScan:
    """A scan of a part in that pose: points at stations (m,), off the nominal by their deviations (m,) along the outward normal.

    With a tip radius the points are ball centres.
    """
    station, deviation = np.asarray(station_mm, dtype=np.float64), np.asarray(deviation_mm, dtype=np.float64)
    u = parameter_at(nominal, station)
    point, first = nominal.curve.derivatives(u, 1)
    tangent = first / np.hypot(first[:, 0], first[:, 1])[:, None]
    outward = nominal.outward * np.column_stack([-tangent[:, 1], tangent[:, 0]])
    actual = point + (deviation + tip_radius_mm)[:, None] * outward
    return SyntheticScan(nominal_from_section.inverse().apply(actual), station, deviation, nominal_from_section)


def parameter_at(nominal: NominalProfile, station_mm: Array) -> Array:
    """Curve parameters (m,) at stations (m,), by Newton's iteration on the arc length, started between the nearest samples."""
    curve = nominal.curve
    start, end = curve.domain
    known_s = np.append(nominal.station_mm, curve.length_mm)
    known_u = np.append(nominal.parameter, end)
    order = np.lexsort((known_u, known_s))
    u = np.interp(station_mm, known_s[order], known_u[order])
    for _ in range(4):
        speed = np.hypot(*curve.derivatives(u, 1)[1].T)
        u = np.clip(u - (curve.station_mm(u) - station_mm) / speed, start, end)
    return np.asarray(u)
