"""Where a characteristic of the profile begins and ends: by station, by the nearest nominal point, or by the features of an airfoil."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.characteristics.characteristic import Region
from inspection.characteristics.outline import AirfoilSection, Edge, find_airfoil
from inspection.nominal import NominalProfile
from inspection.signed_deviations import deviations

Array = NDArray[np.float64]
FeatureName = Literal["LE", "TE", "UPPER", "LOWER"]

_ROUNDING = 1e-12  # of the profile's length: stations nearer than this are one
_ONE_SIDE = 0.499  # of the outline: what lies around an edge meets itself on the other side of the section


@dataclass(frozen=True, slots=True)
class Features:
    """Stations in mm of the features of an airfoil section.

    nose        : of the leading edge, LE
    first, last : of both ends of the outline at the trailing edge, TE; one station on a sharp or round edge
    upper_first : the side from the trailing to the leading edge, with rising stations, is the upper one
    length_mm   : of the whole profile, and whether it is `closed`
    """

    nose: float
    first: float
    last: float
    upper_first: bool
    length_mm: float
    closed: bool

    def side(self, name: Literal["UPPER", "LOWER"]) -> Region:
        """A side of the section, from edge to edge."""
        return Region(self.first, self.nose) if (name == "UPPER") == self.upper_first else Region(self.nose, self.last)

    def edge(self, name: Literal["LE", "TE"], within_mm: float) -> Region:
        """An edge, so far to either side along the profile. Raises ValueError for the two ends of an open profile."""
        if name == "LE":
            return _region(self, self.nose - within_mm, self.nose + within_mm)
        if not self.closed:
            raise ValueError("the trailing edge of an open profile is its two ends: give from and to for either")
        flat = (self.first - self.last) % self.length_mm
        return _region(self, self.last - within_mm, self.last + flat + within_mm)


def features_of(nominal: NominalProfile, section: AirfoilSection | None = None) -> Features:
    """The features of the airfoil that a nominal draws, or of the one that was found on it. Raises NominalError where it draws none."""
    section = section or find_airfoil(nominal)
    stations = section.curve.station_mm(np.array([section.nose, section.first, section.last]))
    nose, first, last = (float(station) for station in stations)
    if section.trailing in ("round", "sharp"):
        last = first  # one place, of which a station a hair apart would make its flat the whole way around
    if not nominal.curve.closed:
        last = nominal.length_mm
    return Features(nose, first, last, section.upper_first, nominal.length_mm, nominal.curve.closed)


def station_near(nominal: NominalProfile, place_mm: ArrayLike) -> float:
    """Station of the nominal point nearest to a place (2,)."""
    return float(deviations(np.asarray(place_mm, dtype=np.float64)[None], nominal).station_mm[0])


def region_between(nominal: NominalProfile, from_mm: float, to_mm: float) -> Region:
    """The region with rising stations from one to another. Raises ValueError for stations that are none, and for a region of no length."""
    length = nominal.length_mm
    for station in (from_mm, to_mm):
        if not nominal.curve.closed and not -1e-9 * length <= station <= length * (1 + 1e-9):
            raise ValueError(f"a station from 0 to {length:.6g} mm, the length of the profile, not {station:.6g}")
    if not nominal.curve.closed and from_mm >= to_mm:
        raise ValueError(f"a region of an open profile runs with rising stations, not from {from_mm:.6g} to {to_mm:.6g} mm")
    if nominal.curve.closed:
        from_mm, to_mm = from_mm % length, to_mm % length
        if from_mm == to_mm:
            raise ValueError(f"the region begins where it ends, at station {from_mm:.6g} mm")
    return Region(from_mm, to_mm)


def is_inside(station_mm: Array, region: Region, nominal: NominalProfile) -> NDArray[np.bool_]:
    """Which stations (m,) lie in a region, its ends included; NaN lies in none. On a closed profile 0 and its length are one station.

    What lies on the border of two regions is in both, so that the stricter of their zones holds there, also where round-off tells
    the station of a corner, at which many points may have their foot, a little otherwise than that of the border.
    """
    length, slack = nominal.length_mm, _ROUNDING * nominal.length_mm
    ahead, span = station_mm - region.from_mm + slack, region.to_mm - region.from_mm
    if nominal.curve.closed:
        ahead, span = np.mod(ahead, length), span % length or length
    return np.asarray((ahead >= 0) & (ahead <= span + 2 * slack))


def _region(features: Features, from_mm: float, to_mm: float) -> Region:
    """A region around an edge, which may cross the seam."""
    if to_mm - from_mm >= features.length_mm:
        raise ValueError(f"the region around the edge is longer than the profile, {features.length_mm:.6g} mm")
    if features.closed:
        return Region(from_mm % features.length_mm, to_mm % features.length_mm)
    return Region(max(from_mm, 0.0), min(to_mm, features.length_mm))


def region_around(features: Features, edge: Edge, stations_mm: Array, at_least_mm: float) -> tuple[Region, ...]:
    """The stretches around an edge that stations (k,) on both sides of it bound; so far to either side of the tip at least.

    Of the trailing edge of an open profile these are two, at its ends.
    """
    length = features.length_mm
    if edge == "trailing" and not features.closed:
        low = stations_mm[stations_mm < features.nose].max(initial=at_least_mm)
        high = stations_mm[stations_mm > features.nose].min(initial=length - at_least_mm)
        return Region(0.0, float(low)), Region(float(high), length)
    before, behind = (features.nose, features.nose) if edge == "leading" else (features.last, features.first)

    def beyond(tip: float) -> Array:
        off = stations_mm - tip
        return np.mod(off + length / 2, length) - length / 2 if features.closed else off

    flat = (behind - before) % length if features.closed else 0.0
    most = (length - flat) * _ONE_SIDE
    reach_before = min(float((-beyond(before)).max(initial=at_least_mm)), most)
    reach_behind = min(float(beyond(behind).max(initial=at_least_mm)), most)
    return (_region(features, before - reach_before, before + flat + reach_behind),)
