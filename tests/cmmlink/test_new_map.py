"""A register map made of a few choices."""

from pathlib import Path

import pytest

from cmmlink.errors import PlanError
from cmmlink.new_map import FieldPlace, MapAnswers, map_text, place_from
from cmmlink.plan.own_maps import map_of


def answers(**fields: FieldPlace) -> MapAnswers:
    return MapAnswers("turn table: 7 #", "input", "low-first", fields, 0.001)


def test_the_map_reads_what_was_chosen(tmp_path: Path) -> None:
    file = tmp_path / "map.yaml"
    chosen = answers(y=FieldPlace(42, "int32"), x=FieldPlace(38, "float32"), sequence=FieldPlace(45, "uint16"))
    file.write_text(map_text(chosen), encoding="utf-8")
    found = map_of(file)
    assert (found.device, found.table, found.word_order, found.pattern) == ("turn table: 7 #", "input", "low-first", "latest")
    assert {name: (found.points.at + field.at, field.type, field.scale) for name, field in found.points.fields.items()} == {
        "sequence": (45, "uint16", 1.0),
        "x": (38, "float32", 1.0),
        "y": (42, "int32", 0.001),
    }


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({}, "choose the registers of x and y first"),
        ({"sequence": FieldPlace(1, "uint16")}, "at least one of x, y and z"),
        ({"x": FieldPlace(1, "int32"), "y": FieldPlace(2, "int16")}, "x and y both take register 2"),
        ({"x": FieldPlace(1, "int32"), "sequence": FieldPlace(5, "float32")}, "sequence"),
        ({"x": FieldPlace(1, "int16"), "y": FieldPlace(200, "int16")}, "at most 125 registers"),
        ({"x": FieldPlace(65535, "int32")}, "65535"),
    ],
)
def test_choices_that_make_no_map_are_refused(fields: dict[str, FieldPlace], words: str) -> None:
    with pytest.raises(PlanError, match=words):
        map_text(answers(**fields))


@pytest.mark.parametrize("text", ["", "41", "41:", "x:float32", "70000:int16", "41:float16", "-1:int16", "4.5:int16", "41:int32 ; y"])
def test_a_place_is_a_register_and_a_type(text: str) -> None:
    assert place_from(" 41 : float32", "x") == FieldPlace(41, "float32")
    with pytest.raises(PlanError, match="expected the first register and the type, like 41:float32"):
        place_from(text, "x")
