"""The answer of `cmmlink nominal --json` read back: the same curve to the bit, in the same plane, or one sentence."""

from pathlib import Path

import numpy as np
import pytest
from ezdxf.filemanagement import new

from cmmlink.nominal_files import load_nominal
from inspection import NominalError
from tests.cmmlink.command import cmmlink
from tests.cmmlink.nominal_files.shapes import same_curve, write_text
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points


def understood(file: Path, *options: object) -> Path:
    """What the command prints of a file, kept as a file."""
    kept = file.with_suffix(".json")
    kept.write_text(cmmlink("nominal", file, *options, "--json").out, encoding="utf-8")
    return kept


def test_a_curve_comes_back_to_the_bit_and_judges_the_same(tmp_path: Path) -> None:
    nominal = write_nominal(tmp_path / "oval.yaml")
    kept = understood(nominal)
    found = load_nominal(kept)
    same_curve(found.curve, load_nominal(nominal).curve)
    assert (found.source_format, found.plane) == ("nominal-json", None)
    points = write_points(tmp_path / "points.csv", oval_points(0.02))
    how = ("--tolerance", -0.05, 0.05, "--fit", "none", "--no-record", "--json")
    results = [cmmlink("inspect", points, "--nominal", file, *how).json() for file in (nominal, kept)]
    assert results[0]["max_deviation_mm"] == results[1]["max_deviation_mm"]
    assert results[0]["worst"] == results[1]["worst"]
    assert load_nominal(kept, scale=2.0).curve.length_mm == pytest.approx(2 * found.curve.length_mm, rel=1e-12)


def test_a_curve_in_space_brings_its_plane(tmp_path: Path) -> None:
    document = new("R2010")
    document.units = 4
    document.modelspace().add_ellipse((5, 2, 60), (20, 0, 0), 0.6, dxfattribs={"extrusion": (0, -0.6, 0.8)})
    document.saveas(tmp_path / "part.dxf")
    drawn = load_nominal(tmp_path / "part.dxf")
    found = load_nominal(understood(tmp_path / "part.dxf"))
    same_curve(found.curve, drawn.curve)
    assert found.plane is not None
    assert drawn.plane is not None
    np.testing.assert_array_equal(found.plane.packed, drawn.plane.packed)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is no JSON: "),
        ("[1, 2]", "has no degree; expected the answer of `cmmlink nominal --json`"),
        ('{"verdict": "conform"}', "has no degree"),
        ('{"degree": 1, "knots": [0, 0, 1, 1]}', "has no control_points_mm"),
        ('{"degree": 1, "knots": [0, 0, 1], "control_points_mm": [[0, 0], [9, 9]]}', "knots"),
        ('{"degree": 1, "knots": [0, 0, 1, 1], "control_points_mm": [[0, 0], [9, NaN]]}', "control_points_mm"),
        ('{"degree": 1, "knots": [0, 0, 1, 1], "control_points_mm": [[0, 0], [9, 9]], "plane": {"normal": [0, 0, 1]}}', "plane: expected"),
    ],
)
def test_what_is_no_nominal_costs_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    path = write_text(tmp_path, text, "part.json")
    with pytest.raises(NominalError) as refused:
        load_nominal(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
