"""The motions that a search over placements looks at: every rigid one, or those that freedoms allow from a known start.

A motion is told by the place of an anchor and by an angle. Of all motions the anchor is one of the points, so that no start is needed.
Where motions are locked or limited it is the pivot, whose shifts along the axes of the freedoms, and the rotation about it, are what
is limited: a box of them is then a box of the search.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.freedoms import Freedoms
from inspection.rigid import RigidTransform

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Motions:
    """Motions of points (m, 2) within bounds.

    arms         : (m, 2) the points seen from the anchor, before any rotation
    origin, axes : (2,) and (2, 2): a shift (2,) puts the anchor at origin + shift @ axes
    shift_mm     : (2,) the middle of all shifts, and `half_mm` (2,) how far they go to either side; 0 where one is locked
    angle, turn  : the same of the rotation, rad
    anchor       : (2,) where the anchor is in the section, and `begin` the rotation in rad from the section that an angle of 0 is
    """

    arms: Array
    origin: Array
    axes: Array
    shift_mm: Array
    half_mm: Array
    angle: float
    turn: float
    anchor: Array
    begin: float

    @property
    def reach_mm(self) -> float:
        """How far the farthest point is from the anchor."""
        return float(np.hypot(*self.arms.T).max())

    @property
    def ways(self) -> tuple[tuple[int, int], ...]:
        """To which sides a box of shifts is cut: to both along each axis that is not locked."""
        along = [(-1, 1) if half > 0 else (0,) for half in self.half_mm.tolist()]
        return tuple((x, y) for x in along[0] for y in along[1])

    def places(self, shift_mm: Array, angle: Array, arms: Array) -> Array:
        """Where motions (k, 2), (k,) bring points (j, 2) at arms from the anchor: places (k, j, 2) in nominal coordinates."""
        to, cosine, sine = self.origin + shift_mm @ self.axes, np.cos(angle)[:, None], np.sin(angle)[:, None]
        x = to[:, :1] + cosine * arms[:, 0] - sine * arms[:, 1]
        y = to[:, 1:] + sine * arms[:, 0] + cosine * arms[:, 1]
        return np.stack([x, y], axis=-1)

    def pose(self, shift_mm: Array, angle: float) -> RigidTransform:
        """The motion as a pose, nominal from section."""
        turn = self.begin + angle
        return RigidTransform(turn, self.origin + shift_mm @ self.axes - RigidTransform(turn, np.zeros(2)).apply(self.anchor[None])[0])


def every_motion(points: Array, low: Array, high: Array, farthest_mm: float) -> Motions:
    """Every rigid motion that could bring points (m, 2) near a nominal which lies between two corners (2,), as near as is given."""
    anchor = points[int(np.argmin(((points - points.mean(axis=0)) ** 2).sum(axis=1)))]
    side = float((high - low).max()) / 2 + farthest_mm
    return Motions(points - anchor, np.zeros(2), np.eye(2), (low + high) / 2, np.full(2, side), 0.0, np.pi, anchor, 0.0)


def motions_within(points: Array, low: Array, high: Array, farthest_mm: float, start: RigidTransform, freedoms: Freedoms) -> Motions:
    """Those of them that freedoms allow from a start."""
    arms = start.apply(points) - freedoms.pivot_mm
    axes, bounds = _axes(freedoms), dict[str, tuple[float, float]]()
    for freedom, lowest, highest in zip(freedoms.names, freedoms.lower.tolist(), freedoms.upper.tolist(), strict=True):
        bounds[freedom] = lowest, highest
    centre, room = (low + high) / 2, float(np.hypot(*(high - low))) / 2 + farthest_mm + float(np.hypot(*arms.T).min())
    shifts = []  # the pivot comes to lie no farther from the nominal than the point that is nearest to it
    for name, middle in zip(("x", "y"), (axes @ (centre - freedoms.pivot_mm)).tolist(), strict=True):
        first, last = bounds.get(name, (0.0, 0.0))
        first, last = (max(first, middle - room), min(last, middle + room)) if name in bounds else (0.0, 0.0)
        shifts.append((first, max(first, last)))
    first, last = bounds.get("rotation", (0.0, 0.0))
    if not (np.isfinite(first) and last - first < 2 * np.pi):
        first, last = -np.pi, np.pi
    ends = np.array(shifts)
    return Motions(
        arms,
        freedoms.pivot_mm,
        axes,
        ends.mean(axis=1),
        np.ptp(ends, axis=1) / 2,
        float(first + last) / 2,
        float(last - first) / 2,
        start.inverse().apply(freedoms.pivot_mm[None])[0],
        start.rotation_rad,
    )


def _axes(freedoms: Freedoms) -> Array:
    """The directions (2, 2) of x and y; where one of them is locked, square to the other; where both are, any."""
    along = {name: direction[:2] for name, direction in zip(freedoms.names, freedoms.directions, strict=True)}
    if "x" in along:
        x = along["x"]
    elif "y" in along:
        x = np.array([along["y"][1], -along["y"][0]])
    else:
        x = np.array([1.0, 0.0])
    return np.array([x, [-x[1], x[0]]])
