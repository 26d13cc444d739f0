"""`cmmlink run` with the plan of a whole surface and simulated devices: every point is accounted for, and a replay finds the same."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.cmmlink.command import cmmlink
from tests.drivers.surface.meshes import binary_stl
from tests.integration.simulated import simulated

TURN = np.linspace(0.0, 2.0 * np.pi, 1001)
OVAL_MM = np.column_stack([40.0 * np.cos(TURN) + 4.0 * np.cos(2.0 * TURN), 15.0 * np.sin(TURN)])
ROUND_MM = 20.0 * np.column_stack([np.cos(TURN), np.sin(TURN)])
COUNT, LOW_MM, HIGH_MM, RADIUS_MM = 800, -0.5, 0.5, 1.5
PLAN = """\
part: {{name: wall}}
surface: {{file: wall.stl}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
registration: {{fit: none}}
gap_max_mm: 3
device: {device}
probe: {{tip_radius_mm: {radius}}}
records: kept
out: null
"""


def write_wall(path: Path, outline_mm: NDArray[np.float64]) -> None:
    """Write the wall over a closed outline (k, 2), counterclockwise, as a mesh that is open above and below."""
    low, high = (np.column_stack([outline_mm, np.full(len(outline_mm), z)]) for z in (LOW_MM, HIGH_MM))
    a, b, c, d = low[:-1], low[1:], high[1:], high[:-1]
    path.write_bytes(binary_stl(np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])))


def run(folder: Path, device: str, radius_mm: float = 0.0) -> tuple[int, dict[str, Any], str]:
    plan = folder / "plan.yaml"
    plan.write_text(PLAN.format(device=device, radius=radius_mm), encoding="utf-8")
    done = cmmlink("run", plan, "--json")
    assert done.out, done.err
    again = cmmlink("replay", "last", "--records", folder / "kept", "--json")
    assert again.json()["identical"] is True, again.err
    return done.code, done.json(), done.err


@pytest.mark.parametrize(("name", "settings"), [("serial", "type: serial"), ("modbus-ring", "type: modbus, map: generic-ring")])
def test_points_from_a_line_or_registers_are_judged_against_a_surface(name: str, settings: str, tmp_path: Path) -> None:
    write_wall(tmp_path / "wall.stl", OVAL_MM[::2])
    with simulated(name, "127.0.0.1:0", tmp_path, "--unpaced", path_mm=OVAL_MM, count=COUNT, speed_mm_s=500.0, noise_mm=0.001) as device:
        code, facts, errors = run(tmp_path, f"{{{settings}, address: '{device.address}'}}")
    assert (code, facts["verdict"]) == (0, "conform"), errors
    assert (facts["received"], facts["judged"], facts["lost"], facts["rule"]) == (COUNT, COUNT, 0, "datum")


def test_what_a_device_lost_keeps_a_surface_from_conforming(tmp_path: Path) -> None:
    write_wall(tmp_path / "wall.stl", OVAL_MM[::2])
    faults = ["--unpaced", "--fault=lost-frames:0.02", "--fault=sentinel:0.02"]
    with simulated(
        "modbus-ring", "127.0.0.1:0", tmp_path, *faults, path_mm=OVAL_MM, count=COUNT, speed_mm_s=500.0, noise_mm=0.001
    ) as device:
        code, facts, errors = run(tmp_path, f"{{type: modbus, map: generic-ring, address: '{device.address}'}}")
    assert code == 3, errors
    assert [reason["kind"] for reason in facts["reasons"]] == ["missing", "rejected"]
    assert facts["received"] == facts["judged"] + facts["rejected"] == COUNT - facts["lost"]


def test_a_device_that_dies_half_way_ends_with_code_4_and_what_was_received(tmp_path: Path) -> None:
    write_wall(tmp_path / "wall.stl", OVAL_MM[::2])
    with simulated("serial", "127.0.0.1:0", tmp_path, "--unpaced", "--fault=die@400", path_mm=OVAL_MM, count=COUNT) as device:
        code, facts, errors = run(tmp_path, f"{{type: serial, address: '{device.address}', reconnect_s: 0.2}}")
    assert (code, facts["ending"], facts["verdict"]) == (4, "interrupted", "uncertain"), errors
    assert 0 < facts["received"] < COUNT


PATHS = ", ".join(
    f"{{type: circle, via_mm: [[30, 0, 20], [30, 0, {z}]], centre_mm: [0, 0, {z}], start_mm: [20, 0, {z}], axis: [0, 0, 1], step_deg: 2}}"
    for z in (-0.4, 0.0, 0.4)
)
PART = ["--tip-radius-mm", str(RADIUS_MM), "--form-error-mm", "0.005", "--unpaced"]


def test_several_scans_of_a_coordinate_measuring_machine_are_one_run_of_a_surface(tmp_path: Path) -> None:
    write_wall(tmp_path / "wall.stl", ROUND_MM)
    with simulated("dme", "127.0.0.1:0", tmp_path, *PART, path_mm=ROUND_MM, noise_mm=0.001) as machine:
        code, facts, errors = run(tmp_path, f"{{type: dme, address: '{machine.address}', scans: [{PATHS}]}}", RADIUS_MM)
    assert (code, facts["verdict"], facts["received"]) == (0, "conform", 3 * 181), errors
    assert abs(facts["max_deviation_mm"]) < 0.02
    assert any("decided by distance alone" in note for note in facts["notes"])


def test_a_scan_that_fails_after_others_ends_the_run_with_the_words_of_the_machine(tmp_path: Path) -> None:
    write_wall(tmp_path / "wall.stl", ROUND_MM)
    with simulated("dme", "127.0.0.1:0", tmp_path, *PART, "--fault=no-surface@250", path_mm=ROUND_MM, noise_mm=0.001) as machine:
        code, facts, errors = run(tmp_path, f"{{type: dme, address: '{machine.address}', scans: [{PATHS}]}}", RADIUS_MM)
    assert (code, facts["ending"], facts["verdict"]) == (4, "interrupted", "uncertain"), errors
    assert "the machine gave up ScanOnCircle 2 of 3: error 1006" in errors
    assert 250 <= facts["received"] < 2 * 181
