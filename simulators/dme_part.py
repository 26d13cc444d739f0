"""A part under the probe of a simulated coordinate measuring machine: where a ball that comes along a direction touches it.

The part is a prism: its section is the path, with form error and defect as `Motion` says, and it stands upright on the machine. A scan
along a known curve takes the same points as a walk along the path does, so that the same part measured by another simulated device has
the same deviations.
"""

from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.motion import Motion, Walk, on_scales, walk

Array = NDArray[np.float64]
_FINE_MM = 0.02  # between two points of the surface that is touched
_NEAR_MM = 1e-9
_MOST_STEPS = 400


class Part(Protocol):
    """What a probe meets. Centres of the ball are (3,), courses (k, 3), and each point comes with the direction out of the material."""

    radius_mm: float

    def touch(self, point_mm: Array, direction: Array, approach_mm: float, search_mm: float) -> Array | None:
        """Where the centre of the ball is when it touches, on its way against the direction; None where nothing is met."""

    def follow(self, course_mm: Array, step_mm: float, *, closed: bool, lost_mm: float) -> tuple[Array, Array, bool]:
        """Centres and directions (k, 3) along a course on the surface, and whether the surface was lost on the way."""


class PathPart:
    """The part that a simulator's settings describe."""

    def __init__(self, path_mm: Array, motion: Motion) -> None:
        self.radius_mm = motion.tip_radius_mm
        self._path_mm, self._motion = path_mm, motion
        self._rng = np.random.default_rng([motion.seed, 1])
        bare = replace(motion, noise_mm=0.0, tip_radius_mm=0.0, start_mm=0.0, backward=False, resolution_mm=0.0)
        self._length_mm = _length(path_mm, motion.closed)
        count = int(np.ceil(self._length_mm / _FINE_MM))
        fine = replace(bare, count=count, speed_mm_s=self._length_mm / count * motion.rate_hz)
        self._surface = walk(path_mm, fine).points_mm
        ideal = replace(fine, form_error_mm=0.0, defect_mm=0.0)
        self._ideal = walk(path_mm, ideal).points_mm
        if motion.closed:
            self._surface = np.vstack([self._surface, self._surface[:1]])

    def touch(self, point_mm: Array, direction: Array, approach_mm: float, search_mm: float) -> Array | None:
        """Go from the approach against the direction, never farther than the surface is away, until the ball touches."""
        start, along, way = point_mm + approach_mm * direction, -direction, 0.0
        if np.hypot(*direction[:2]) < 1e-6:
            return None
        for _ in range(_MOST_STEPS):
            centre = start + way * along
            left = self._distance(centre[:2]) - self.radius_mm
            if left <= _NEAR_MM:
                return None if way == 0.0 and left < -_NEAR_MM else self._with_noise(centre)
            way += max(left, _NEAR_MM)
            if way > approach_mm + search_mm:
                return None
        return None

    def follow(self, course_mm: Array, step_mm: float, *, closed: bool, lost_mm: float) -> tuple[Array, Array, bool]:
        """Walk along the path beside the course, from the place nearest to its beginning."""
        ends = np.vstack([course_mm, course_mm[:1]]) if closed else course_mm
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ends, axis=0), axis=1))])
        count = max(1, round(along[-1] / step_mm) if closed else int(along[-1] / step_mm + 1e-6) + 1)
        start_mm, ahead_mm = self._station(course_mm[0]), self._station(course_mm[min(1, len(course_mm) - 1)])
        turn = ahead_mm - start_mm
        if self._motion.closed:
            turn = (turn + self._length_mm / 2) % self._length_mm - self._length_mm / 2
        moved = replace(self._motion, start_mm=start_mm, backward=turn < 0, count=count, speed_mm_s=step_mm * self._motion.rate_hz)
        if not self._motion.closed:
            room = start_mm if turn < 0 else self._length_mm - start_mm
            moved = replace(moved, count=max(1, min(count, int(room / step_mm) + 1)))
        return self._walked(moved, ends, along, step_mm, lost_mm)

    def _walked(self, moved: Motion, ends: Array, along: Array, step_mm: float, lost_mm: float) -> tuple[Array, Array, bool]:
        centres = self._walk(moved)
        quiet = replace(moved, noise_mm=0.0, resolution_mm=0.0)
        surface = self._walk(replace(quiet, tip_radius_mm=0.0))
        outward = self._walk(replace(quiet, tip_radius_mm=1.0)) - surface
        place = np.minimum(step_mm * np.arange(len(surface)), along[-1])
        beside = np.column_stack([np.interp(place, along, ends[:, axis]) for axis in range(3)])
        far = np.hypot(*(surface - beside)[:, :2].T) > lost_mm
        centres[:, 2] = beside[:, 2]
        if far.any():
            first = int(far.argmax())
            return centres[:first], outward[:first], True
        return centres, outward, False

    def _walk(self, moved: Motion) -> Array:
        found: Walk = walk(self._path_mm, moved)
        return np.array(found.points_mm)

    def _station(self, point_mm: Array) -> float:
        """Where along the path a point of the machine lies."""
        away = np.hypot(*(self._ideal - point_mm)[:, :2].T)
        return float(np.argmin(away)) * self._length_mm / len(self._ideal)

    def _distance(self, point_mm: Array) -> float:
        """How far a point is from the surface, whose nearest point lies on one of the two lines at its nearest corner."""
        nearest = int(np.argmin(((self._surface[:, :2] - point_mm) ** 2).sum(axis=1)))
        first = max(0, nearest - 1)
        corners = self._surface[first : nearest + 2, :2]
        step = np.diff(corners, axis=0)
        share = np.clip(((point_mm - corners[:-1]) * step).sum(axis=1) / (step**2).sum(axis=1), 0.0, 1.0)
        return float(np.hypot(*(corners[:-1] + share[:, None] * step - point_mm).T).min())

    def _with_noise(self, centre: Array) -> Array:
        noise = self._rng.normal(0.0, self._motion.noise_mm, 2)
        return on_scales(np.asarray(centre + np.append(noise, 0.0)), self._motion)


def _length(path_mm: Array, closed: bool) -> float:
    ends = np.vstack([path_mm, path_mm[:1]]) if closed else path_mm
    return float(np.linalg.norm(np.diff(ends[:, :2], axis=0), axis=1).sum())
