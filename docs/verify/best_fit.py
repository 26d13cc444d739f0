"""Whether the best fits of an exported run are the best ones, which verify.py leaves open.

    python best_fit.py FOLDER

Needs verify.py beside it, and no more than that does. It prints what verify.py prints and a sentence for every line-profile of the whole
profile that was judged at a best fit. Exit status as there. The formulas:

    best fit    sum of w (d - middle of the zone)^2 is smallest; w is half the way to both neighbours along the curve, or 1
    weight      no more than a 200th of the profile's length counts on either side; an open end belongs to its point alone
    step        of Gauss and Newton: -(J'WJ)^-1 J'We, where the columns of J are differences of distances. At a best fit it is zero
"""

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
verify: Any = importlib.import_module("verify")

Array = Any  # of numpy; docstrings give the shapes
STEP_MM, STILL_MM = 1e-4, 1e-6  # of the differences; a step that moves no point farther is none
STARTS, ROUNDS = 20, 6
FARTHEST = 0.02  # of the size: from so far off, at most, the fit is sought anew
LESS = 1e-9  # of the sum of squares: what differs by less is the same


def weigh(station: Array, curve: Any) -> Array:
    """How much of the profile points (m,) stand for."""
    order, found = np.argsort(station, kind="stable"), np.zeros(len(station))
    s = station[order]
    gaps = np.diff(s, prepend=s[-1] - curve.length, append=s[0] + curve.length) / 2
    if not curve.closed:
        gaps[[0, -1]] = s[0], curve.length - s[-1]
    gaps = np.minimum(gaps, curve.length / 200)
    found[order] = gaps[:-1] + gaps[1:]
    return found


class Fit:
    """The sum of squares of points (m, 2) about their middle, at any placement: an angle and the place of the middle."""

    def __init__(self, check: Any, target_mm: float) -> None:
        self.curve, self.target, self.by_points = check.curve, check.radius + target_mm, check.plan["weights"] == "points"
        self.arms = check.flat - check.flat.mean(axis=0)
        self.scale = np.array([1 / np.hypot(*self.arms.T).max(), 1.0, 1.0])  # of motions, so that each moves a point by a mm at most

    def off(self, pose: Array) -> tuple[Array, Array]:
        """Deviations from the target (m,), and weights (m,) with the sum 1; points beyond an open end count for nothing."""
        distance, station, at_end = self.curve.closest(verify.placed(self.arms, pose), 40)
        weights = np.where(at_end, 0.0, 1.0 if self.by_points else weigh(station, self.curve))
        return distance - self.target, weights / weights.sum()

    def square(self, pose: Array) -> float:
        """The mean square at a placement."""
        off, weights = self.off(pose)
        return float(weights @ off**2)

    def step(self, pose: Array) -> Array:
        """The step of Gauss and Newton from a placement, in mm."""
        off, weights = self.off(pose)
        steps = STEP_MM * np.diag(self.scale)
        rates = np.column_stack([(self.off(pose + step)[0] - self.off(pose - step)[0]) / (2 * STEP_MM) for step in steps])
        return -np.linalg.lstsq(rates.T @ (weights[:, None] * rates), rates.T @ (weights * off), rcond=1e-12)[0]

    def seek(self, pose: Array) -> Array:
        """The placement that some steps lead to."""
        for _ in range(ROUNDS):
            pose = pose + self.step(pose) * self.scale
        return pose


def check_fit(check: Any, one: Any, zone: list[float]) -> None:
    """Whether a placement is the best fit: no step is left, every small motion is worse, and from around nothing better is found."""
    fit, middle = Fit(check, sum(zone) / 2), check.flat.mean(axis=0)
    turn = np.radians(one["pose"]["rotation_deg"])
    pose = np.array([turn, *verify.placed(middle[None], [turn, *one["pose"]["translation_mm"]])[0]])
    here, left = fit.square(pose), np.abs(fit.step(pose)).max()
    check.say(left <= STILL_MM, f"{one['name']}: no step is left at its placement.", f"{left:.1e} mm")
    around = [pose + way * size * fit.scale * axis for size in (1e-2, 1e-1) for axis in np.eye(3) for way in (-1, 1)]
    check.say(min(map(fit.square, around)) > here, f"{one['name']}: every small motion makes the sum of squares larger.")
    draw = np.random.default_rng(1)
    sizes = np.geomspace(1e-3, FARTHEST * check.curve.size, STARTS)
    found = [fit.square(fit.seek(pose + size * fit.scale * draw.uniform(-1, 1, 3))) for size in sizes]
    check.say(min(found) >= here * (1 - LESS), f"{one['name']}: from {STARTS} placements around it none is found that fits better.")


def main(arguments: list[str]) -> int:
    """Check the evidence in a folder, print the findings and give the exit status."""
    try:
        check = verify.Check(Path(arguments[0]))
        for at, one in enumerate(check.result["characteristics"], -1 if "tolerance.lower_mm" in check.plan else 0):
            zone = check.zone_of(at)
            if zone and one["fit"] == "best-fit" and one["region"] is None and check.plan["registration.method"] == "exact":
                check_fit(check, one, zone)
    except (AttributeError, OSError, ValueError, LookupError, TypeError, StopIteration) as error:
        print(f"The evidence cannot be read, or nothing was judged: {type(error).__name__}: {error}" if arguments else __doc__)
        return 2
    print(*(f"{heap}: {sentence}" for heap, sentences in check.findings.items() for sentence in sentences), sep="\n")
    return 1 if "NOT TRUE" in check.findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
