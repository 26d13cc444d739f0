"""What takes half the time of a run and has tests of its own, done once for all runs of a process."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from inspection import NominalProfile, NurbsCurve, discretize, rehearse


@contextmanager
def preparations_made_once() -> Iterator[None]:
    """Discretise each nominal once, and rehearse on it once."""
    made: dict[tuple[object, ...], NominalProfile] = {}
    rehearsed: set[tuple[object, ...]] = set()

    def discretize_once(curve: NurbsCurve, *chosen: Any) -> NominalProfile:
        arrays = (curve.control_points_mm, curve.knots, curve.weights)
        key = (curve.degree, curve.closed, *(b"" if array is None else array.tobytes() for array in arrays), *chosen)
        if key not in made:
            made[key] = discretize(curve, *chosen)
        return made[key]

    def rehearse_once(nominal: NominalProfile, *chosen: Any) -> None:
        if chosen not in rehearsed:
            rehearse(nominal, *chosen)
            rehearsed.add(chosen)

    with patch("cmmlink.from_plan.discretize", discretize_once), patch("cmmlink.run.rehearse", rehearse_once):
        yield


@contextmanager
def pictures_drawn_here() -> Iterator[None]:
    """Let `cmmlink inspect` draw its pictures in this process, which loads what draws them once; another process has tests of its own."""
    with patch("cmmlink.other_processes.processes_here", lambda: 0):
        yield
