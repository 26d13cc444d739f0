"""Room on a disk for long scans: arrays as of numpy, gone when nobody holds them, an error where the disk is full, told beforehand."""

import gc
import shutil
from collections import namedtuple
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.errors import StoreError
from cmmlink.scratch import FINISHING_BYTES, RESERVE_BYTES, ROWS_IN_MEMORY, RUNNING_BYTES, Scratch, points_that_fit, scratch_in
from inspection import LiveInspection
from inspection.scan_rows import ScanRows
from tests.inspection.live_scans import ZONE, live_scan

Usage = namedtuple("Usage", ["total", "used", "free"])


class LittleRoom:
    """Zeros to write in pieces of 4 kB, of which the disk takes six."""

    def __init__(self) -> None:
        self.left = 6

    def __len__(self) -> int:
        return 4096

    def __getitem__(self, part: slice) -> bytes:
        self.left -= 1
        if self.left < 0:
            raise OSError(28, "No space left on device")
        return bytes(4096)[part]


def disk_of(free: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(free, 0, free))


def test_short_arrays_are_in_memory_and_long_ones_in_files_that_nobody_sees(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path, rows_in_memory=1000)
    short, long = scratch((1000, 2), np.float64), scratch((1001, 2), np.float64)
    assert short.base is None
    assert (long.shape, str(long.dtype), long.flags.c_contiguous, long.flags.writeable) == ((1001, 2), "float64", True, True)
    assert not long.any(), "the file was written, not left with holes"
    long[:] = np.arange(2002.0).reshape(1001, 2)
    more = scratch((5000,), np.int8)  # what was mapped before is given back to the system, and stays as it is
    more[:] = 7
    assert np.array_equal(long, np.arange(2002.0).reshape(1001, 2))
    del long, more
    gc.collect()
    assert list(tmp_path.iterdir()) == []


def test_an_array_grows_and_shrinks_where_it_lies(tmp_path: Path) -> None:
    scratch = Scratch(tmp_path, rows_in_memory=1000)
    before = scratch((2000, 2), np.float64)
    before[:] = np.arange(4000.0).reshape(2000, 2)
    after = scratch.resize(before, 5000)
    assert after is not None
    assert (after.shape, str(after.dtype), after.flags.c_contiguous, after.flags.writeable) == ((5000, 2), "float64", True, True)
    assert np.array_equal(after[:2000], before), "nothing is lost"
    after[0] = -1.0
    assert before[0, 0] == -1.0, "and nothing was copied"
    del before
    fewer = scratch.resize(after, 100)
    assert fewer is not None
    assert np.shares_memory(fewer, after)
    assert len(fewer) == 100
    del after
    again = scratch.resize(fewer, 6000)
    assert again is not None
    assert again[1999, 1] == 3999.0
    assert not again[5000:].any()
    assert scratch.resize(scratch((1000,), np.int8), 2000) is None, "what lies in memory has to be copied"
    del fewer, again
    gc.collect()
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_while_an_array_grows_leaves_it_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scratch = Scratch(tmp_path, rows_in_memory=1000)
    array = scratch((2000,), np.float64)
    array[:] = 7.0
    monkeypatch.setattr("cmmlink.scratch._PIECE", LittleRoom())
    with pytest.raises(StoreError, match=r"a scan of 9000 points does not fit there \(No space left on device\)"):
        scratch.resize(array, 9000)
    assert np.all(array == 7.0)
    monkeypatch.undo()
    longer = scratch.resize(array, 9000)
    assert longer is not None
    assert np.all(longer[:2000] == 7.0)
    assert not longer[2000:].any()


def test_a_scan_grows_on_the_disk_without_a_copy_and_its_result_is_that_of_memory(tmp_path: Path) -> None:
    given = live_scan("late form", 3, 3000)
    scratch, copied = Scratch(tmp_path, rows_in_memory=500), list[int]()

    class Watched(Scratch):
        def __call__(self, shape: tuple[int, ...], kind: type[np.generic]) -> NDArray[Any]:
            copied.extend(shape[:1] if len(shape) == 2 else ())
            return scratch(shape, kind)

        def resize(self, array: NDArray[Any], rows: int) -> NDArray[Any] | None:
            return scratch.resize(array, rows)

    with patch("inspection.scan_rows._MORE", 200):
        long = LiveInspection(given.nominal, ZONE, room=Watched(tmp_path))
        long._kept = ScanRows(100, room=long._kept.room)
        copied.clear()
        for points in np.array_split(given.points_mm, 40):
            long.add(points)
    assert len(long._kept.verdicts) < 3000 + 200 + 100, "on the disk it grows step by step"
    assert max(copied) <= 2 * 500, "and its points are copied only as long as they are in memory"
    short = LiveInspection(given.nominal, ZONE)
    short.add(given.points_mm)
    here, there = short.finish(), long.finish()
    assert here.verdict is there.verdict
    for name in ("station_mm", "deviation_mm", "verdicts", "rejection"):
        assert np.array_equal(getattr(here, name), getattr(there, name), equal_nan=True), name


def test_a_full_disk_is_an_error_that_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cmmlink.scratch._UnnamedFile.map", full)
    with pytest.raises(StoreError, match=r"a scan of 2000000 points does not fit there \(No space left on device\)") as error:
        Scratch(tmp_path)((2_000_000,), np.float64)
    assert str(tmp_path) in str(error.value)
    assert "--records DIR" in str(error.value)


def test_how_many_points_fit_is_told_and_a_run_that_cannot_be_kept_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scratch = Scratch(tmp_path)
    disk_of(RESERVE_BYTES + 3_000_000 * (RUNNING_BYTES + FINISHING_BYTES), monkeypatch)
    assert points_that_fit(tmp_path / "not" / "there") == 3_000_000
    assert scratch.refusal(0, 3_000_000) == ""
    assert "announces 3,000,001 points and there is room for 3,000,000" in scratch.refusal(0, 3_000_001)
    disk_of(RESERVE_BYTES + 1_000_000 * FINISHING_BYTES, monkeypatch)
    assert scratch.refusal(1_000_000) == ""
    told = scratch.refusal(1_000_001)
    assert told.startswith(f"{tmp_path}: only 378 MB are free after 1,000,001 points; the run ends here so that it can be kept")
    disk_of(0, monkeypatch)
    assert points_that_fit(tmp_path) == 0


def test_where_nothing_can_be_written_the_system_s_folder_serves(tmp_path: Path) -> None:
    assert scratch_in(tmp_path).folder == tmp_path
    assert scratch_in(tmp_path / "not" / "yet").folder == tmp_path, "the disk on which the records will be"
    (file := tmp_path / "file").touch()
    assert scratch_in(file).folder == scratch_in(None).folder != tmp_path
    assert ROWS_IN_MEMORY >= 100_000
