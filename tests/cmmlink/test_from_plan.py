"""The nominal of a plan is read once for all that a run asks of it, and again as soon as its file holds anything else."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink import from_plan
from cmmlink.from_plan import notes_on_nominal, profile_of, with_section
from cmmlink.nominal_files import NominalFile, load_nominal
from cmmlink.plan import Plan
from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import TOLERANCE
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points


@pytest.fixture(autouse=True)
def nothing_read_before() -> Iterator[None]:
    from_plan._read.cache_clear()
    yield
    from_plan._read.cache_clear()


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The files that were read as nominals."""
    read: list[Path] = []
    load = load_nominal

    def note(path: Path, *given: Any, **named: Any) -> NominalFile:
        read.append(path)
        return load(path, *given, **named)

    monkeypatch.setattr(from_plan, "load_nominal", note)
    return read


def plan_of(nominal: Path, scale: float = 1.0) -> Plan:
    keys = {"part": {"name": "a"}, "tolerance": {"lower_mm": -1, "upper_mm": 1}, "device": {"type": "file", "file": nominal}}
    return Plan.model_validate(keys | {"nominal": {"file": nominal, "scale": scale}})


def outline(folder: Path, scale: float) -> Path:
    points = oval_points(0.0) * scale
    return write_points(folder / "nominal.csv", np.vstack([points, points[:1]]))


def test_an_inspection_reads_its_nominal_once(tmp_path: Path, reads: list[Path]) -> None:
    nominal = write_nominal(tmp_path / "oval.yaml")
    points = write_points(tmp_path / "points.csv", oval_points(0.01))
    assert cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE, "--no-record", "--json").code == 0
    assert reads == [nominal]


def test_a_file_with_another_content_is_read_anew_whatever_its_name_size_and_time(tmp_path: Path, reads: list[Path]) -> None:
    file = outline(tmp_path, 1.0)
    first, stood = profile_of(plan_of(file)), file.stat()
    assert len(notes_on_nominal(plan_of(file))) > 0
    assert with_section(plan_of(file)) == plan_of(file)
    content = file.read_bytes()
    file.write_bytes(content.replace(b"9.9996", b"9.9896"))
    os.utime(file, ns=(stood.st_atime_ns, stood.st_mtime_ns))
    assert file.stat().st_size == stood.st_size
    assert profile_of(plan_of(file)).length_mm != first.length_mm
    assert len(reads) == 2


def test_other_settings_read_the_file_another_way(tmp_path: Path, reads: list[Path]) -> None:
    file = outline(tmp_path, 1.0)
    lengths = [profile_of(plan_of(file, scale)).length_mm for scale in (1.0, 2.0)]
    assert lengths[1] == pytest.approx(2 * lengths[0])
    assert len(reads) == 2


def test_what_was_read_while_the_file_was_written_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file is written after its content was looked at and before it is read."""
    file = outline(tmp_path, 1.0)
    load = load_nominal

    def write_and_load(path: Path, *given: Any, **named: Any) -> NominalFile:
        outline(tmp_path, 2.0)
        return load(path, *given, **named)

    monkeypatch.setattr(from_plan, "load_nominal", write_and_load)
    twice = profile_of(plan_of(file)).length_mm
    monkeypatch.setattr(from_plan, "load_nominal", load)
    outline(tmp_path, 1.0)
    assert profile_of(plan_of(file)).length_mm == pytest.approx(twice / 2)
