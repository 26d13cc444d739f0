"""The chord of a section, by named methods. They differ by up to half a percent, so that a chord without its method is no value.

nose-tail         distance of the two places where the camber line leaves the section
tangent           length of the section along its nose-tail line, between the two tangents square to that line
caliper           length along the flat that the hollow side is laid on, which touches it twice; convex sections have none
x-extent          length along the x axis of the nominal
minimum-circle    diameter of the smallest circle around the section
maximum-distance  largest distance of two of its places
The names follow PC-DMIS Blade (NOSETAIL, TANGENT, CALIPER, XAXIS, MINCIRCLE). A chord angle is that of the direction from the leading to
the trailing edge, anticlockwise from the x axis.
"""

from itertools import combinations
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.inscribed import CamberLine
from inspection.characteristics.outline import AirfoilSection
from inspection.characteristics.section_value import SectionValue, angle_of
from inspection.characteristics.zoom import find_maximum
from inspection.errors import InspectionError

Array = NDArray[np.float64]
ChordMethod = Literal["nose-tail", "tangent", "caliper", "x-extent", "minimum-circle", "maximum-distance"]
ChordAngleMethod = Literal["nose-tail", "caliper", "maximum-distance"]

_ROUNDS = 30
_SHORTEST_FLAT = 0.3  # of the section's length: a shorter double tangent bridges a ripple, not the hollow side
_SETTLED = 1e-13  # of the section's length


def chord(section: AirfoilSection, camber: CamberLine, method: ChordMethod = "tangent") -> SectionValue:
    """The chord length in mm. Its places are two, of the leading and of the trailing edge, but for a circle that three places hold.

    Raises InspectionError for `caliper` on a section without a hollow side.
    """
    if method == "nose-tail":
        return _between("nose-tail", camber.nose_mm, camber.tail_mm)
    if method == "tangent":
        return _extent(section, method, camber.tail_mm - camber.nose_mm)
    if method == "caliper":
        leading, trailing = _flat(section)
        return _extent(section, method, trailing - leading)
    if method == "x-extent":
        return _extent(section, method, np.array([1.0 if camber.tail_mm[0] >= camber.nose_mm[0] else -1.0, 0.0]))
    if method == "maximum-distance":
        return _between(method, *_leading_first(section, *_farthest_pair(section)))
    if method == "minimum-circle":
        return _smallest_circle(section)
    raise ValueError(f"the method must be one of {', '.join(get_args(ChordMethod))}, not {method!r}")


def chord_angle(section: AirfoilSection, camber: CamberLine, method: ChordAngleMethod = "nose-tail") -> SectionValue:
    """The angle of the chord in degrees, from leading to trailing edge, by nose and tail, by the flat, or by the farthest pair."""
    if method == "nose-tail":
        leading, trailing = camber.nose_mm, camber.tail_mm
    elif method == "caliper":
        leading, trailing = _flat(section)
    elif method == "maximum-distance":
        leading, trailing = _leading_first(section, *_farthest_pair(section))
    else:
        raise ValueError(f"the method must be one of {', '.join(get_args(ChordAngleMethod))}, not {method!r}")
    places = np.vstack([leading, trailing])
    return SectionValue("chord angle", method, angle_of(trailing - leading), "deg", places, ("leading", "trailing"))


def _between(method: str, leading: Array, trailing: Array) -> SectionValue:
    """The chord from one place (2,) to another."""
    length = float(np.hypot(*(trailing - leading)))
    return SectionValue("chord", method, length, "mm", np.vstack([leading, trailing]), ("leading", "trailing"))


def _extent(section: AirfoilSection, method: str, direction: Array) -> SectionValue:
    """How long the section is in a direction (2,) that points from the leading to the trailing edge."""
    along = direction / np.hypot(*direction)
    places = section.point(np.array([section.support(-along), section.support(along)]))
    return SectionValue("chord", method, float((places[1] - places[0]) @ along), "mm", places, ("leading", "trailing"))


def _leading_first(section: AirfoilSection, one: Array, other: Array) -> tuple[Array, Array]:
    """Two places (2,), the one that is nearer to the nose first."""
    nose = section.points_mm[section.nose_sample]
    return (one, other) if np.hypot(*(one - nose)) <= np.hypot(*(other - nose)) else (other, one)


# --- the flat: the hollow side's double tangent -------------------------------------------------------------------------


def _flat(section: AirfoilSection) -> tuple[Array, Array]:
    """The two places (2,), leading first, at which a flat touches the hollow side.

    It begins at the longest edge of the convex hull. Then the places are moved to those that reach farthest square to the line between
    them, and so on: the line changes by the square of what the places still had to go.
    """
    start = _longest_hull_edge(section)
    if start is None:
        raise InspectionError(
            "no flat touches the section at two places: it has no hollow side, and so no caliper chord; choose another method"
        )
    at = np.array([section.parameter[k] for k in start])
    for _ in range(_ROUNDS):
        one, other = section.point(at)
        across = np.array([-(other - one)[1], (other - one)[0]]) / np.hypot(*(other - one))
        if (section.points_mm - one).mean(axis=0) @ across > 0:
            across = -across
        moved = np.array([_reach_beside(section, u, across) for u in at])
        step = np.abs(section.point(moved) - section.point(at)).max()
        at = moved
        if step < _SETTLED * section.length_mm:
            break
    return _leading_first(section, *section.point(at))


def _reach_beside(section: AirfoilSection, u: float, direction: Array) -> float:
    """The parameter within two samples of u at which the outline reaches farthest in a direction (2,)."""
    near = int(np.argmin(np.abs(section.parameter - u)))
    low, high = section.neighbourhood(max(near - 1, 0))[0], section.neighbourhood(min(near + 1, len(section.parameter) - 1))[1]
    origin = section.points_mm[near]  # heights above a place nearby lose no digits
    return find_maximum(lambda at: (section.point(at) - origin) @ direction, low, high)


def _longest_hull_edge(section: AirfoilSection) -> tuple[int, int] | None:
    """The samples at the ends of the longest hull edge that bridges a hollow; None where there is none but at the trailing edge."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - it takes half a second, and a plan knows only names of this file

    points = section.points_mm
    last = len(points) - 1
    edges = np.sort(ConvexHull(points).simplices, axis=1)
    bridging = edges[(edges[:, 1] - edges[:, 0] > 1) & ~((edges[:, 0] <= 1) & (edges[:, 1] >= last - 1))]
    if not len(bridging):
        return None
    lengths = np.hypot(*(points[bridging[:, 1]] - points[bridging[:, 0]]).T)
    best = int(np.argmax(lengths))
    return (int(bridging[best, 0]), int(bridging[best, 1])) if lengths[best] > _SHORTEST_FLAT * section.length_mm else None


# --- farthest places and the smallest circle ----------------------------------------------------------------------------


def _farthest_from(section: AirfoilSection, place: Array) -> Array:
    """The place (2,) of the outline that is farthest from another (2,)."""
    best = int(np.argmax(np.hypot(*(section.points_mm - place).T)))
    u = find_maximum(lambda at: np.hypot(*(section.point(at) - place).T), *section.neighbourhood(best))
    return np.asarray(section.point(np.array([u]))[0])


def _farthest_pair(section: AirfoilSection) -> tuple[Array, Array]:
    """The two places (2,) of the outline that are farthest apart."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - it takes half a second, and a plan knows only names of this file

    hull = section.points_mm[ConvexHull(section.points_mm).vertices]
    x, y = hull[:, None, 0] - hull[None, :, 0], hull[:, None, 1] - hull[None, :, 1]
    apart = x * x + y * y
    one, other = hull[np.array(np.unravel_index(np.argmax(apart), apart.shape))]
    for _ in range(_ROUNDS):
        before = np.hypot(*(one - other))
        one = _farthest_from(section, other)
        other = _farthest_from(section, one)
        if np.hypot(*(one - other)) - before <= _SETTLED * section.length_mm:
            break
    return one, other


def _smallest_circle(section: AirfoilSection) -> SectionValue:
    """The smallest circle around the section: held by few places, to which the farthest place outside is added until none is outside."""
    held = np.vstack(_farthest_pair(section))
    for _ in range(_ROUNDS):
        centre, radius, held = _circle_around(held)
        farthest = _farthest_from(section, centre)
        if np.hypot(*(farthest - centre)) - radius <= _SETTLED * section.length_mm:
            break
        held = np.vstack([held, farthest])
    nose = section.points_mm[section.nose_sample]
    held = held[np.argsort(np.hypot(*(held - nose).T))]
    names = (*(f"contact {k + 1}" for k in range(len(held))), "centre")
    return SectionValue("chord", "minimum-circle", 2 * radius, "mm", np.vstack([held, centre]), names)


def _circle_around(points: Array) -> tuple[Array, float, Array]:
    """Centre (2,), radius and the two or three holding places of the smallest circle around a few points (n, 2)."""
    best: tuple[Array, float, Array] | None = None
    for size in (2, 3):
        for chosen in combinations(range(len(points)), size):
            held = points[list(chosen)]
            centre = held.mean(axis=0) if size == 2 else _circumcentre(held)
            if centre is None:
                continue
            radius = float(np.hypot(*(held[0] - centre)))
            outside = np.hypot(*(points - centre).T).max() - radius
            if outside <= 1e-14 * radius and (best is None or radius < best[1]):
                best = centre, radius, held
    assert best is not None  # two places at least, and every finite set has a smallest circle
    return best


def _circumcentre(three: Array) -> Array | None:
    """Centre (2,) of the circle through three places (3, 2); None where they lie on a line."""
    a, b = three[1] - three[0], three[2] - three[0]
    cross = a[0] * b[1] - a[1] * b[0]
    if abs(cross) <= 1e-14 * (a @ a + b @ b):
        return None
    return np.asarray(three[0] + np.array([b[1] * (a @ a) - a[1] * (b @ b), a[0] * (b @ b) - b[0] * (a @ a)]) / (2 * cross))
