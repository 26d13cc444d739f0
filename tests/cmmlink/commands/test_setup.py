"""The commands `nominal`, `ports` and `simulate`."""

import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from cmmlink.demo import section_on_machine
from simulators import SimulatorSettings, known_devices
from simulators.motion import feed_under
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


@pytest.mark.parametrize(("head", "unit", "factor"), [("# units: inch\n", "mm", 1.0), ("x_mm,y_mm\n", "inch", 25.4), ("", "um", 0.001)])
def test_a_unit_that_is_given_goes_above_what_a_nominal_states_and_is_noted(tmp_path: Path, head: str, unit: str, factor: float) -> None:
    rows = "".join(f"{x:.9f},{y:.9f}\n" for x, y in [*oval_points(0.0), oval_points(0.0)[0]])
    file = tmp_path / "nominal.csv"
    file.write_text(head + rows, encoding="utf-8")
    facts = cmmlink("nominal", file, "--unit", unit, "--json").json()
    assert facts["length_mm"] == pytest.approx(factor * LENGTH_MM, rel=1e-4)
    assert facts["notes"][0] == f"read in {unit}, as asked"
    assert any("not followed" in note for note in facts["notes"]) == bool(head)
    assert "both given" in cmmlink("nominal", file, "--unit", unit, "--scale", 2).refused()


def test_check_says_what_was_assumed(tmp_path: Path) -> None:
    write_points(tmp_path / "nominal.csv", np.vstack([oval_points(0.0), oval_points(0.0)[:1]]))
    (tmp_path / "points.txt").write_text("".join(f"{x:.4f};{y:.4f}\n" for x, y in oval_points(0.0)).replace(".", ","), encoding="utf-8")
    plan = tmp_path / "plan.yaml"
    plan.write_text(
        "part: {name: a}\nnominal: {file: nominal.csv, unit: mm}\ntolerance: {lower_mm: -1, upper_mm: 1}\n"
        "device: {type: file, file: points.txt, invalid: [-9999]}\n",
        encoding="utf-8",
    )
    ended = cmmlink("check", plan)
    assert ended.code == 0
    assert "  note: nominal.csv: read in mm, as asked\n" in ended.out
    assert "  note: points.txt: decimal commas\n" in ended.out
    assert "  note: points.txt: 0 rows hold -9999, which means no point: rejected\n" in ended.out


def test_ports_lists_what_the_system_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.devices.serial_ports", lambda: [("COM3", "USB serial"), ("COM4", "a probe")])
    assert cmmlink("ports") == Ended(0, "COM3\tUSB serial\nCOM4\ta probe\n", "")
    monkeypatch.setattr("cmmlink.devices.serial_ports", list)
    assert cmmlink("ports") == Ended(0, "no serial port was found\n", "")


def test_an_unknown_device_is_named_with_the_known_ones() -> None:
    assert re.match(r"no simulated device is called toaster; known: .*serial", cmmlink("simulate", "toaster").refused())
    assert re.match(r"name the device to simulate; known: .*serial", cmmlink("simulate").refused())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "the following arguments are required: --address"),
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


def test_every_simulated_device_has_the_section_of_the_demonstration_without_a_path(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[SimulatorSettings] = []
    devices = dict.fromkeys(known_devices(), lambda settings, _say: told.append(settings))
    monkeypatch.setattr("simulators.known_devices", lambda: devices)
    monkeypatch.setattr("cmmlink.demo.section_on_machine", partial(lambda path: path, section_on_machine()))
    for device in devices:
        assert cmmlink("simulate", device, "--address", "127.0.0.1:0").code == 0
    assert len(told) == len(devices) > 6
    for settings in told:
        distances = feed_under(settings.path_mm, settings.motion).points_mm[:, 1]
        assert distances.min() > 0, "in front of a distance sensor"
        np.testing.assert_allclose(np.ptp(settings.path_mm, axis=0), [100.0, 13.0], atol=1.0)


LEFT_TO_COMPILE = """
import contextlib, io, sys
from typing import get_args
from cmmlink.commands.setup import prepare
from inspection import Method, Outline, discretize, find_airfoil, rehearse
from inspection.surface import PatchSurface, RigidMotion, TriangleSurface, register_surface
from tests.inspection import profiles
from tests.inspection.surface import faces, meshes

def compiled():
    files = [file for name, file in sys.modules.items() if name.startswith("inspection.kernels.")]
    kernels = {name: kernel for file in files for name, kernel in vars(file).items() if hasattr(kernel, "signatures")}
    return {name: len(kernel.signatures) for name, kernel in kernels.items()}

with contextlib.redirect_stdout(io.StringIO()):
    assert prepare() == 0
before, nominal = compiled(), discretize(profiles.p3(), samples=400)
for method in get_args(Method):
    rehearse(nominal, method, reject_outliers=True)
    rehearse(nominal, method)
assert len(Outline(find_airfoil(nominal)).camber.points_mm)  # asked by characteristics
for surface in (PatchSurface([faces.box()[0]]), TriangleSurface(meshes.sphere(8))):
    register_surface(surface.sample(200)[0], surface, RigidMotion.identity())
after = compiled()
print(sum(after.values()), *(name for name in after if after[name] != before.get(name)))
"""


def test_nothing_is_left_to_compile_after_prepare_whatever_the_method() -> None:
    ended = subprocess.run([sys.executable, "-c", LEFT_TO_COMPILE], capture_output=True, text=True, check=True)
    count, *left = ended.stdout.split()
    assert int(count) > 12
    assert left == []


def test_prepare_says_where_the_compiled_code_is_or_that_it_cannot_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("inspection.compiled_code_folder", lambda: Path("/somewhere"))
    ended = cmmlink("prepare")
    assert ended.code == 0
    assert str(Path("/somewhere")) in ended.out
    monkeypatch.setattr("inspection.compiled_code_folder", lambda: None)
    assert "compiles anew" in cmmlink("prepare").refused()
