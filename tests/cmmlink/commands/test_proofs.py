"""What is no proof is refused with the reason, before anything is said of a zone."""

import json
from pathlib import Path

import pytest

from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points


@pytest.mark.parametrize(
    "content", [b"", b"part: {name: blade}", b"\xff\xfe\x00", b"[" * 100_000], ids=["empty", "a plan", "bytes", "deep"]
)
def test_a_file_that_is_no_json_is_named_as_such(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "zone.json"
    file.write_bytes(content)
    assert cmmlink("verify-zone", file).failed(2) == f"{file}: is no JSON; expected the zone.json that a run wrote beside its result"


@pytest.mark.parametrize("content", ["[]", "{}", "null", '{"zones": 3}', '{"zones": [{}]}', '{"zones": [{"name": "a", "active": "b"}]}'])
def test_json_that_states_no_zone_is_refused(tmp_path: Path, content: str) -> None:
    file = tmp_path / "zone.json"
    file.write_text(content, encoding="utf-8")
    assert cmmlink("verify-zone", file).failed(2).startswith(f"{file}: ")


def test_the_exported_proof_of_a_recorded_run_is_that_of_the_run_and_of_a_perfect_part_it_is_checked(tmp_path: Path) -> None:
    write_nominal(tmp_path / "oval.yaml")
    write_points(tmp_path / "points.csv", oval_points(0.0))
    (tmp_path / "plan.yaml").write_text(
        "part: {name: oval}\nnominal: {file: oval.yaml}\ndevice: {type: file, file: points.csv}\nrecords: records\nout: out\n"
        "registration: {datum: {rotation_deg: 0.0}}\ntolerance: {lower_mm: -0.05, upper_mm: 0.05}\ncharacteristics:\n"
        "  - {name: half, type: line-profile, zone: 0.1, from: {station_mm: 1}, to: {station_mm: 54}, fit: minimum-zone}\n"
    )
    run = cmmlink("run", tmp_path / "plan.yaml", "--json").json()
    assert run["characteristics"][1]["verdict"] == "conform"
    assert run["characteristics"][1]["reasons"] == []
    cmmlink("export", run["run"], "--records", tmp_path / "records", "--out", tmp_path / "exported")
    written = list((tmp_path / "out").rglob("zone.json")) or list(tmp_path.rglob("out/zone.json"))
    exported = tmp_path / "exported" / "zone.json"
    assert json.loads(exported.read_bytes()) == json.loads(written[0].read_bytes())
    checked = cmmlink("verify-zone", exported)
    assert (checked.code, "half: verified: minimum zone" in checked.out) == (0, True)
