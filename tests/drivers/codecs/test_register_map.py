"""Maps as models: what is refused with which key, and how registers are taken apart."""

import struct
from typing import Any

import numpy as np
import pytest

from drivers.codecs.register_map import Block, RegisterField, entries_of, register_map


def tree(**changes: object) -> dict[str, Any]:
    """A small map with some of its keys, given as dotted names with `__`, set or (None) left out."""
    found: dict[str, Any] = {
        "device": "my controller",
        "pattern": "latest",
        "points": {"at": 40, "fields": {"sequence": {"at": 0, "type": "uint16"}, "x": {"at": 1, "type": "float32"}}},
    }
    for name, value in changes.items():
        *path, last = name.split("__")
        place = found
        for key in path:
            place = place[key]
        place[last] = value
    return {key: value for key, value in found.items() if value is not None}


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"pattern": "newest"}, "pattern: expected 'latest', 'ring', 'queue' or 'fifo'; found 'newest'"),
        ({"points__at": "forty"}, "points.at: expected "),
        ({"points__at": 70000}, "points.at: expected less than or equal to 65535; found 70000"),
        ({"points__at": 65535}, "points: expected an end by register 65535, after which 1 entries of 3 registers from 65535 on end"),
        ({"points__at": True}, "points.at: expected a whole number, not true or false; found True"),
        (
            {"points__fields__q": {"at": 3, "type": "int16"}},
            "points.fields.q: expected one of sequence, time, x, y, z, flags",
        ),
        ({"points__fields__x__type": "float"}, "points.fields.x.type: expected 'uint16', "),
        ({"points__fields__x__at": 130}, "points: expected at most 125 registers in one entry, which is what one answer carries, not 132"),
        ({"points__fields__x__scale": 0}, "points.fields.x.scale: expected a factor that is not 0, nor so close to it"),
        ({"points__fields__x__scale": -0.0}, "points.fields.x.scale: expected a factor that is not 0"),
        ({"points__fields__x__scale": 1e-320}, "points.fields.x.scale: expected a factor that is not 0"),
        ({"points__fields__x__scale": False}, "points.fields.x.scale: expected a number, not true or false"),
        ({"points__fields__x__scale": float("inf")}, "points.fields.x.scale: expected a finite number; found inf"),
        ({"points__fields__x__offset": float("nan")}, "points.fields.x.offset: expected a finite number; found nan"),
        (
            {"points__fields": {"sequence": {"at": 0, "type": "uint16"}}},
            "map: expected at least one of x, y and z",
        ),
        ({"pattern": "ring"}, "map: expected the field written in status, which a ring needs"),
        ({"pattern": "queue"}, "map: expected a block pop for a queue, and for no other pattern"),
        ({"pattern": "fifo", "points__fields": {"x": {"at": 0, "type": "int16"}}}, "map: expected a field sequence, without which a fifo"),
        (
            {"pattern": "fifo", "points__registers": 40},
            "map: expected at most 31 registers in one entry, which is what function 24",
        ),
        ({"device": None}, "device: expected Field required"),
        ({"baud": 9600}, "baud: expected "),
    ],
)
def test_a_mistake_is_named_with_its_key(changes: dict[str, object], complaint: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        register_map(tree(**changes))
    assert str(caught.value).startswith(complaint)


def test_whole_numbers_may_be_text_as_yaml_writes_them() -> None:
    found = register_map(tree(points__at="0x28", points__fields__x={"at": "1", "type": "int32", "invalid": "0x80000000"}))
    assert (found.points.at, found.points.fields["x"].at, found.points.fields["x"].invalid) == (40, 1, 0x80000000)


def test_the_size_of_an_entry_is_that_of_its_last_field_or_as_said() -> None:
    assert register_map(tree()).points.size == 3
    assert register_map(tree(points__registers=7)).points.size == 7


@pytest.mark.parametrize(("order", "words"), [("high-first", 1), ("low-first", -1)])
@pytest.mark.parametrize(
    ("kind", "code", "values"),
    [
        ("uint16", "H", (0, 65535)),
        ("int16", "h", (-32768, 32767)),
        ("uint32", "I", (1, 0xFFFFFFFE)),
        ("int32", "i", (-(2**31), 123456789)),
        ("uint64", "Q", (2**63 + 5, 1)),
        ("int64", "q", (-(2**62), 7)),
        ("float32", "f", (1.5, -0.25)),
        ("float64", "d", (0.1, -1e300)),
    ],
)
def test_every_type_in_both_word_orders(order: str, words: int, kind: str, code: str, values: tuple[float, float]) -> None:
    entries = []
    for value in values:
        big = struct.pack(">" + code, value)
        entries.append(b"\xaa\xbb" + b"".join([big[i : i + 2] for i in range(0, len(big), 2)][::words]))
    field = RegisterField.model_validate({"at": 1, "type": kind})
    read = entries_of(Block(at=0, fields={"x": field}), order, b"".join(entries))
    np.testing.assert_array_equal(read.values["x"], values)


def test_a_scale_like_a_hundred_thousandth_rounds_once() -> None:
    field = RegisterField.model_validate({"at": 0, "type": "int32", "scale": 1e-5, "offset": 1.0})
    values = np.array([1, 3, 7, 123_456_789], dtype=np.float64)
    np.testing.assert_array_equal(field.to_unit(values), values / 100_000 + 1.0)
