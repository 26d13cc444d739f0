"""NURBS in YAML: back to the bit, and by hand."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from cmmlink.nominal_files import load_nominal
from cmmlink.nominal_files.nurbs_yaml import save_nurbs_yaml
from tests.cmmlink.nominal_files.shapes import QUARTER, read_or_refuse, same_curve, write_text
from tests.inspection import profiles


@pytest.mark.parametrize("name", ["P1", "P2", "P3"])
def test_nurbs_yaml_comes_back_to_the_bit(tmp_path: Path, name: str) -> None:
    curve = profiles.EVERY[name]()
    save_nurbs_yaml(curve, tmp_path / "curve.yaml")
    nominal = load_nominal(tmp_path / "curve.yaml")
    same_curve(nominal.curve, curve)
    assert nominal.source_format == "nurbs-yaml"
    assert [note.split()[:3] for note in nominal.notes] == [["the", "curvature", "changes"], ["the", "tightest", "hollow"]][
        : 2 if curve.closed else 1
    ]


def test_nurbs_yaml_by_hand_is_a_quarter_circle(tmp_path: Path) -> None:
    curve = load_nominal(write_text(tmp_path, QUARTER, "quarter.yml"), scale=30.0).curve
    np.testing.assert_allclose(np.hypot(*curve.point(np.linspace(0, 1, 101)).T), 30.0, rtol=1e-14)
    assert curve.length_mm == pytest.approx(15 * np.pi, rel=1e-12)
    assert not curve.closed


def test_nurbs_yaml_that_ends_where_it_begins_is_closed(tmp_path: Path) -> None:
    triangle = "degree: 1\nknots: [0, 0, 1, 2, 3, 3]\ncontrol_points_mm: [[0, 0], [3, 0], [0, 4], [0, 0]]\n"
    nominal = load_nominal(write_text(tmp_path, triangle, "triangle.yaml"))
    assert nominal.curve.closed
    assert nominal.notes == ("closed: the curve ends where it begins",)
    assert nominal.curve.length_mm == pytest.approx(12.0, rel=1e-14)
    kept_open = load_nominal(tmp_path / "triangle.yaml", closed=False)
    assert not kept_open.curve.closed
    said = load_nominal(write_text(tmp_path, triangle + "closed: true\n", "said.yaml"), closed=False)
    assert said.notes == ("open, as asked, against what the file says",)


NUMBER = st.one_of(st.integers(-2, 2), st.sampled_from([1e-12, 1e-7, 0.5, 1e5, 1e6]), st.floats())


@st.composite
def nurbs_texts(draw: st.DrawFn) -> str:
    """Curves that are nearly right: counts that mostly fit, knots that mostly rise, numbers of every size."""
    degree, count = draw(st.integers(0, 5)), draw(st.integers(0, 9))
    size = max(0, count + degree + 1 + draw(st.sampled_from([0, 0, 0, 0, 1, -1])))
    knots = draw(st.lists(st.one_of(st.integers(0, 3), st.floats(0, 3), NUMBER), min_size=size, max_size=size))
    knots = sorted(knots) if draw(st.booleans()) else knots
    points = draw(st.lists(st.lists(NUMBER, min_size=2, max_size=2), min_size=count, max_size=count))
    weights = draw(st.one_of(st.just("null"), st.lists(NUMBER, min_size=count, max_size=count)))
    closed = draw(st.sampled_from(["true", "false", "null"]))
    return f"degree: {degree}\nknots: {knots}\ncontrol_points_mm: {points}\nclosed: {closed}\nweights: {weights}\n"


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=nurbs_texts())
@example(text="degree: 1\nknots: [0, 0, 1, 1]\ncontrol_points_mm: [[0, 0], [0, 1]]\nweights: [1, 1e-300]\n")
@example(text="degree: 1\nknots: [0, 0, 1e-308, 1e-308]\ncontrol_points_mm: [[0, 0], [0, 1]]\n")
@example(text="degree: 1\nknots: []\ncontrol_points_mm: [[0, 0], [0, 1]]\n")
@example(text="degree: 1\nknots: [0, 0, 1, 1]\ncontrol_points_mm: []\n")
def test_hostile_nurbs_is_read_or_refuse(tmp_path: Path, text: str) -> None:
    read_or_refuse(write_text(tmp_path, text, "a.yaml"))
