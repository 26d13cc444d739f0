"""JSON: what result.json holds validates against the published schema, and what is wrong in it does not."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from tests.cmmlink.command import cmmlink
from tests.cmmlink.exports.conftest import Measured
from tests.cmmlink.exports.schemas import RESULT_SCHEMA, check_result
from tests.cmmlink.oval_part import write_nominal


def test_every_kind_of_result_validates_and_names_the_version_of_the_schema(measured: Measured, tmp_path: Path) -> None:
    nominal = write_nominal(tmp_path / "oval.yaml")
    tolerance = ("--nominal", nominal, "--tolerance", -0.05, 0.05)
    told = [
        measured.result,
        json.loads((measured.out / "result.json").read_text(encoding="utf-8")),
        cmmlink("inspect", measured.folder / "points.csv", *tolerance, "--no-record", "--json").json(),
        cmmlink("replay", "last", "--records", measured.folder / "records", "--json").json(),
    ]
    for result in told:
        check_result(result)
        assert result["schema"] == RESULT_SCHEMA["$id"]


def without(key: str) -> Callable[[dict[str, Any]], object]:
    return lambda result: result.pop(key)


@pytest.mark.parametrize(
    "spoil",
    [
        without("schema"),
        without("verdict"),
        without("measured_at"),
        lambda result: result.update(verdict="passed"),
        lambda result: result.update(received="360"),
        lambda result: result["characteristics"][0].update(unit="inch"),
        lambda result: result["worst"].pop("station_mm"),
        lambda result: result.update(schema="urn:cmmlink:result:2"),
    ],
)
def test_a_result_that_is_not_as_published_does_not_validate(measured: Measured, spoil: Callable[[dict[str, Any]], object]) -> None:
    spoiled = copy.deepcopy(measured.result)
    spoil(spoiled)
    with pytest.raises(jsonschema.ValidationError):
        check_result(spoiled)


def test_a_key_that_a_later_version_adds_does_not_break_a_reader(measured: Measured) -> None:
    check_result(measured.result | {"new_in_a_later_version": 1})
