"""Points judged while they arrive: the same part as in example 01, in batches as a device would send them.

The first verdicts are provisional, since the pose still moves; the final verdict is given over all points at the settled pose.

It prints:

    100 points: seeking
    200 points: provisional
    300 points: provisional
    400 points: provisional
    500 points: provisional
    600 points: provisional
    700 points: provisional
    800 points: provisional
    nonconform: received 800, judged 800, rejected 0
    out of tolerance from 67.5 to 72.5 mm, the worst deviation is +0.135 mm
"""

from pathlib import Path

import numpy as np
import yaml

from inspection import LiveInspection, NurbsCurve, ToleranceZone, discretize

DATA = Path(__file__).parent / "data"

given = yaml.safe_load((DATA / "cam.yaml").read_text(encoding="utf-8"))
curve = NurbsCurve(given["degree"], np.array(given["control_points_mm"]), np.array(given["knots"]), closed=given["closed"])
live = LiveInspection(discretize(curve, material="left"), ToleranceZone(-0.05, 0.05, uncertainty_mm=0.004), coverage_min=0.95)

points_mm = np.loadtxt(DATA / "cam-points.csv", delimiter=",", skiprows=1)
for batch in np.array_split(points_mm, 8):
    update = live.add(batch)
    print(f"{update.stop:3d} points: {update.state}")

result = live.finish()
print(f"{result.verdict.word}: received {result.received}, judged {result.judged}, rejected {result.rejected}")
for stretch in result.stretches:
    print(f"out of tolerance from {stretch.from_mm:.1f} to {stretch.to_mm:.1f} mm, the worst deviation is {stretch.worst_mm:+.3f} mm")
