"""Curvature and arc length against Open CASCADE, always with an explicit tolerance."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from inspection import NurbsCurve
from tests.inspection import profiles

ROOT = Path(__file__).resolve().parents[2]


def curves() -> dict[str, NurbsCurve]:
    wave = [(float(x), float(8 * np.sin(x / 7))) for x in np.linspace(0, 60, 14)]
    return {
        "open": profiles.clamped(3, wave),
        "rational": profiles.clamped(3, wave, [1.0, 2.5, 0.4, 1.0, 3.0, 0.7, 1.0, 1.0, 2.0, 0.5, 1.0, 1.4, 0.6, 1.0]),
        "of degree 5": profiles.clamped(5, wave),
        "a circle": profiles.circle(9.0),
        "an ellipse": profiles.ellipse(40.0, 3.0),
        "the paper's first": profiles.p1(),
        "a sharp airfoil": profiles.sharp_airfoil("goe404"),
        "a round airfoil": profiles.naca("4512", sharp=False),
    }


@pytest.mark.skipif(find_spec("OCP") is None, reason="Open CASCADE is not installed: it comes with cmmlink[cad]")
def test_curvature_and_length_are_those_of_open_cascade() -> None:
    """The length to 1e-10 of the whole, the curvature to 1e-9 of the largest: Open CASCADE's tolerance is 1e-11 mm."""
    ours = curves()
    asked = []
    for curve in ours.values():
        first, last = curve.domain
        weights = np.ones(len(curve.control_points_mm)) if curve.weights is None else curve.weights
        at = np.linspace(first, last, 41)[1:-1] + 0.003 * (last - first)
        asked.append({"degree": curve.degree, "knots": curve.knots.tolist(), "control_points": curve.control_points_mm.tolist(),
                      "weights": weights.tolist(), "at": at.tolist()})  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "tests.inspection.occt_curves"],
        input=json.dumps(asked),
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    for (name, curve), question, theirs in zip(ours.items(), asked, json.loads(done.stdout), strict=True):
        at = np.array(question["at"])
        curvature = np.abs(curve.curvature(at))
        assert curve.length_mm == pytest.approx(theirs["length"], rel=1e-10), name
        assert np.abs(curve.station_mm(at) - theirs["station"]).max() < 1e-10 * curve.length_mm, name
        assert np.abs(curvature - theirs["curvature"]).max() < 1e-9 * curvature.max(), name
