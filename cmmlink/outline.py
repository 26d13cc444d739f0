"""Which contours of a section are the outline of the part: those that can be a section of its nominal, not simply the longest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files import goes_round
from drivers.surface import Contour, SurfaceSection
from inspection import NominalProfile, RegistrationError

_LENGTHS_APART = 1.5  # a noisy surface lengthens an outline by a tenth at most
_LEAST_OPEN = 0.5  # of the nominal's length: open pieces that make less are whiskers beside a part, not a torn part
_LONGEST = 20.0  # times the nominal: open pieces, or the outline of a whole part whose nominal is one side of it, stay well below
_DIRECTIONS = 180


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """The contours to be judged, what is to be said about the choice, and why they are not judged, if they cannot be the part.

    rivals : other contours that can be the part as well, each for itself
    """

    contours: tuple[Contour, ...]
    notes: tuple[str, ...] = ()
    rivals: tuple[Contour, ...] = ()
    refusal: RegistrationError | None = None


@dataclass(frozen=True, slots=True)
class _Shape:
    """What can be compared of two closed lines wherever they lie: length, greatest width, and the side of the square of equal area."""

    length_mm: float
    width_mm: float
    side_mm: float

    def apart(self, other: "_Shape") -> float:
        """Return the greatest ratio of the three, at least 1."""
        pairs = ((self.length_mm, other.length_mm), (self.width_mm, other.width_mm), (self.side_mm, other.side_mm))
        return max(max(one, two) / max(min(one, two), 1e-12) for one, two in pairs)


def outline_of(cut: SurfaceSection, profile: NominalProfile) -> Outline:
    """Choose the outer contour that is most like the nominal; where the outline is torn open, all open pieces together.

    Where no outer contour is like it, but one inside another is, that one is the part: in a shell scanned without its inner wall.
    A nominal that does not go round has no size to compare with: the longest outer contour is taken.
    """
    outer = cut.outer()
    open_pieces = tuple(contour for contour in outer if not contour.closed)
    if not goes_round(profile.curve):
        return _unless_endless(cut, open_pieces if outer and not outer[0].closed else outer[:1], profile)
    nominal = _shape(_points_on(profile), profile.length_mm)
    for inside in (False, True):
        alike = _alike([contour for contour in cut.contours if contour.closed and contour.hole == inside], nominal)
        if alike:
            return Outline((alike[0],), (*_inside(cut, inside), *_several(cut, alike)), tuple(alike[1:]))
    longest_is_open = bool(outer) and not outer[0].closed
    if longest_is_open or _LEAST_OPEN < sum(piece.length_mm for piece in open_pieces) / profile.length_mm < _LENGTHS_APART:
        return _unless_endless(cut, open_pieces, profile)
    return Outline(outer[:1], refusal=_other_part(cut, outer[0], profile) if outer else None)


def _alike(contours: list[Contour], nominal: _Shape) -> list[Contour]:
    """The closed contours that can be a section of the nominal, the most alike first."""
    closed = [(_shape(contour.section_mm, contour.length_mm).apart(nominal), contour) for contour in contours]
    closed.sort(key=lambda candidate: candidate[0])
    return [contour for apart, contour in closed if apart < _LENGTHS_APART]


def _inside(cut: SurfaceSection, inside: bool) -> tuple[str, ...]:
    if not inside:
        return ()
    return (
        f"at height {cut.asked_mm:g} mm the contour like the nominal lies inside another: it was taken for a part in a shell without an "
        "inner wall. If it is a hole in that part, the material is on its other side: say so (--material)",
    )


def _unless_endless(cut: SurfaceSection, contours: tuple[Contour, ...], profile: NominalProfile) -> Outline:
    """Refuse what is far longer than the nominal: a corner far off draws a contour out beyond all bounds."""
    if sum(contour.length_mm for contour in contours) <= _LONGEST * profile.length_mm:
        return Outline(contours)
    return Outline(contours, refusal=_other_part(cut, contours[0], profile))


def _several(cut: SurfaceSection, alike: list[Contour]) -> tuple[str, ...]:
    if len(alike) == 1:
        return ()
    return (
        f"{len(alike)} contours at height {cut.asked_mm:g} mm can be the section of the part: the one around {place_of(alike[0])}, "
        "most like the nominal in length and size, is judged first; where their verdicts differ, none is proven. Cut other parts off",
    )


def place_of(contour: Contour) -> str:
    """The middle of a contour, for people."""
    x, y, z = contour.points_mm.mean(axis=0)
    return f"({x:.1f}, {y:.1f}, {z:.1f})"


def _other_part(cut: SurfaceSection, longest: Contour, profile: NominalProfile) -> RegistrationError:
    """Say that no closed outline can be a section of the nominal."""
    share = longest.length_mm / profile.length_mm
    what = "this is" if not 1 / _LENGTHS_APART < share < _LENGTHS_APART else "its shape is another; this is"
    return RegistrationError(
        f"the outline at height {cut.asked_mm:g} mm is {longest.length_mm:.2f} mm long, the nominal {profile.length_mm:.2f} mm: "
        f"{what} no section of the part. Check the height, the normal, the unit of the surface and the scale of the nominal"
    )


def _points_on(profile: NominalProfile) -> NDArray[np.float64]:
    """Return points (m, 2) of the exact curve, in order."""
    return np.asarray(profile.curve.point(np.linspace(*profile.curve.domain, 2001)))


def _shape(points_mm: NDArray[np.float64], length_mm: float) -> _Shape:
    x, y = (points_mm - points_mm[0]).T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    angle = np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS)
    width = max(float(np.ptp(x * cos + y * sin)) for cos, sin in zip(np.cos(angle), np.sin(angle), strict=True))
    return _Shape(length_mm, width, area**0.5)
