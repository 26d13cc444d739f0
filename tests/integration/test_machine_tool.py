"""A part on a simulated machine tool, from the printed line to the verdict, over every way that lines can take."""

import socket
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers import decoder
from drivers.source import FRAME_REPEATED
from tests.cmmlink.command import cmmlink
from tests.drivers.codecs.g800_transcript import DPRNT_PATTERN, GOLDEN, PRINT_OUT
from tests.drivers.codecs.streams import decoded
from tests.integration.simulated import simulated

TURN = np.linspace(0.0, 2.0 * np.pi, 2001)
PART_MM = np.column_stack([40.0 * np.cos(TURN) + 4.0 * np.cos(2.0 * TURN), 15.0 * np.sin(TURN)])
LENGTH_MM = float(np.hypot(*np.diff(PART_MM, axis=0).T).sum())
COUNT, RADIUS_MM = 300, 1.5
POSIX_ONLY = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals exist on POSIX systems only")
PLAN = """\
part: {{name: oval}}
nominal: {{file: nominal.csv, closed: true}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
probe: {{tip_radius_mm: 1.5}}
device: {device}
registration: {{datum: {{rotation_deg: 0}}}}
allow: {{unseen_mm: 1.5}}
out: null
discretisation: {{samples: 300}}
"""
PART = ["--tip-radius-mm", str(RADIUS_MM), "--form-error-mm", "0.02"]
NUMBERED = "{{pattern: 'N *(?P<seq>[0-9]+) " + DPRNT_PATTERN.replace("Y", " Y").replace("Z", " Z") + "', end: M30}}"


def planned(folder: Path, device: str, more: str = "") -> Path:
    np.savetxt(folder / "nominal.csv", PART_MM[::20], delimiter=",")
    (folder / "plan.yaml").write_text(PLAN.format(device=device) + more, encoding="utf-8")
    return folder / "plan.yaml"


def measured(
    folder: Path, device: str, *options: str, kind: str = "machine-tool", address: str = "127.0.0.1:0", more: str = ""
) -> tuple[int, dict[str, Any], str]:
    """Exit status, result and messages of a run against a simulated device, which is started before the run."""
    with simulated(
        kind,
        address,
        folder,
        "--unpaced",
        *PART,
        *options,
        path_mm=PART_MM,
        count=COUNT,
        rate_hz=5.0,
        speed_mm_s=LENGTH_MM / COUNT * 5.0,
        noise_mm=0.0,
    ) as machine:
        plan = planned(folder, device.replace("ADDRESS", machine.address), more)
        done = cmmlink("run", plan, "--json", "--records", folder / "records")
    assert done.out, done.err
    return done.code, done.json(), done.err


LINES = "{{type: lines, address: 'ADDRESS', unit: mm}}".replace("{{", "{").replace("}}", "}")


def test_a_run_is_final_while_it_runs_and_replayed_from_its_lines(tmp_path: Path) -> None:
    code, facts, errors = measured(tmp_path, LINES)
    assert (code, facts["verdict"], facts["received"], facts["judged"]) == (0, "conform", COUNT, COUNT), errors
    assert any("taken to be in millimetres" in note for note in facts["notes"])
    again = cmmlink("replay", facts["run"], "--records", tmp_path / "records", "--json")
    assert again.json()["identical"] is True, again.err


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """What a machine tool prints of the part where nothing goes wrong."""
    return printed(tmp_path_factory.mktemp("undisturbed"))


@pytest.mark.parametrize(
    ("quirk", "options"),
    [
        ("cr-only", {}),
        ("inch", {"unit": "inch"}),
        ("old-set", {"set_name": "PART-RESULTS"}),
        ("mislabelled:0.2", {}),
        ("repeated-frames:0.1", {}),
        ("parity", {"parity": "even"}),
    ],
)
def test_quirks_of_controls_change_nothing(quirk: str, options: dict[str, str], undisturbed: bytes, tmp_path: Path) -> None:
    plain = decoded(decoder("g800", unit="mm", tip_radius_mm=RADIUS_MM), undisturbed)
    book = decoded(decoder("g800", **({"unit": "mm", "tip_radius_mm": RADIUS_MM} | options)), printed(tmp_path, f"--fault={quirk}"))
    np.testing.assert_allclose(book.points_mm, plain.points_mm, rtol=0.0, atol=0.0014 if quirk == "inch" else 0.0)
    assert (len(book.points_mm), book.sequence) == (COUNT, plain.sequence)
    assert set(book.counts) <= {("Rejected", FRAME_REPEATED)}


@POSIX_ONLY
def test_seven_data_bits_of_a_serial_port_carry_their_parity(tmp_path: Path) -> None:
    device = LINES.replace("unit", "baud_rate: 9600, data_bits: 7, parity: E, unit")
    code, facts, errors = measured(tmp_path, device, "--fault=parity", "--fault=flip:0.0005@1-299", address="pty")
    assert (code, facts["verdict"], facts["out_of_tolerance"]) == (3, "uncertain", 0), errors
    assert facts["damaged_bytes"] > 0
    assert 100 < facts["judged"] < COUNT


@pytest.mark.parametrize(
    ("fault", "code", "verdict", "words"),
    [
        ("no-contact:0.05", 3, "uncertain", "the probe touched nothing"),
        ("lost-frames:0.05", 3, "uncertain", "lost"),
        ("no-end", 4, "uncertain", "silent for"),
        ("unplug@150", 4, "uncertain", "the link was lost"),
    ],
)
def test_what_is_missing_never_proves_a_part(fault: str, code: int, verdict: str, words: str, tmp_path: Path) -> None:
    device = LINES.replace("unit", "silence_s: 2, unit") if fault == "no-end" else LINES
    found = measured(tmp_path, device, f"--fault={fault}")
    assert (found[0], found[1]["verdict"]) == (code, verdict), found[2]
    assert words in found[2] + str(found[1])


def test_a_ball_of_another_radius_is_told_by_name(tmp_path: Path) -> None:
    code, _, errors = measured(tmp_path, LINES, "--tip-radius-mm", "2")
    assert code == 4
    assert "radius R of the ball is not the plan's 1.5 mm (probe.tip_radius_mm)" in errors


def test_lines_of_a_macro_of_the_users_own_are_read_by_a_pattern(tmp_path: Path) -> None:
    device = LINES.replace("unit", f"format: {NUMBERED}, unit".replace("{{", "{").replace("}}", "}"))
    code, facts, errors = measured(tmp_path, device, "--fault=cr-only", kind="machine-tool-dprnt")
    assert (code, facts["verdict"], facts["judged"]) == (0, "conform", COUNT), errors
    code, facts, errors = measured(tmp_path, device, "--fault=no-contact:0.05", kind="machine-tool-dprnt")
    assert (code, facts["verdict"]) == (3, "uncertain"), errors
    assert facts["lost"] > 0


def printed(folder: Path, *options: str) -> bytes:
    """What a machine tool prints of the part, from its file."""
    with simulated(
        "machine-tool",
        f"file:{folder / 'printed.txt'}",
        folder,
        "--unpaced",
        *PART,
        *options,
        path_mm=PART_MM,
        count=COUNT,
        rate_hz=5.0,
        speed_mm_s=LENGTH_MM / COUNT * 5.0,
        noise_mm=0.0,
    ) as machine:
        assert machine.tally()["points"] == COUNT
    return (folder / "printed.txt").read_bytes()


def test_a_machine_that_connects_to_us_is_awaited(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    plan = planned(tmp_path, LINES.replace("ADDRESS", address).replace("unit", "listen: true, unit"))
    device = simulated(
        "machine-tool", f"to:{address}", tmp_path, "--unpaced", *PART, path_mm=PART_MM, count=COUNT, rate_hz=5.0,
        speed_mm_s=LENGTH_MM / COUNT * 5.0, noise_mm=0.0,
    )  # fmt: skip
    with device:
        done = cmmlink("run", plan, "--json", "--records", tmp_path / "records")
    assert (done.code, done.json()["judged"]) == (0, COUNT), done.err


def test_a_file_that_is_there_is_read_from_its_beginning_where_the_plan_says_so(tmp_path: Path, undisturbed: bytes) -> None:
    device = LINES.replace("address: 'ADDRESS'", "file: machine.txt, existing: true")
    (tmp_path / "machine.txt").write_bytes(GOLDEN + undisturbed)
    several = cmmlink("run", planned(tmp_path, device), "--json", "--records", tmp_path / "records")
    assert several.code == 2
    assert "machine.txt holds 2 sets" in several.out + several.err
    named = device.replace("unit: mm", "unit: mm, format: {language: g800, result_set: PART-RESULTS}")
    done = cmmlink("run", planned(tmp_path, named), "--json", "--records", tmp_path / "records")
    assert (done.code, done.json()["judged"]) == (0, COUNT), done.err


@pytest.mark.parametrize(
    ("sample", "problem"),
    [
        (b"N 1 X 1.0 Y 2.0 Z 0.\rM30\r", ""),
        (b"N 1 X 1.0 Y 2.0 Z 0.\rHELLO\r", "sample.txt, line 2: 'HELLO' gives no point: line that the pattern does not describe"),
        (b"M30\r", "sample.txt holds no line with a point"),
        (PRINT_OUT, "the machine prints features"),
    ],
)
def test_check_tries_a_pattern_on_a_sample(sample: bytes, problem: str, tmp_path: Path) -> None:
    (tmp_path / "sample.txt").write_bytes(sample)
    told = NUMBERED.replace("{{", "{").replace("}}", ", pass_over: '-+', sample: sample.txt}")
    plan = planned(tmp_path, LINES.replace("ADDRESS", "127.0.0.1:9").replace("unit", f"format: {told}, unit"))
    checked = cmmlink("check", plan)
    assert checked.code == (2 if problem else 0), checked.err
    assert problem in checked.err
    assert ("device.format.sample" in checked.err) is bool(problem)


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ("address: COM3, file: prints.txt", "expected either an address or a file"),
        ("unit: mm", "expected either an address or a file"),
        ("address: COM3, listen: true", "expected listen beside an address host:port only"),
        ("address: COM3, existing: true", "expected existing only beside a file"),
        ("address: COM3, parity: N", "expected parity: E or O beside 7 data bits"),
        ("address: COM3, format: {pattern: 'X(?P<x>.*)Y(?P<y>.*)'}", "expected end or points beside a pattern, so that the scan ends"),
        (
            "address: COM3, format: {pattern: 'X(?P<x>.*', end: M30}",
            "expected lines that can be told apart: pattern 'X(?P<x>.*' is no regular",
        ),
        ("address: COM3, format: {language: g800, end: M30}", "expected end, points, pass_over and request only beside a pattern"),
        ("address: COM3, format: {points: 3}", "expected either language or pattern"),
        ("address: COM3, format: g801", "device.format.language is 'g801'"),
        (
            "address: COM3, reconnect_s: 5, format: {pattern: 'X(?P<x>.*)Y(?P<y>.*)', points: 3}",
            "expected reconnect_s: 0 where the pattern",
        ),
    ],
)
def test_a_device_that_cannot_be_so_is_told_with_what_is_allowed(keys: str, told: str, tmp_path: Path) -> None:
    plan = planned(tmp_path, f"{{type: lines, {keys}{', unit: mm' if 'unit' not in keys else ''}}}")
    assert told in cmmlink("check", plan).refused()


def test_a_lost_link_that_comes_back_costs_the_lines_that_were_lost_with_it(tmp_path: Path) -> None:
    device = LINES.replace("unit", "reconnect_s: 20, unit")
    code, facts, errors = measured(tmp_path, device, "--fault=unplug:0.1@100")
    assert (code, facts["verdict"]) == (3, "uncertain"), errors
    assert facts["judged"] + facts["rejected"] == facts["received"]
    assert COUNT - facts["lost"] <= facts["received"] or facts["damaged_bytes"] > 0
