"""How the errors of measured points reach a number of a section: its sensitivity to fields of errors along the outline, linearised.

A chord or a radius is no sum of deviations, so what errors do to it is seen by moving the outline of the nominal section a little and
measuring again. Seven fields are what all points can share: the radius of the tip, shifts, and strains by x and by y, in which expansion
lies. A few are what the error of a device looks like that grows with the distance between places. The noise of single places is seen by
fields of signs, drawn by the rows of a Hadamard matrix: the mean square of what they do is the square of all single sensitivities
together, exactly so where only places nearer to each other than the matrix is large have a part.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.actual import knots_on, move_section
from inspection.characteristics.outline import AirfoilSection

Array = NDArray[np.float64]
Seen = TypeVar("Seen")

_STEP_MM = 2e-3  # by which an outline is moved: far above what a measured number is uncertain by, far below any radius
_SHARED = 7  # fields that all points can share
_SMOOTH = 3  # modes, along x and along y, of an error whose variance grows with the distance; they stand for the smaller ones as well
_SIGNS = 16  # fields of signs
_FARTHER = 10.0  # that the ends are moved: a chord goes to whichever of two ends lies farther, and a small step would not tell
ENDS = 3  # knots at either end, where the spline that draws the section follows the noise of few points
_FREE = 1e-3  # a motion by a mm that moves the outline outward by less than this share of it is not fitted


@dataclass(frozen=True, slots=True)
class ValueSensitivity:
    """Change of a number for a unit of each error, in the number's unit by mm, or by mm a mm.

    tip     : all of the outline lies outward by a mm
    shift   : along x, and along y
    strain  : (xx, xy, yx, yy) a mm along the first axis for every mm along the second one, about the middle of the outline
    grown   : the root of the sum of squares over the modes of an error whose variance between two places is twice their distance
    single  : the same over all places at the distance of knots, each moved by itself, but for the last ones at both ends
    ends    : of these one by one (2 * ENDS,)
    """

    tip: float
    shift: tuple[float, float]
    strain: tuple[float, float, float, float]
    grown: float
    single: float
    ends: tuple[float, ...]

    @property
    def growth(self) -> float:
        """The section grows by its own size about the middle of its outline."""
        return self.strain[0] + self.strain[3]


class Sensitivities(NamedTuple):
    """The sensitivity of a number at a known pose, and after a free fit of the whole outline, which takes a part of every error away.

    middle_mm : (2,) what strains are about
    """

    known: ValueSensitivity
    fitted: ValueSensitivity
    middle_mm: Array


class MovedOutlines(Generic[Seen]):
    """The nominal section moved by every field of errors, seen as the numbers of a section want it."""

    def __init__(self, section: AirfoilSection, see: Callable[[AirfoilSection], Seen]) -> None:
        stations, parameters = knots_on(section)
        self._middle_mm = section.point(parameters).mean(axis=0)
        fields, self._motions = _fields_of(section, parameters)
        self._units = np.maximum(np.abs(fields).max(axis=1), 1e-12)
        self._units[-2 * ENDS :] /= _FARTHER
        self._unmoved = see(move_section(section, stations, np.zeros(len(stations))))
        self._moved = [see(move_section(section, stations, _STEP_MM * moved)) for moved in fields / self._units[:, None]]

    def sensitivities(self, measure: Callable[[Seen], float]) -> Sensitivities:
        """The sensitivities of a number that is measured on an outline as seen."""
        before = measure(self._unmoved)
        known = np.array([measure(moved) - before for moved in self._moved]) / _STEP_MM * self._units
        motion = np.array([known[1], known[2], known[5] - known[4]])  # along x, along y, and turned
        return Sensitivities(_sensitivity(known), _sensitivity(known - self._motions @ motion), self._middle_mm)


def _sensitivity(found: Array) -> ValueSensitivity:
    tip, x, y, xx, xy, yx, yy = found[:_SHARED].tolist()
    smooth, signs, ends = np.split(found[_SHARED:], [2 * _SMOOTH, 2 * _SMOOTH + _SIGNS])
    single = float(np.sqrt(np.mean(np.square(signs))))
    return ValueSensitivity(tip, (x, y), (xx, xy, yx, yy), float(np.linalg.norm(smooth)), single, tuple(ends.tolist()))


def _fields_of(section: AirfoilSection, parameters: Array) -> tuple[Array, Array]:
    """All fields (f, k), how far they move the outline outward at the knots; the motion (f, 3) that a fit would take each of them for.

    Their order: tip, shifts, strains, modes along x and along y, signs, and single knots, of the end first.
    """
    point, _, _, inward = section.frame(parameters)
    normal = section.outward * section.inward * inward
    middle = point - point.mean(axis=0)
    (x, y), (by_x, by_y) = normal.T, middle.T
    shared = [np.ones(len(x)), x, y, x * by_x, x * by_y, y * by_x, y * by_y]
    smooth = [axis * mode for axis in (x, y) for mode in _modes_of_distance(point)]
    ends = np.zeros((2 * ENDS, len(x)))
    ends[range(2 * ENDS), range(-ENDS, ENDS)] = 1.0
    signs = _signs(len(x))
    signs[:, np.arange(-ENDS, ENDS)] = 0.0
    fields = np.vstack([*shared, *smooth, signs, ends])
    motions = np.column_stack([x, y, y * by_x - x * by_y])
    return fields, np.linalg.lstsq(motions, fields.T, rcond=_FREE)[0].T


def _modes_of_distance(places: Array) -> list[Array]:
    """The largest modes (k,) of errors whose variance between two places is twice their distance, enlarged by what the others add up to."""
    distance = np.hypot(places[:, None, 0] - places[:, 0], places[:, None, 1] - places[:, 1])
    centred = -(distance - distance.mean(axis=0) - distance.mean(axis=1)[:, None] + distance.mean())
    values, vectors = np.linalg.eigh(centred)
    all_of_them = np.maximum(values, 0.0).sum() / values[-_SMOOTH:].sum()
    return [vectors[:, -i] * np.sqrt(values[-i] * all_of_them) for i in range(1, _SMOOTH + 1)]


def _signs(count: int) -> Array:
    """Fields (h, count) of signs: neighbouring places have columns of a Hadamard matrix of their own, in another order in every block."""
    from scipy.linalg import hadamard  # noqa: PLC0415 - it takes a while, and a plan knows only names of this file

    rows, rng = hadamard(_SIGNS).astype(np.float64), np.random.default_rng(0)
    columns = np.concatenate([rng.permutation(_SIGNS) for _ in range(-(-count // _SIGNS))])[:count]
    return np.asarray(rows[:, columns] * rng.choice([-1.0, 1.0], count))
