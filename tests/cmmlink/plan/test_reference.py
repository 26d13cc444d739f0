"""The reference of plans and maps is complete, and says what the models do."""

import pytest
from pydantic import BaseModel, Field

from cmmlink.plan.reference import REQUIRED, Key, groups_of, table
from cmmlink.plan.scan import Plan
from cmmlink.plan.surface import CtPlan
from cmmlink.plan.whole_surface import SurfacePlan
from drivers.codecs.register_map import RegisterMap


class Inner(BaseModel):
    """An inner mapping."""

    number: float = Field(default=0.5, gt=0, lt=1, description="a number")


class Outer(BaseModel):
    """An outer
    mapping.
    """

    word: str = Field(description="a word")
    sure: bool | None = Field(default=None, description="whether")
    one: Inner = Field(default=Inner(), description="one")
    other: Inner | None = Field(default=None, description="the other")
    inners: list[Inner] = Field(default=[], description="several")
    named: dict[str, int] = Field(default_factory=dict, description="by name")


def keys_of(model: type[BaseModel]) -> dict[str, Key]:
    return {f"{group.path}: {key.name}": key for group in groups_of(model) for key in group.keys}


def test_a_key_says_what_it_takes_its_default_and_its_meaning() -> None:
    outer, inner = groups_of(Outer)
    assert (outer.path, outer.meaning) == ("", "An outer mapping.")
    assert outer.keys[:3] == (
        Key("word", "text", REQUIRED, "a word"),
        Key("sure", "`true` or `false` or `null`", "`null`", "whether"),
        Key("one", "a mapping, see `one, other, inners[]`", "its own defaults", "one"),
    )
    assert outer.keys[5] == Key("named", "a mapping", "`{}`", "by name")
    assert (inner.path, inner.keys) == ("one, other, inners[]", (Key("number", "number above 0 and below 1", "`0.5`", "a number"),))


def test_a_table_has_a_line_for_each_key() -> None:
    assert table(groups_of(Outer)[1]).splitlines()[2] == "| `number` | number above 0 and below 1 | `0.5` | A number. |"


def test_every_kind_of_device_has_its_group() -> None:
    paths = [group.path for group in groups_of(Plan)]
    assert {"device (type: serial)", "device (type: modbus)", "device (type: file)", "device.axis", "registration.datum"} <= set(paths)
    assert len(paths) == len(set(paths))


def test_every_type_of_characteristic_has_its_group() -> None:
    paths = {group.path for group in groups_of(CtPlan)}
    assert {"characteristics[] (type: line-profile)", "characteristics[] (type: chord)", "characteristics[].datum.line"} <= paths
    assert "stack_characteristics[] (type: bow)" in paths
    assert keys_of(Plan)[": characteristics"].takes == "a list of mappings, see `characteristics[]` of each type"


@pytest.mark.parametrize("model", [Plan, CtPlan, SurfacePlan, RegisterMap])
def test_every_key_and_every_mapping_is_explained(model: type[BaseModel]) -> None:
    assert [path for path, key in keys_of(model).items() if not key.meaning] == []
    assert [group.path for group in groups_of(model) if not group.meaning or group.meaning.startswith("Usage docs")] == []


@pytest.mark.parametrize("model", [Plan, CtPlan, SurfacePlan, RegisterMap])
def test_no_key_takes_something_unsaid(model: type[BaseModel]) -> None:
    assert [path for path, key in keys_of(model).items() if "any value" in key.takes] == []


def test_defaults_and_limits_are_those_of_the_model() -> None:
    keys = keys_of(Plan)
    assert keys["registration: coverage_min"].takes == "number from 0 to 1"
    assert keys["registration: coverage_min"].default == f"`{Plan.model_fields['registration'].default.coverage_min}`"
    assert keys["discretisation: samples"].takes == "whole number from 8 to 400,000"
    assert keys["tolerance: lower_mm"].default == REQUIRED
    assert keys["section: normal"] == Key(
        "normal", "a list of 3 numbers", "`[0.0, 0.0, 1.0]`", "the direction of the plane's normal, of any length"
    )
