"""The characteristics of a plan: what may stand there, how a zone is spelled on a drawing, and what a mistake is told as."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from cmmlink.errors import PlanError
from cmmlink.plan import Plan, load_plan, read_model
from cmmlink.plan.characteristics import AskedProfile, ProfileZone

HEAD = """\
part: {name: blade}
nominal: {file: blade.dat, scale: 100}
device: {type: file, file: points.csv}
"""
TOLERANCE = "tolerance: {lower_mm: -0.05, upper_mm: 0.05}\n"
OF_THE_ISSUE = """\
characteristics:
  - {name: contour,  type: line-profile, zone: {lower_mm: -0.05, upper_mm: 0.05}, fit: minimum-zone, free: [x, y, rotation]}
  - {name: LE form,  type: line-profile, from: {near: [0.2, 1.1]}, to: {station_mm: 112}, zone: {width_mm: 0.06, offset_mm: 0.01}, \
fit: best-fit, filter: {cutoff_mm: 0.8, order: 2}}
  - {name: flank,    type: line-profile, zone: {stations_mm: [0, 50], lower_mm: [-0.1, -0.2], upper_mm: [0.1, 0.1], between: linear}, \
fit: tolerance}
  - {name: chord,    type: chord, method: tangent, nominal_mm: 100.0, lower_mm: -0.1, upper_mm: 0.1}
  - {name: LE radius, type: edge-radius, edge: leading, method: circle, window_deg: 30, nominal_mm: 0.8, lower_mm: -0.1, upper_mm: 0.1}
  - {name: twist,    type: twist, lower_deg: -0.1, upper_deg: 0.1}
"""


def read(text: str) -> Plan:
    return read_model(text, Plan)


def zone_of(spelled: str) -> ProfileZone:
    asked = read(HEAD + f"characteristics:\n  - {{name: a, type: line-profile, zone: {spelled}}}\n").characteristics[0]
    assert isinstance(asked, AskedProfile)
    return asked.zone


def test_the_example_of_the_drawing_loads_as_it_stands() -> None:
    plan = read(HEAD + OF_THE_ISSUE)
    assert [one.name for one in plan.characteristics] == ["contour", "LE form", "flank", "chord", "LE radius", "twist"]
    assert (plan.zone.lower_mm, plan.zone.upper_mm) == (-0.05, 0.05)
    form = plan.characteristics[1]
    assert isinstance(form, AskedProfile)
    assert [*form.zone.limits[0], *form.zone.limits[1]] == pytest.approx([-0.02, 0.04])
    assert form.from_ is not None
    assert form.from_.near == (0.2, 1.1)


def test_a_plan_spelled_in_full_means_the_same() -> None:
    plan = read(HEAD + OF_THE_ISSUE)
    assert read(plan.effective_yaml()) == plan
    assert plan.effective_yaml() == yaml.safe_dump(plan.model_dump(mode="json"), sort_keys=False, allow_unicode=True)


@pytest.mark.parametrize(
    ("spelled", "lower", "upper"),
    [
        ("{lower_mm: 0, upper_mm: 0.1}", 0.0, 0.1),
        ("{width_mm: 0.06}", -0.03, 0.03),
        ("{width_mm: 0.06, offset_mm: 0.01}", -0.02, 0.04),
        ("{width_mm: 0.06, outward_mm: 0.04}", -0.02, 0.04),
        ("0.06 UZ +0.01", -0.02, 0.04),
        ("0.06 UZ-0.03", -0.06, 0.0),
        ("0.06 (U) 0.04", -0.02, 0.04),
        ("0.06 U 0", -0.06, 0.0),
        ("'0.06'", -0.03, 0.03),
    ],
)
def test_a_zone_is_taken_in_the_notations_of_drawings(spelled: str, lower: float, upper: float) -> None:
    lowers, uppers = zone_of(spelled).limits
    assert [*lowers, *uppers] == pytest.approx([lower, upper])


WRONG: dict[str, tuple[str, str]] = {
    "no tolerance at all": ("", "tolerance is missing: expected a mapping with lower_mm and upper_mm"),
    "first of a region": (
        "characteristics:\n  - {name: a, type: line-profile, region: UPPER, zone: '0.1'}\n",
        "tolerance is missing",
    ),
    "none of the profile": ("characteristics:\n  - {name: a, type: chord, lower_mm: 0}\n", "tolerance is missing"),
    "unknown type": (
        TOLERANCE + "characteristics:\n  - {name: a, type: chort, lower_mm: 0}\n",
        "line 6: characteristics[0].type is 'chort'; did you mean chord?",
    ),
    "unknown key": (
        TOLERANCE + "characteristics:\n  - {name: a, type: chord, lower: 0}\n",
        "characteristics[0].lower is not a known key; did you mean lower_mm?",
    ),
    "degrees for a length": (
        TOLERANCE + "characteristics:\n  - {name: a, type: chord, lower_deg: 0}\n",
        "characteristics[0].lower_deg is not a known key",
    ),
    "no limit": (TOLERANCE + "characteristics:\n  - {name: a, type: chord}\n", "a lower limit, an upper one, or both"),
    "limits crossed": (
        TOLERANCE + "characteristics:\n  - {name: a, type: twist, lower_deg: 1, upper_deg: 0}\n",
        "an upper limit above the lower one, 1",
    ),
    "uncertainty too large": (
        TOLERANCE + "characteristics:\n  - {name: a, type: chord, lower_mm: 0, upper_mm: 1, uncertainty_mm: 0.5}\n",
        "an uncertainty of less than half the 1 between the limits",
    ),
    "the same name twice": (
        TOLERANCE + "characteristics:\n  - {name: a, type: chord, lower_mm: 0}\n  - {name: a, type: camber, lower_mm: 0}\n",
        "'a' is given 2 times",
    ),
    "the name of the tolerance": (
        TOLERANCE + "characteristics:\n  - {name: profile, type: chord, lower_mm: 0}\n",
        "no tolerance beside a characteristic called profile",
    ),
    "half a region": (
        TOLERANCE + "characteristics:\n  - {name: a, type: line-profile, zone: '0.1', from: {station_mm: 3}}\n",
        "both from and to, or neither",
    ),
    "two places in one": (
        TOLERANCE
        + "characteristics:\n  - {name: a, type: line-profile, zone: '0.1', from: {station_mm: 3, feature: LE}, to: {station_mm: 9}}\n",
        "characteristics[0].from is a mapping; expected one of station_mm, near and feature",
    ),
    "an edge without an extent": (
        TOLERANCE + "characteristics:\n  - {name: a, type: line-profile, zone: '0.1', region: LE}\n",
        "within_mm with region LE or TE",
    ),
    "zone of no form": (
        TOLERANCE + "characteristics:\n  - {name: a, type: line-profile, zone: {width_mm: 0.1, lower_mm: 0}}\n",
        "width_mm with offset_mm or outward_mm, and no limits beside it",
    ),
    "no notation": (
        TOLERANCE + "characteristics:\n  - {name: a, type: line-profile, zone: wide}\n",
        "a notation like 0.06 UZ +0.01",
    ),
    "limits for other stations": (
        TOLERANCE + "characteristics:\n  - {name: a, type: line-profile, zone: {stations_mm: [0, 1], lower_mm: -1, upper_mm: [1, 1]}}\n",
        "one lower_mm and one upper_mm for each of stations_mm",
    ),
    "a minimum zone that varies": (
        TOLERANCE
        + "characteristics:\n  - {name: a, type: line-profile, fit: minimum-zone, "
        + "zone: {stations_mm: [0, 1], lower_mm: [0, 0], upper_mm: [1, 2]}}\n",
        "fit tolerance for a zone that varies",
    ),
    "no number": (
        TOLERANCE + "characteristics:\n  - {name: a, type: line-profile, zone: {lower_mm: low, upper_mm: 1}}\n",
        "line 6: characteristics[0].zone.lower_mm[0] is 'low'; expected a number",
    ),
}


@pytest.mark.parametrize(("text", "told"), WRONG.values(), ids=WRONG.keys())
def test_a_mistake_is_told_with_its_place_and_what_is_allowed(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "plan.yaml").write_text(HEAD + text, encoding="utf-8")
    with pytest.raises(PlanError) as error:
        load_plan(tmp_path / "plan.yaml")
    assert told in str(error.value)
    assert str(error.value).startswith(f"{tmp_path / 'plan.yaml'}: line ")


def test_a_zone_that_varies_judges_the_points_as_they_arrive_by_its_envelope() -> None:
    limits: dict[str, Any] = {"stations_mm": [0, 5], "lower_mm": [-0.1, -0.3], "upper_mm": [0.2, 0.1]}
    plan = read(HEAD + f"characteristics:\n  - {{name: a, type: line-profile, fit: tolerance, zone: {limits}}}\n")
    assert (plan.zone.lower_mm, plan.zone.upper_mm) == (-0.3, 0.2)


def datum_of(spelled: str) -> AskedProfile:
    asked = read(HEAD + f"{TOLERANCE}characteristics:\n  - {{name: a, type: line-profile, zone: 0.1, {spelled}}}\n").characteristics[0]
    assert isinstance(asked, AskedProfile)
    return asked


def test_a_datum_is_a_line_or_an_edge_and_a_point_or_three_points() -> None:
    asked = datum_of("fit: datum, datum: {line: {from: {station_mm: 20}, to: {feature: LE, offset_mm: -9}}, points: [{feature: LE}]}")
    assert asked.datum is not None
    assert asked.datum.line is not None
    assert asked.datum.line.to.offset_mm == -9
    assert datum_of("fit: datum, datum: {edge: LE, points: [{near: [80, 3]}]}").datum is not None
    assert datum_of("fit: datum, datum: {points: [{station_mm: 10}, {station_mm: 60}, {feature: LE}]}").datum is not None
    for wrong in ("{points: [{feature: LE}]}", "{edge: LE}", "{line: {from: {station_mm: 1}, to: {station_mm: 9}}, edge: LE}", "{}"):
        with pytest.raises(ValueError, match="what fixes three motions: a line and one of points"):
            datum_of(f"fit: datum, datum: {wrong}")
    with pytest.raises(ValueError, match="fit datum beside a datum, not fit none"):
        datum_of("fit: none, datum: {edge: LE, points: [{near: [80, 3]}]}")


def test_an_unequal_zone_needs_its_offset_as_the_standard_has_it() -> None:
    assert zone_of("0.06").limits == ((-0.03,), (0.03,))
    for spelled in ("0.06 UZ", "0.06UZ"):
        with pytest.raises(ValueError, match=r"signed, after UZ, as in 0.06 UZ \+0.01"):
            zone_of(spelled)
