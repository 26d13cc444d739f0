"""From files to a verdict in one call, then the same from arrays: the part of example 01.

In a notebook a result shows itself as a table and a picture; `found.plot()` draws it, and `found.to_dataframe()` gives its points to
pandas.

It prints:

    <Inspected cam-points: NOT CONFORM, 800 of 800 points judged, worst +0.1352 mm at station 69.98 mm>
    why: 33 points lie beyond the limits -0.05 .. 0.05 mm.
    from arrays the same to the last bit: True
    with the tolerance of another plan: conform
    columns: index, x_mm, y_mm, station_mm, foot_x_mm, foot_y_mm, deviation_mm, verdict
    picture written: True
"""

import tempfile
from pathlib import Path

import numpy as np

import cmmlink

DATA = Path(__file__).parent / "data"

found = cmmlink.inspect(DATA / "cam-points.csv", nominal=DATA / "cam.yaml", tolerance=(-0.05, 0.05))
print(found)
for reason in found.reasons:
    print(f"why: {reason}")

points_mm = np.loadtxt(DATA / "cam-points.csv", delimiter=",", skiprows=1)  # (m, 2), as the machine gave them
again = cmmlink.inspect(points_mm, nominal=cmmlink.nominal_profile(DATA / "cam.yaml"), tolerance=(-0.05, 0.05))
same = np.array_equal(found.points.deviation_mm, again.points.deviation_mm)
print(f"from arrays the same to the last bit: {same}")

wider = cmmlink.inspect(points_mm, nominal=found.profile, tolerance=(-0.15, 0.15), gap_max_mm=2.0)  # every key of a plan has its name
print(f"with the tolerance of another plan: {wider.verdict.word}")
print(f"columns: {', '.join(found.to_columns())}")

with tempfile.TemporaryDirectory() as folder:
    picture = Path(folder) / "cam.png"
    found.plot().savefig(picture)
    print(f"picture written: {picture.stat().st_size > 10_000}")
