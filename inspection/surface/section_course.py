"""Where a plane cuts a nominal surface of any kind, as a course of exact places; measured points are brought along the surface into it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.errors import NominalError
from inspection.surface.feet import FootKind, NominalSurface, SurfaceFeet

Array = NDArray[np.float64]

_STEP = 0.01  # of the size: the longest step along the course
_TURN = 0.99  # cosine of the angle (8 degrees) by which the surface may turn within a step
_SHORTEST = 1e-5  # of the size: steps are not made shorter at corners
_MOST = 20_000  # steps
_ROUNDS = 40
_SETTLED = 1e-10  # of the size: a place is on the surface and in the plane
_ALONG = 1e-4  # below it, sine of the angle between surface and plane squared, they do not cross
_SAMPLED = 20_000
_CORRECTIONS = 3
_TURNS = [sign * angle for angle in range(10, 170, 5) for sign in (1.0, -1.0)]  # degrees tried behind a sharp edge


@dataclass(frozen=True, slots=True, eq=False)
class SectionCourse:
    """The course of a cut.

    places_mm : (k, 3) on the surface and in the plane, in their order; of a closed course the last is not the first
    closed    : whether it comes back to where it began
    error_mm  : how far the straight lines between its places lie off the surface at most, as found in their middles
    """

    places_mm: Array
    closed: bool
    error_mm: float


def course_of_section(nominal: NominalSurface, origin_mm: Array, normal: Array, tolerance_mm: float) -> SectionCourse:
    """Follow the cut of a plane through `origin_mm` that comes nearest to that place. Raises NominalError where there is none.

    normal       : (3,) of length 1
    tolerance_mm : steps are so short that lines between places lie off the surface by less, except within a hair of corners
    """
    cut = _Cut(nominal, origin_mm, normal, tolerance_mm)
    start = cut.nearest()
    one, closed = cut.follow(start, 1.0)
    other = [] if closed else cut.follow(start, -1.0)[0]
    places = np.array([*other[::-1], start, *one])
    return SectionCourse(places, closed, cut.error_between(places, closed))


def into_plane(points_mm: Array, nominal: NominalSurface, origin_mm: Array, normal: Array, within_mm: float) -> tuple[Array, float]:
    """Measured points no farther than `within_mm` from the plane, each moved along the surface into it with its deviation.

    Returns them (k, 3), and by how much the deviation of one changed on the way at most. Where the surface runs along the plane, and beyond
    its borders, points are left out.
    """
    near = points_mm[np.abs((points_mm - origin_mm) @ normal) <= within_mm]
    feet = nominal.project(near)
    usable = _crosses(feet, normal)
    near, deviation = near[usable], feet.distance_mm[usable]
    along, _ = _steps(feet.normal[usable], normal)
    moved = near - ((near - origin_mm) @ normal)[:, None] * along
    for _ in range(_CORRECTIONS):  # the surface is not flat
        feet = nominal.project(moved)
        usable = _crosses(feet, normal)
        moved, deviation = moved[usable], deviation[usable]
        _, across = _steps(feet.normal[usable], normal)
        moved = moved + (deviation - feet.distance_mm[usable])[:, None] * across
    return moved, float(np.abs(nominal.project(moved).distance_mm - deviation).max(initial=0.0))


def _crosses(feet: SurfaceFeet, normal: Array) -> NDArray[np.bool_]:
    """Whether the surface crosses a plane with this normal at feet inside it (m,)."""
    return (1 - (feet.normal @ normal) ** 2 > _ALONG) & (feet.kind < FootKind.BORDER)


def _steps(outward: Array, normal: Array) -> tuple[Array, Array]:
    """The steps from places with outward normals (m, 3): along the surface and up by 1 mm, and in the plane and off the surface by 1 mm."""
    up = (outward @ normal)[:, None]
    return (normal - up * outward) / (1 - up**2), (outward - up * normal) / (1 - up**2)


class _Cut:
    """The walk along the cut of one plane."""

    def __init__(self, nominal: NominalSurface, origin_mm: Array, normal: Array, tolerance_mm: float) -> None:
        self._nominal, self._origin, self._up = nominal, origin_mm, normal
        self._size, self._tolerance = nominal.size_mm, tolerance_mm

    def nearest(self) -> Array:
        """The place of the cut that is nearest to the origin, to the spacing of samples."""
        places, _ = self._nominal.sample(_SAMPLED)
        height = np.abs((places - self._origin) @ self._up)
        near = places[height <= max(float(np.partition(height, 50)[50]), _STEP * self._size)]
        order = np.argsort(np.linalg.norm(near - self._origin, axis=1), kind="stable")
        for place in near[order[:200]]:
            found = self._onto(place)
            if found is not None:
                return found[0]
        raise NominalError("the plane does not cut the nominal surface; expected a place of it, and a direction across its normal there")

    def follow(self, start: Array, sense: float) -> tuple[list[Array], bool]:
        """Walk from a place until the course comes back or ends at a border; the places behind the start, and whether it came back."""
        found = self._onto(start)
        assert found is not None
        here, outward = found
        places: list[Array] = []
        longest = step = _STEP * self._size
        gone, began = 0.0, self._direction(outward, sense)
        ahead = began
        while len(places) < _MOST:
            there = self._onto(here + step * ahead)
            turned = -1.0 if there is None else float(there[1] @ outward)
            moved = np.zeros(3) if there is None else there[0] - here
            bad = there is None or turned < _TURN or moved @ ahead < 0.3 * step or self._sag(here, there[0]) > self._tolerance
            if bad and step > _SHORTEST * self._size:
                step /= 2
                continue
            if there is None or np.linalg.norm(moved) < 0.1 * step:
                there = self._around(here, ahead)
                if there is None:
                    return places, False  # a border
                moved, turned = there[0] - here, -1.0
            back = start - here
            if gone > 2 * longest and np.linalg.norm(back) <= np.linalg.norm(moved) * 1.5 and back @ ahead > 0:
                return places, True
            gone += float(np.linalg.norm(moved))
            here, outward = there
            ahead = moved / np.linalg.norm(moved) if turned < _TURN else self._direction(outward, sense)
            places.append(here)
            step = min(2 * step, longest)
        raise NominalError(f"the cut of the plane has more than {_MOST} steps: the surface is too rough for a section")

    def _around(self, here: Array, ahead: Array) -> tuple[Array, Array] | None:
        """A place a little farther behind a sharp edge, whichever way the course turns there; None at a border."""
        short = 10 * _SHORTEST * self._size
        if self._nominal.project((here + short * ahead)[None]).kind[0] >= FootKind.BORDER:
            return None
        aside = np.cross(self._up, ahead)
        for angle in np.radians(_TURNS):
            direction = np.cos(angle) * ahead + np.sin(angle) * aside
            there = self._onto(here + short * direction)
            if there is not None and (there[0] - here) @ direction > 0.9 * short:
                return there
        return None

    def error_between(self, places: Array, closed: bool) -> float:
        """How far the middles of the lines between places lie off the surface at most."""
        following = np.roll(places, -1, axis=0) if closed else places[1:]
        middles = (places[: len(following)] + following) / 2
        return float(np.abs(self._nominal.project(middles).distance_mm).max(initial=0.0))

    def _sag(self, here: Array, there: Array) -> float:
        return float(np.abs(self._nominal.project(((here + there) / 2)[None]).distance_mm[0]))

    def _direction(self, outward: Array, sense: float) -> Array:
        ahead = np.cross(self._up, outward)
        return np.asarray(sense * ahead / np.linalg.norm(ahead))

    def _onto(self, place: Array) -> tuple[Array, Array] | None:
        """The place of surface and plane near another one, and the outward normal there; None where they do not meet near it."""
        here = place - ((place - self._origin) @ self._up) * self._up
        for _ in range(_ROUNDS):
            feet = self._nominal.project(here[None])
            foot, outward = feet.foot_mm[0], feet.normal[0]
            height, up = float((foot - self._origin) @ self._up), float(outward @ self._up)
            if 1 - up**2 <= _ALONG:
                return None
            following = foot - height * (self._up - up * outward) / (1 - up**2)
            if abs(height) <= _SETTLED * self._size:
                return (following, outward) if feet.kind[0] < FootKind.BORDER or np.linalg.norm(here - foot) < 1e-7 * self._size else None
            here = following
        return None
