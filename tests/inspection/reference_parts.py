"""The reference parts: airfoils from their files with a form without random numbers, for which other programs have found the answers."""

from functools import cache

import numpy as np

from inspection import NominalProfile, NurbsCurve, RigidTransform, discretize
from tests.inspection import profiles
from tests.inspection.profiles import AIRFOILS, Array


@cache
def nominal_of(name: str) -> NominalProfile:
    points = np.loadtxt(AIRFOILS / f"{name}.dat", skiprows=1) * 100.0
    return discretize(NurbsCurve.interpolate(points, closed=True) if name == "closed" else airfoil(points), samples=3000)


def airfoil(points: Array) -> NurbsCurve:
    """The profile as the command line reads it: a cubic through the points, joined to itself."""
    from cmmlink.nominal_files.through_points import through_points

    return through_points(points, np.arange(1, len(points) + 1), True, "uiuc-selig", ()).curve


def scan(name: str, count: int, form: Array, turned_deg: float, shift: tuple[float, float]) -> Array:
    """Points at the middles of `count` equal shares of the length, moved by `form` along the outward normal, then turned and shifted."""
    nominal = nominal_of(name)
    curve = nominal.curve
    u = profiles.even_in_arc_length(curve, 2 * count + 1)[1::2] if not curve.closed else middles(curve, count)
    normal = nominal.outward * profiles.left_normal(curve, u)
    return RigidTransform(np.radians(turned_deg), np.array(shift)).apply(curve.point(u) + form[:, None] * normal)


def middles(curve: NurbsCurve, count: int) -> Array:
    """Parameters at the middles of equal shares of the length, by Newton steps on the arc length."""
    wanted = (np.arange(count) + 0.5) / count * curve.length_mm
    u = np.linspace(*curve.domain, 20_001)
    station = curve.station_mm(u)
    station[-1] = curve.length_mm
    u = np.interp(wanted, station, u)
    for _ in range(4):
        u = u - (curve.station_mm(u) - wanted) / np.hypot(*curve.derivatives(u, 1)[1].T)
    return np.asarray(u)


def stations(name: str, count: int) -> Array:
    return (np.arange(count) + 0.5) / count * nominal_of(name).curve.length_mm


def reference_form(name: str, count: int) -> Array:
    s = 2 * np.pi * stations(name, count) / nominal_of(name).curve.length_mm
    return 0.02 * np.sin(2 * s + 0.4) + 0.015 * np.cos(5 * s) + 0.01 * np.sin(13 * s + 1)
