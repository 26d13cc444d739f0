"""The course of a nominal's curve as pictures show it: points dense enough to be drawn, and arrows along its direction of travel."""

import numpy as np
from numpy.typing import NDArray

from inspection import NurbsCurve

Array = NDArray[np.float64]

_ARROWS = 8
_A_STEP = 2e-3  # of the length: how far the tip of an arrow lies from its foot
_SAMPLES_OF_A_SPAN = 24
_MOST_SAMPLES = 100_000


def points_along(curve: NurbsCurve) -> Array:
    """Points (m, 2) of the curve, dense enough in every span of its knots to be drawn."""
    spans = np.unique(np.clip(curve.knots, *curve.domain))
    each = max(2, min(_SAMPLES_OF_A_SPAN, _MOST_SAMPLES // len(spans)))
    inside = (spans[:-1, None] + np.diff(spans)[:, None] * np.linspace(0, 1, each, endpoint=False)).ravel()
    return curve.point(np.append(inside, spans[-1]))


def arrows_along(curve: NurbsCurve) -> tuple[Array, Array]:
    """Feet and tips (a, 2) of short arrows, evenly along the curve."""
    u = np.linspace(*curve.domain, 4001)
    stations = curve.station_mm(u)
    stations[-1] = curve.length_mm  # of a closed curve the last parameter is the first
    wanted = curve.length_mm * (np.arange(_ARROWS) + 0.5) / _ARROWS
    step = _A_STEP * curve.length_mm
    feet, tips = (curve.point(np.interp(wanted + shift, stations, u)) for shift in (-step, step))
    return feet, tips
