from pathlib import Path

import numpy as np
import pytest

from simulators.faults import Fault
from simulators.settings import SimulatorSettings, settings_from


@pytest.fixture
def path(tmp_path: Path) -> str:
    np.savetxt(tmp_path / "path.csv", [[0.0, 0.0], [10.0, 0.0]], delimiter=",")
    return str(tmp_path / "path.csv")


def test_every_option_arrives_where_it_belongs(path: str) -> None:
    motion = ["--rate", "500", "--speed", "20", "--count", "7", "--open", "--backward", "--seed", "3", "--start-mm", "9"]
    part = [
        "--noise-mm",
        "0.01",
        "--resolution-mm",
        "0.001",
        "--defect-mm",
        "0.2",
        "--rotation-deg",
        "30",
        "--translation-mm",
        "1",
        "2",
        "3",
    ]
    found = settings_from(["--address", "pty", "--path", path, *motion, *part, "--fault", "gap:5@3", "--unpaced", "--line", "{x}"])
    assert isinstance(found, SimulatorSettings)
    assert (found.address, found.paced, found.faults, found.line) == ("pty", False, (Fault("gap", 5.0, 3),), "{x}")
    np.testing.assert_array_equal(found.path_mm, [[0, 0], [10, 0]])
    taken = found.motion
    assert (taken.rate_hz, taken.speed_mm_s, taken.count, taken.closed, taken.backward, taken.seed) == (500.0, 20.0, 7, False, True, 3)
    assert (taken.start_mm, taken.noise_mm, taken.defect_mm, taken.rotation_deg) == (9.0, 0.01, 0.2, 30.0)
    assert (taken.translation_mm, taken.resolution_mm) == ((1.0, 2.0, 3.0), 0.001)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--fault", "spill"], "fault 'spill' is none of flip, "),
        (["--rate", "0"], "speed 50.0 mm/s and rate 0.0 Hz must be positive"),
        (["--count", "many"], "invalid int value: 'many'; `device --help` shows what is allowed"),
        (["--path", "none.csv"], "none.csv: no such file"),
    ],
)
def test_a_wrong_option_is_one_message_and_no_traceback(
    path: str, arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        settings_from(["--address", "pty", "--path", path, *arguments], "device")
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert complaint in said
    assert said.count("\n") == 1
