"""Algorithm 1: a curve, discretised finely enough for its Voronoi diagram to follow the medial axis.

The curve is cut at its corners into smooth pieces; every piece is sampled up to and including both its ends, so a
corner is two samples at one place, each with the tangent of its own piece.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve, left_limit
from inspection.errors import NominalError
from inspection.first_use import OnFirstUse
from inspection.foot_grid import FootGrid, build_foot_grid
from inspection.hermite import HermiteProfile, hermite_profile
from inspection.kernels import SAMPLE_METHODS
from inspection.methods import Material, Method
from inspection.reach import StationReach
from inspection.sample_table import ProfileSamples, SampleTable, pack_samples
from inspection.spacing import LocalPoles, space_out
from inspection.voronoi import site_poles

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_FARTHEST = 0.1  # of the profile's size: farther points are not asked to meet an accuracy
_STRAIGHT = 1e-9  # curvature times size: less is round-off of a straight line
_SCOUT_SAMPLES = 2000  # even samples from which the poles are read before the spacing is chosen
_MOST_SAMPLES = 400_000  # a refinement beyond this is a step limit set too small, not a profile


@dataclass(frozen=True, slots=True, eq=False)
class NominalProfile(ProfileSamples):
    """The nominal profile: the samples of an exact curve, the curve, and what is looked up on them.

    curve              : the exact curve
    material           : the side of the curve, seen along its direction, on which the material lies
    pole_angle_min_deg : the limit of the pole angles, 0 where there is none
    hollowness         : the least and the greatest curvature (1/mm) of the samples, positive where the profile is hollow
    grid               : finds the closest point of the curve
    search, packed     : what is looked up on the samples, made when it is first asked for: see `tree` and `sample_table`
    cubic              : the cubic pieces between the samples, likewise: see `hermite`
    reach              : which stations the foot of a point may have while the point moves, likewise
    """

    curve: NurbsCurve
    material: Material
    pole_angle_min_deg: float
    hollowness: tuple[float, float]
    grid: FootGrid
    search: "OnFirstUse[cKDTree]"
    packed: OnFirstUse[SampleTable]
    cubic: OnFirstUse[HermiteProfile]
    reach: OnFirstUse[StationReach]

    def __repr__(self) -> str:
        return f"<NominalProfile of {len(self)} samples, material {self.material}, on {self.curve!r}>"

    @property
    def tree(self) -> "cKDTree":
        """The search tree that finds the nearest sample."""
        return self.search.value

    @property
    def sample_table(self) -> SampleTable:
        """The samples, with their poles, packed for the compiled methods that look at samples only."""
        return self.packed.value

    @property
    def hermite(self) -> HermiteProfile:
        """The cubic pieces between neighbouring samples."""
        return self.cubic.value

    def grid_for(self, method: Method) -> FootGrid:
        """What finds the closest point: of the cubic pieces between the samples for `hermite`, of the curve for every other method."""
        return self.hermite.grid if method == "hermite" else self.grid

    def table_for(self, method: Method) -> SampleTable | None:
        """The packed samples where the method looks at samples only; None where it needs none, and so no Voronoi diagram either."""
        return self.sample_table if method in SAMPLE_METHODS else None

    @property
    def unmet(self) -> int:
        """Samples, other than ends and corners, whose pole angle stays below the limit at the smallest step."""
        return int(_below(self, self.pole_angle_min_deg).sum())

    @property
    def outward(self) -> float:
        """+1 when the normal (left) points out of the material, -1 when it points into it."""
        return _outward(self.material)

    @property
    def length_mm(self) -> float:
        """Arc length of the curve."""
        return self.curve.length_mm

    @property
    def size_mm(self) -> float:
        """Diagonal of the box, along the axes, around the samples."""
        return float(np.hypot(*np.ptp(self.points_mm, axis=0)))

    @property
    def smallest_concave_radius_mm(self) -> float:
        """Radius of the tightest hollow a probe has to enter; infinite when the profile is convex throughout."""
        hollow = self.hollowness[1]
        return 1.0 / hollow if hollow > 0 else float("inf")


def _outward(material: Material) -> float:
    return -1.0 if material == "left" else 1.0


def discretize(
    curve: NurbsCurve,
    samples: int = 10_000,
    pole_angle_min_deg: float = 178.0,
    step_min: float = 1e-4,
    material: Material = "left",
    accuracy_mm: float | None = None,
    method: Method = "exact",
) -> NominalProfile:
    """Algorithm 1 of Hari Ganesh & Samuel (2022): sample, build the Voronoi diagram, refine where a pole angle is too small.

    samples            : starting samples, even in the parameter (the paper's P, at least 8); corners are added to them
    pole_angle_min_deg : refine next to samples whose two poles are seen under a smaller angle (the paper: 178)
    step_min           : never split a step of less than twice this fraction of the parameter range (the paper: 1e-4)
    material           : the side of the curve, seen along its direction, on which the material lies
    accuracy_mm        : instead of all that, the fewest samples that keep the error of `method` below this, for points
                         nearer than half the local pole radius and a tenth of the size. With spacing h, curvature k, its
                         change k' and pole radius r the error is at most |k'| h^3 / 48 for circle, |k| h^2 / 8 for chord,
                         (3/8) |1/r - k| h^2 + (1/2) |k'| h^3 for pcp and veaw on the profile, and |k'' - k^3| h^4 / 384 for
                         hermite. At corners and sharp edges r falls to zero, so that no spacing bounds the error of pcp and
                         veaw there. `exact` and
                         `inversion` are exact at any spacing. The pole angle and the smallest step are not used, because
                         they bound no error.

    The pole angle alone bounds no error; with the defaults it is the even starting step that does. The diagram is built where a
    step may still be split, and for the methods that use it when they first do. Raises NominalError.
    """
    if accuracy_mm is not None:
        return _profile(curve, material, _evaluate(curve, _accurate_parameters(curve, accuracy_mm, method)), 0.0)
    if samples < 8 or not 0 < pole_angle_min_deg < 180 or not 0 < step_min < 1 or material not in ("left", "right"):
        raise NominalError(
            f"need samples >= 8, 0 < pole_angle_min_deg < 180, 0 < step_min < 1, material left or right; "
            f"got {samples}, {pole_angle_min_deg}, {step_min}, {material}"
        )
    pieces = _even_parameters(curve, samples)
    smallest = step_min * (curve.domain[1] - curve.domain[0])
    found = _evaluate(curve, pieces)
    while any(_may_split(piece, smallest).any() for piece in pieces):  # else no pole angle changes anything
        refined = _refine(pieces, _below(found, pole_angle_min_deg), smallest)
        if sum(map(len, refined)) == sum(map(len, pieces)):
            break
        if sum(map(len, refined)) > _MOST_SAMPLES:
            raise NominalError(f"more than {_MOST_SAMPLES} samples needed; choose a larger step_min than {step_min:g}")
        pieces = refined
        found = _evaluate(curve, pieces)
    return _profile(curve, material, found, pole_angle_min_deg)


def _profile(curve: NurbsCurve, material: Material, samples: ProfileSamples, pole_angle_min_deg: float) -> NominalProfile:
    """The profile of these samples."""
    hollow = samples.curvature * _outward(material)
    return NominalProfile(
        **{field.name: getattr(samples, field.name) for field in fields(samples)},
        curve=curve,
        material=material,
        pole_angle_min_deg=pole_angle_min_deg,
        hollowness=(float(hollow.min()), float(hollow.max())),
        grid=build_foot_grid(curve),
        search=OnFirstUse(lambda: _search_tree(samples.points_mm)),
        packed=OnFirstUse(lambda: pack_samples(samples, curve)),
        cubic=OnFirstUse(lambda: hermite_profile(samples, curve)),
        reach=OnFirstUse(lambda: StationReach(curve)),
    )


def _search_tree(points_mm: Array) -> "cKDTree":
    """The search tree of points (n, 2)."""
    from scipy.spatial import cKDTree  # noqa: PLC0415 - it takes a third of a second, and the exact method needs no tree

    return cKDTree(points_mm)


def _below(samples: ProfileSamples, pole_angle_min_deg: float) -> NDArray[np.bool_]:
    """Whether each sample (n,), other than ends and corners, has a pole angle below the limit."""
    return np.asarray((samples.poles.angle_deg < pole_angle_min_deg) & (samples.next_site >= 0) & (samples.previous_site >= 0))


def _accurate_parameters(curve: NurbsCurve, accuracy_mm: float, method: Method) -> list[Array]:
    """Parameters of the fewest samples that meet the accuracy. The poles are those of an even discretisation made first."""
    if not 0 < accuracy_mm < np.inf:
        raise NominalError(f"the accuracy must be a positive number, not {accuracy_mm:g} mm")
    even = _even_parameters(curve, _SCOUT_SAMPLES)
    scouted = OnFirstUse(lambda: _scout_poles(curve, even))

    def poles(at: Array) -> LocalPoles:
        return scouted.value(at)

    pieces = [space_out(curve, piece[0], piece[-1], accuracy_mm, method, poles) for piece in even]
    if sum(map(len, pieces)) > _MOST_SAMPLES:
        raise NominalError(f"{method} needs more than {_MOST_SAMPLES} samples for {accuracy_mm:g} mm; choose circle or exact")
    return pieces


def _scout_poles(curve: NurbsCurve, even: list[Array]) -> Callable[[Array], LocalPoles]:
    """What tells the poles at parameters (g,), read off those of an even discretisation."""
    scout = _evaluate(curve, even)
    u, curvature, poles_there = scout.parameter, scout.curvature, scout.poles
    sides = ((poles_there.left_curvature, curvature), (poles_there.right_curvature, -curvature))
    farthest = _FARTHEST * float(np.hypot(*np.ptp(scout.points_mm, axis=0)))
    pole_error = np.maximum(*(_pole_error(k, bend, farthest) for k, bend in sides))
    radius = 1 / np.maximum(np.maximum(poles_there.left_curvature, poles_there.right_curvature), 1 / (10 * farthest))
    order = np.argsort(u, kind="stable")
    start, end = curve.domain

    def poles(at: Array) -> LocalPoles:
        wrapped = np.where(at > end, at - (end - start), at)
        return LocalPoles(*(np.interp(wrapped, u[order], values[order]) for values in (radius, _neighbourhood_maximum(pole_error))))

    return poles


def _pole_error(pole_curvature: Array, curvature: Array, farthest_mm: float) -> Array:
    """Error of a pole circle per squared spacing (n,), for points nearer than half the pole radius and than `farthest_mm`."""
    excess = np.abs(pole_curvature - curvature)
    return np.asarray(3 / 8 * excess + 0.5 / np.maximum(pole_curvature, 0.5 / farthest_mm) * excess**2 / 8)


def _neighbourhood_maximum(values: Array) -> Array:
    """The largest of each value (n,) and its two neighbours."""
    return np.maximum(values, np.maximum(np.roll(values, 1), np.roll(values, -1)))


def _even_parameters(curve: NurbsCurve, samples: int) -> list[Array]:
    """Rising parameters of every smooth piece. A piece across the seam runs past the end of the domain."""
    start, end = curve.domain
    if curve.closed and not curve.corners.size:
        return [np.linspace(start, end, samples + 1)]
    borders = np.append(curve.corners, curve.corners[:1] + end - start) if curve.closed else np.concatenate([[start], curve.corners, [end]])
    step = (end - start) / samples
    return [np.linspace(low, high, max(2, round((high - low) / step)) + 1) for low, high in pairwise(borders)]


def _refine(pieces: list[Array], below: NDArray[np.bool_], smallest: float) -> list[Array]:
    """Halve the steps on both sides of every failing sample, unless the halves would be shorter than `smallest`."""
    refined, first = [], 0
    for piece in pieces:
        smooth_loop = len(pieces) == 1 and len(piece) == len(below) + 1
        failing = np.append(below, below[0]) if smooth_loop else below[first : first + len(piece)]
        first += len(piece)
        split = (failing[:-1] | failing[1:]) & _may_split(piece, smallest)
        refined.append(np.sort(np.concatenate([piece, (piece[:-1] + piece[1:])[split] / 2])))
    return refined


def _may_split(piece: Array, smallest: float) -> NDArray[np.bool_]:
    """Whether the halves of each step of a piece are no shorter than `smallest`."""
    return np.asarray(np.diff(piece) / 2 >= smallest)


def _evaluate(curve: NurbsCurve, pieces: list[Array]) -> ProfileSamples:
    """The samples at the parameters of each piece, with their poles from the Voronoi diagram of all of them."""
    smooth_loop = curve.closed and not curve.corners.size
    u = pieces[0][:-1] if smooth_loop else np.concatenate([np.append(piece[:-1], _last_of(piece, curve)) for piece in pieces])
    following, previous, twin, is_open_end = _neighbours(
        [len(u)] if smooth_loop else [len(piece) for piece in pieces], curve.closed, smooth_loop
    )
    point, first, second = curve.derivatives(u, 2)
    speed = np.hypot(first[:, 0], first[:, 1])
    if np.any(speed == 0):
        raise NominalError(f"the curve stands still at parameter {u[np.argmin(speed)]:g}: remove the repeated control point or knot")
    tangent = first / speed[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    at_end = (following < 0) | (previous < 0)
    curvature = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / (speed * speed * speed)
    is_straight = np.abs(curvature) * np.hypot(*np.ptp(point, axis=0)) < _STRAIGHT
    return ProfileSamples(
        parameter=u,
        points_mm=point,
        tangent=tangent,
        normal=normal,
        curvature=curvature,
        station_mm=curve.station_mm(u),
        speed=speed,
        next_site=following,
        previous_site=previous,
        twin=twin,
        is_open_end=is_open_end,
        diagram=OnFirstUse(lambda: site_poles(point, normal, following, at_end, is_straight)),
    )


def _last_of(piece: Array, curve: NurbsCurve) -> Array:
    """The parameter of a piece's end as that of a left-hand limit, wrapped into the domain."""
    start, end = curve.domain
    return left_limit(np.asarray(piece[-1] if piece[-1] <= end else piece[-1] - (end - start)), curve)


def _neighbours(lengths: list[int], closed: bool, smooth_loop: bool) -> tuple[Index, Index, Index, NDArray[np.bool_]]:
    """For n samples in pieces of these lengths: next_site, previous_site, twin and is_open_end of `ProfileSamples`."""
    n = sum(lengths)
    following, previous, twin = np.arange(1, n + 1), np.arange(-1, n - 1), np.full(n, -1)
    is_open_end = np.zeros(n, dtype=bool)
    if smooth_loop:
        following[-1], previous[0] = 0, n - 1
        return following, previous, twin, is_open_end
    last = np.cumsum(lengths) - 1
    first = last + 1 - np.array(lengths)
    following[last], previous[first] = -1, -1
    twin[last], twin[np.roll(first, -1)] = np.roll(first, -1), last
    if not closed:
        twin[[0, n - 1]] = -1
        is_open_end[[0, n - 1]] = True
    return following, previous, twin, is_open_end
