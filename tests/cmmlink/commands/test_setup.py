"""The commands `nominal`, `ports` and `simulate`."""

import re
from pathlib import Path

import pytest

from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import LENGTH_MM, oval_points, write_points


def test_nominal_shows_what_was_understood(nominal: Path) -> None:
    facts = cmmlink("nominal", nominal, "--json").json()
    assert set(facts) >= {"degree", "knots", "control_points_mm", "weights", "closed", "length_mm", "source_format"}
    assert (facts["degree"], facts["closed"], len(facts["knots"]), len(facts["weights"])) == (2, True, 12, 9)
    assert facts["length_mm"] == pytest.approx(LENGTH_MM, rel=1e-9)
    assert facts["control_points_mm"][1] == [10.0, 8.0]
    words = cmmlink("nominal", nominal)
    assert words.code == 0
    assert f"degree 2, 9 control points\nclosed, length {LENGTH_MM:.4f} mm" in words.out


def test_a_scaled_nominal_is_as_much_longer(nominal: Path) -> None:
    assert cmmlink("nominal", nominal, "--scale", 25.4, "--json").json()["length_mm"] == pytest.approx(25.4 * LENGTH_MM, rel=1e-9)


def test_ports_lists_what_the_system_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.commands.setup.serial_ports", lambda: [("COM3", "USB serial"), ("COM4", "a probe")])
    assert cmmlink("ports") == Ended(0, "COM3\tUSB serial\nCOM4\ta probe\n", "")
    monkeypatch.setattr("cmmlink.commands.setup.serial_ports", list)
    assert cmmlink("ports") == Ended(0, "no serial port was found\n", "")


def test_an_unknown_device_is_named_with_the_known_ones() -> None:
    assert re.match(r"no simulated device is called toaster; known: .*serial", cmmlink("simulate", "toaster").refused())
    assert re.match(r"name the device to simulate; known: .*serial", cmmlink("simulate").refused())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "the following arguments are required: --address, --path"),
        (("--address", "pty", "--path", "no-such.csv"), "no-such.csv: no such file"),
        (("--address", "pty", "--path", "{path}", "--fault", "fire"), "fault 'fire' is none of flip, "),
        (("--address", "pty", "--path", "{path}", "--rate", "0"), "speed 50.0 mm/s and rate 0.0 Hz must be positive"),
    ],
)
def test_wrong_options_of_a_simulated_device_are_one_message(tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    path = write_points(tmp_path / "path.csv", oval_points(0.0))
    ended = cmmlink("simulate", "serial", *(option.format(path=path) for option in options))
    assert (ended.code, ended.out, len(ended.err.splitlines())) == (2, "", 1)
    assert ended.err.startswith(f"cmmlink simulate serial: {message}")


def test_an_address_that_cannot_be_served_is_named(tmp_path: Path) -> None:
    path = write_points(tmp_path / "path.csv", oval_points(0.0))
    message = cmmlink("simulate", "serial", "--address", "nowhere", "--path", path).failed(4)
    assert message.startswith("the simulated device cannot serve nowhere: ")
