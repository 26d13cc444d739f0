"""Devices are found by what their modules say, and the front door loads none of them."""

import subprocess
import sys
from pathlib import Path

import pytest

import simulators
from simulators import known_devices
from simulators.settings import settings_from

ROOT = Path(simulators.__file__).parents[1]


def test_every_simulated_device_is_found_by_its_name() -> None:
    streams = {"serial", "binary", "binary-block", "optoncdt", "riftek", "riftek-ascii"}
    assert set(known_devices()) >= streams | {"riftek-modbus", "modbus-ring", "modbus-fifo", "gocator"}


def test_every_module_of_a_device_says_a_device() -> None:
    modules = {path.stem for path in (ROOT / "simulators" / "devices").glob("*.py") if path.stem != "__init__"}
    assert {serve.__module__.rpartition(".")[2] for serve in known_devices().values()} == modules


def test_every_name_of_the_front_door_is_there_and_no_device_is_loaded_by_it() -> None:
    assert [name for name in simulators.__all__ if not hasattr(simulators, name)] == []
    program = "import simulators, sys; print(*(name for name in sys.modules if 'pymodbus' in name or '.devices.' in name))"
    said = subprocess.run([sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    assert said.split() == []


@pytest.mark.parametrize(
    ("arguments", "complaint"), [([], "name a device: binary, binary-block, dme, gocator, "), (["toaster"], "name a device")]
)
def test_a_device_that_is_not_known_is_one_message(arguments: list[str], complaint: str) -> None:
    ended = subprocess.run([sys.executable, "-m", "simulators", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.startswith(complaint)
    assert ended.stderr.count("\n") == 1


@pytest.mark.parametrize("address", [":502", "spy://x?file=y", "host:\u0665", "127.0.0.1:99999"])
@pytest.mark.parametrize("device", ["modbus-ring", "serial"])
def test_a_simulated_device_serves_nothing_but_what_its_address_names(device: str, address: str, tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("x_mm,y_mm\n0,0\n1,0\n", encoding="utf-8")
    with pytest.raises(ValueError, match="expected pty or host:port"):
        known_devices()[device](settings_from(["--address", address, "--path", str(path)]), lambda _: None)


@pytest.mark.parametrize(
    ("device", "fault"), [("dme", "flip"), ("dme", "slow"), ("serial", "emergency-stop"), ("serial", "slow"), ("modbus-ring", "lone-lf")]
)
def test_a_fault_that_cannot_strike_a_device_is_refused(device: str, fault: str, tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("x_mm,y_mm\n0,0\n10,0\n10,10\n", encoding="utf-8")
    settings = settings_from(["--address", "127.0.0.1:0", "--path", str(path), "--fault", fault])
    with pytest.raises(ValueError, match=f"fault '{fault}' "):
        known_devices()[device](settings, lambda _: None)
