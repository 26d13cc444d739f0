"""The catalogue of devices: what a plan's device becomes, how it is called, and what decodes it."""

from pathlib import Path
from typing import Any

import pytest

from cmmlink.devices import connect, decoder_of, notes_on, source_of, words_of
from cmmlink.errors import PlanError
from cmmlink.plan import LinesDevice, SurfacePlan
from cmmlink.plan.scan import Plan
from drivers import PointFileError, PointFileSource, RegisterDecoder
from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.codecs.optoncdt_frames import OptoncdtDecoder
from drivers.links.axis import ConstantFeed, FollowedAxis
from drivers.links.modbus_scanner import ModbusScanner
from drivers.links.serial_scanner import SerialScanner

SENSOR = {"type": "serial", "address": "COM9", "format": "optoncdt", "options": {"range_mm": 50, "rate_hz": 1000}}
POSITION = {"type": "serial", "address": "COM8"}
REGISTERS = {"type": "modbus", "address": "localhost:502", "map": "gocator", "points": 7}


def plan_with(device: dict[str, Any]) -> Plan:
    tolerance = {"lower_mm": -0.1, "upper_mm": 0.1}
    return Plan.model_validate({"part": {"name": "p"}, "nominal": {"file": "n.csv"}, "tolerance": tolerance, "device": device})


@pytest.fixture
def points(tmp_path: Path) -> dict[str, Any]:
    (tmp_path / "p.csv").write_text("1,2\n3,4\n", encoding="utf-8")
    return {"type": "file", "file": tmp_path / "p.csv"}


def test_each_type_of_device_has_its_source(points: dict[str, Any]) -> None:
    assert isinstance(source_of(plan_with(points)), PointFileSource)
    assert isinstance(source_of(plan_with(POSITION)), SerialScanner)
    assert isinstance(source_of(plan_with(REGISTERS)), ModbusScanner)
    assert isinstance(source_of(plan_with(SENSOR | {"axis": {"feed_mm_s": 10}})), ConstantFeed)
    assert isinstance(source_of(plan_with(SENSOR | {"axis": {"follow": POSITION}})), FollowedAxis)


def test_each_type_of_device_has_its_decoder_where_bytes_are_recorded(points: dict[str, Any]) -> None:
    assert isinstance(decoder_of(plan_with(POSITION)), AsciiDecoder)
    assert isinstance(decoder_of(plan_with(SENSOR)), OptoncdtDecoder)
    assert isinstance(decoder_of(plan_with(REGISTERS)), RegisterDecoder)
    assert decoder_of(plan_with(points)) is None
    assert decoder_of(plan_with(SENSOR | {"axis": {"feed_mm_s": 10}})) is None


def test_a_device_is_called_by_its_type_and_where_it_is(points: dict[str, Any]) -> None:
    assert [words_of(plan_with(device).device) for device in (points, SENSOR, REGISTERS)] == [
        "file p.csv",
        "serial COM9",
        "modbus localhost:502",
    ]
    with connect(plan_with(points)) as device:
        assert (device.device, device.simulated) == ("file p.csv", False)


def test_what_a_format_cannot_show_and_what_is_taken_of_an_axis_is_noted() -> None:
    riftek = {"type": "serial", "address": "COM9", "format": "riftek", "options": {"range_mm": 50, "rate_hz": 1000}}
    uncounted = REGISTERS | {"map": "riftek-rf60x"}
    assert list(notes_on(plan_with(POSITION).device)) == list(notes_on(plan_with(REGISTERS).device)) == []
    [modulo, moves] = notes_on(plan_with(riftek | {"axis": {"feed_mm_s": 10}}).device)
    assert "a loss of 4, 8, ... in a row does not show" in modulo
    assert moves.startswith("the axis is taken to move at 10 mm/s all the time")
    [told] = notes_on(plan_with(uncounted | {"axis": {"follow": POSITION}}).device)
    assert "counts no points" in told
    with connect(plan_with(SENSOR | {"axis": {"follow": riftek}})) as device:
        assert [note.partition(":")[0] for note in device.notes] == ["optoncdt", "axis"]


def test_a_device_that_cannot_be_is_a_wrong_plan() -> None:
    with pytest.raises(PlanError, match=r"device: .*morse"):
        source_of(plan_with(POSITION | {"format": "morse"}))
    with pytest.raises(PlanError, match=r"device: .*no-such-map"):
        source_of(plan_with(REGISTERS | {"map": "no-such-map"}))
    with pytest.raises(PlanError, match=r"address 'spy://x\?file=y' is neither host:port nor"):
        plan_with(POSITION).with_address("spy://x?file=y")
    with pytest.raises(ValueError, match="host:port, or the name of a serial port"):
        plan_with(POSITION | {"address": "spy://x?file=y"})
    with pytest.raises(PointFileError, match=r"none\.csv: no such file"):
        source_of(plan_with({"type": "file", "file": "none.csv"}))


@pytest.mark.parametrize(
    ("device", "told"),
    [
        (SENSOR, "tells z alone"),
        (POSITION | {"format": "riftek", "options": {"range_mm": 50, "rate_hz": 1000}}, "tells z alone"),
        (REGISTERS, "tells x and z alone"),
        (POSITION | {"format": "pattern", "options": {"pattern": "(?P<x>.*),(?P<y>.*)", "unit": "mm", "points": 9}}, "tells x and y alone"),
        ({"type": "lines", "address": "COM9", "unit": "mm", "format": {"pattern": "(?P<y>.*),(?P<z>.*)", "points": 9}}, "tells y and z"),
        ({"type": "file", "file": "p.csv"}, r"p\.csv: the points have x and y alone"),
        ({"type": "file", "file": "p.csv", "columns": {"x": 1, "z": 2}}, r"p\.csv: the points have x and z alone"),
    ],
)
def test_a_coordinate_that_a_device_does_not_tell_is_not_made_up_on_a_surface(
    device: dict[str, Any], told: str, points: dict[str, Any]
) -> None:
    asked = points | {key: value for key, value in device.items() if key != "file"} if device["type"] == "file" else device
    mapping = {"part": {"name": "p"}, "surface": {"file": "n.stl"}, "tolerance": {"lower_mm": -0.1, "upper_mm": 0.1}, "device": asked}
    with pytest.raises((PlanError, PointFileError), match=told):
        source_of(SurfacePlan.model_validate(mapping))
    assert source_of(plan_with(asked)) is not None


def test_devices_that_tell_a_place_in_space_are_taken_for_a_surface() -> None:
    plan = SurfacePlan.model_validate(
        {"part": {"name": "p"}, "surface": {"file": "n.stl"}, "tolerance": {"lower_mm": -0.1, "upper_mm": 0.1}, "device": POSITION}
    )
    ring = REGISTERS | {"map": "generic-ring"}
    touches = LinesDevice(type="lines", address="COM9", unit="mm")
    for device in (POSITION, ring, SENSOR | {"axis": {"feed_mm_s": 10}}):
        assert source_of(plan.model_copy(update={"device": plan_with(device).device})) is not None
    assert source_of(plan.model_copy(update={"device": touches})) is not None
