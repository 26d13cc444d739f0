"""Make the data of the examples again: the nominal of a cam, and points of a part with a bump, as a machine might send them."""

from pathlib import Path

import numpy as np
import yaml

from inspection import NurbsCurve

HERE = Path(__file__).parent
BUMP_MM, BUMP_STATION_MM, BUMP_WIDTH_MM = 0.15, 70.0, 3.0

turn = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
radius_mm = 20.0 + 8.0 * np.exp(-((turn - 1.5) ** 2) / 0.5) + 1.0 * np.cos(turn - 4.0)
curve = NurbsCurve.interpolate(np.round(np.column_stack([radius_mm * np.cos(turn), radius_mm * np.sin(turn)]), 3), closed=True)
nominal = {"degree": curve.degree, "closed": True, "knots": curve.knots.tolist(), "control_points_mm": curve.control_points_mm.tolist()}
(HERE / "cam.yaml").write_text(yaml.safe_dump(nominal, default_flow_style=None, width=120, sort_keys=False), encoding="utf-8")

rng = np.random.default_rng(11)
u = np.linspace(curve.knots[curve.degree], curve.knots[-curve.degree - 1], 800, endpoint=False)
foot, tangent = curve.point(u), curve.derivatives(u, 1)[1]
outward = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.hypot(*tangent.T)[:, None]
station = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(foot, axis=0).T))])
height = 0.004 * np.sin(5 * 2 * np.pi * station / station[-1]) + rng.normal(0.0, 0.001, len(u))
height += BUMP_MM * np.exp(-(((station - BUMP_STATION_MM) / BUMP_WIDTH_MM) ** 2))
angle = np.radians(25.0)
turned = (foot + height[:, None] * outward) @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
np.savetxt(HERE / "cam-points.csv", turned + np.array([140.0, 95.0]), fmt="%.4f", delimiter=",", header="x_mm,y_mm", comments="")
