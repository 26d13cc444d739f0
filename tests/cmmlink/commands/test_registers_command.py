"""The command `registers` with a simulated device, from the first look to a scan read by the map that it wrote."""

from pathlib import Path

import pytest

from cmmlink.plan.own_maps import map_of
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.links.modbus_scanner import ModbusScanner
from drivers.source import PointBatch
from tests.cmmlink.command import cmmlink
from tests.integration.simulated import simulated


def test_a_map_is_made_by_looking_and_reads_the_device(tmp_path: Path) -> None:
    out = tmp_path / "maps.of my-plc.yaml"
    chosen = ("--sequence", "100:uint16", "--x", "103:int32", "--y", "105:int32", "--scale", "1e-5")
    with simulated("modbus-ring", "127.0.0.1:0", tmp_path, count=20_000) as device:
        looked = cmmlink("registers", device.address, "--count", 4)
        assert looked.code == 0
        magic = next(line.split() for line in looked.out.splitlines() if line.strip().startswith("0 "))
        assert magic[1:3] == ["0x434d", str(0x434D)]
        assert int(magic[4]) == 0x434D4D31  # as int32, high word first
        found = cmmlink("registers", device.address, "--first", 100, "--count", 11, *chosen, "--out", out, "--json").json()
        assert found["map"] == str(out)
        assert [row["register"] for row in found["registers"]] == list(range(100, 111))
        again = cmmlink("registers", device.address, *chosen, "--out", out)
        assert "is there already" in again.refused()
        assert cmmlink("registers", device.address, *chosen, "--out", out, "--overwrite").code == 0
        assert cmmlink("check", out).code == 0
        arrivals = ModbusScanner(device.address, RegisterDecoder(map_of(out)), poll_s=0.0).arrivals()
        batch = next(arrival for arrival in arrivals if isinstance(arrival, PointBatch))
        nearest = abs(device.sent_mm[:, :2] - batch.points_mm[0, :2]).max(axis=1).min()
        assert nearest < 6e-6  # half a unit of the device
        assert "has none of the holding registers 64000 to 64003: it answers exception 2" in cmmlink(
            "registers", device.address, "--first", 64000, "--count", 4
        ).failed(4)


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("127.0.0.1:9",), 4, "no Modbus device opens there"),
        (("nowhere at all",), 2, "neither host:port nor the name of a serial port"),
        (("127.0.0.1:9", "--first", 65530), 2, "expected some of 0 to 65535"),
        (("127.0.0.1:9", "--x", "1:int16"), 2, "--out and the places of its numbers"),
        (("127.0.0.1:9", "--out", "map.yaml"), 2, "--out and the places of its numbers"),
        (("127.0.0.1:9", "--out", "map.yaml", "--x", "1"), 2, "--x: '1': expected the first register and the type"),
    ],
)
def test_what_cannot_be_is_named_first(words: tuple[object, ...], code: int, told: str) -> None:
    assert told in cmmlink("registers", *words).failed(code)
