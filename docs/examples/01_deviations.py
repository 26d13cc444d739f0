"""Deviations of a file of points from a nominal, with nothing but the package `inspection`.

It prints:

    800 points, registered: True
    rms 0.0234 mm, from -0.0187 to +0.1352 mm
    nonconform: 31 points are out of tolerance
    the worst is 70.0 mm along the profile
"""

from pathlib import Path

import numpy as np
import yaml

from inspection import NurbsCurve, ToleranceZone, Verdict, deviations, discretize, register

DATA = Path(__file__).parent / "data"

given = yaml.safe_load((DATA / "cam.yaml").read_text(encoding="utf-8"))
curve = NurbsCurve(given["degree"], np.array(given["control_points_mm"]), np.array(given["knots"]), closed=given["closed"])
nominal = discretize(curve, material="left")  # the curve runs counterclockwise, so the part lies on its left

points_mm = np.loadtxt(DATA / "cam-points.csv", delimiter=",", skiprows=1)  # (m, 2), as the machine gave them
pose = register(points_mm, nominal)
print(f"{len(points_mm)} points, registered: {pose.converged}")

found = deviations(pose.nominal_from_section.apply(points_mm), nominal)
deviation_mm = found.deviation_mm  # (m,), positive out of material
rms_mm = np.sqrt(np.mean(deviation_mm**2))
print(f"rms {rms_mm:.4f} mm, from {deviation_mm.min():+.4f} to {deviation_mm.max():+.4f} mm")

zone = ToleranceZone(-0.05, 0.05, uncertainty_mm=0.004)
out = np.count_nonzero(zone.verdicts(deviation_mm) == Verdict.NONCONFORM)
print(f"{zone.verdict(deviation_mm).word}: {out} points are out of tolerance")
print(f"the worst is {found.station_mm[np.argmax(np.abs(deviation_mm))]:.1f} mm along the profile")
