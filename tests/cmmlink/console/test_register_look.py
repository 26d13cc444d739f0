"""The registers of a device, looked at from the station, and the map that it saves."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep

import pytest

from cmmlink.commands.console import _plans_in
from cmmlink.console import register_look
from cmmlink.console.refused import Refused
from cmmlink.console.register_look import keep_map
from cmmlink.console.register_words import KeepMap, LookAtRegisters
from cmmlink.console.station import Station
from cmmlink.plan.own_maps import map_of
from tests.integration.simulated import simulated

from .played import Device, setup_of, write_plan

LOOK = LookAtRegisters("127.0.0.1:9", "holding", 0, 12, 1, 19_200, "E")
MAP = KeepMap("turn table", "plc 7", "holding", "high-first", "103:int32", "105:int32", "", "100:uint16", "1e-5", False)


def wait_for(holds: Callable[[], bool]) -> None:
    end_s = monotonic() + 30.0
    while not holds():
        assert monotonic() < end_s
        sleep(0.01)


def station_in(folder: Path) -> Station:
    write_plan(folder)
    return Station(replace(setup_of({"blade.yaml": folder / "blade.yaml"}, Device().connect), folder=folder))


def test_registers_are_seen_to_change_and_make_a_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(register_look, "_PAUSE_S", 0.01)
    station = station_in(tmp_path)
    with simulated("modbus-ring", "127.0.0.1:0", tmp_path, count=50_000) as served:
        assert station.look_at_registers(replace(LOOK, address=served.address)) == f"reading the registers of {served.address}"
        wait_for(lambda: station.registers.state.rows != ())
        first = station.registers.state
        column = first.columns.index(("uint32", "high-first"))
        assert int(first.rows[0].values[column]) == 0x434D4D31
        assert first.rows[0].hex == "434d"
        assert first.rows[11].values[column] == ""  # it would end beyond what was read
        wait_for(lambda: station.registers.state.rows[6] != first.rows[6])  # the heartbeat
        with pytest.raises(Refused, match=r"^registers are being read; "):
            station.choose("blade.yaml")
        assert keep_map(replace(MAP, x="103:int32", y="104:int32"), tmp_path).problem.startswith("x and y both take register 104")
        saved = station.keep_map(MAP)
        assert (saved.name, saved.problem) == ("maps/turn table.yaml", "")
        assert station.registers.state.state == "over"
        assert not station.running
    assert {(name, field.at) for name, field in map_of(tmp_path / saved.name).points.fields.items()} == {
        ("sequence", 0),
        ("x", 3),
        ("y", 5),
    }
    assert list(_plans_in(tmp_path, surfaces=False)) == ["blade.yaml", "section.yaml"]  # a map is offered as no plan


def test_a_map_is_written_over_only_when_that_is_confirmed(tmp_path: Path) -> None:
    assert keep_map(MAP, tmp_path).name
    kept = (tmp_path / "maps" / "turn table.yaml").read_bytes()
    again = keep_map(replace(MAP, x="103:float32"), tmp_path)
    assert (again.name, again.taken) == ("", True)
    assert (tmp_path / "maps" / "turn table.yaml").read_bytes() == kept
    assert keep_map(replace(MAP, x="103:float32", replace=True), tmp_path).name
    assert b"float32" in (tmp_path / "maps" / "turn table.yaml").read_bytes()


@pytest.mark.parametrize("name", ["../blade", "maps/other", "/tmp/x", "C:\\x", ".hidden", "nul", "x" * 200, "", "a\nb"])
def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    station_in(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    saved = keep_map(replace(MAP, name=name, replace=True), tmp_path)
    assert saved.name == ""
    assert "expected a plain name" in saved.problem
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.skipif(not hasattr(Path, "symlink_to"), reason="no links here")
def test_a_folder_that_leads_elsewhere_takes_no_map(tmp_path: Path) -> None:
    (tmp_path / "plans").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "plans" / "maps").symlink_to(tmp_path / "elsewhere")
    assert "leads elsewhere" in keep_map(MAP, tmp_path / "plans").problem
    assert list((tmp_path / "elsewhere").iterdir()) == []


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (replace(LOOK, address="http://plc"), "neither host:port nor the name of a serial port"),
        (replace(LOOK, table="coils"), "table 'coils': expected one of holding, input"),
        (replace(LOOK, count=126), "at most 125 registers"),
        (replace(LOOK, first=65535), "expected some of 0 to 65535"),
        (replace(LOOK, device_id=256), "expected 0 to 255"),
        (replace(LOOK, baud_rate=0), "expected more than 0"),
        (replace(LOOK, parity="X"), "expected one of N, E, O"),
    ],
)
def test_a_look_that_cannot_be_is_refused_and_leaves_the_station_free(tmp_path: Path, asked: LookAtRegisters, words: str) -> None:
    station = station_in(tmp_path)
    with pytest.raises(Refused, match=words):
        station.look_at_registers(asked)
    assert not station.running


def test_a_device_that_does_not_answer_is_named_with_its_address(tmp_path: Path) -> None:
    station = station_in(tmp_path)
    station.look_at_registers(LOOK)
    assert station.wait(30.0)
    assert station.registers.state.state == "failed"
    assert station.registers.state.message.startswith("127.0.0.1:9: no Modbus device opens there")


def test_no_register_is_read_and_no_map_saved_while_a_part_is_measured(tmp_path: Path) -> None:
    station = station_in(tmp_path)
    station.choose("blade.yaml")
    station.start()
    with pytest.raises(Refused, match="a run is on"):
        station.look_at_registers(LOOK)
    with pytest.raises(Refused, match="a run is on"):
        station.keep_map(MAP)
    assert station.registers.state.state == "none"
    assert not (tmp_path / "maps").exists()
    station.abort()
    assert station.wait(30.0)


def test_a_look_that_was_forgotten_ends_by_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(register_look, "_LONGEST_S", 0.0)
    station = station_in(tmp_path)
    with simulated("modbus-ring", "127.0.0.1:0", tmp_path) as served:
        station.look_at_registers(replace(LOOK, address=served.address))
        assert station.wait(30.0)
    assert "read again to go on" in station.registers.state.message
