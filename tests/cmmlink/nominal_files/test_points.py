"""Points as columns of text."""

from pathlib import Path

import numpy as np
import pytest

from cmmlink.nominal_files import load_nominal
from tests.cmmlink.nominal_files.shapes import LOOP, circle_points, reference, rows, same_curve, write_text


@pytest.mark.parametrize("name", ["naca.csv", "naca.txt", "naca.xyz", "naca.asc", "NACA.CSV"])
def test_points_are_interpolated_with_a_corner_at_a_sharp_seam(tmp_path: Path, name: str) -> None:
    nominal = load_nominal(write_text(tmp_path, "x,y\n" + rows(LOOP * 100, "{:.17g},{:.17g}"), name))
    same_curve(nominal.curve, reference(LOOP))
    assert nominal.source_format == "points"
    assert nominal.curve.corners.tolist() == [0.0]


def test_constant_height_is_left_out(tmp_path: Path) -> None:
    text = "".join(f"{x:.17g};{y:.17g};12.5\n" for x, y in circle_points(20))
    nominal = load_nominal(write_text(tmp_path, text, "circle.csv"), scale=2.0)
    assert nominal.notes[0] == "z = 25 mm left out"
    assert nominal.curve.length_mm == pytest.approx(2 * np.pi * 40, rel=1e-4)
