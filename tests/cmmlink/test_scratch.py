"""Room on a disk for long scans: arrays as of numpy, gone when nobody holds them, an error where the disk is full, told beforehand."""

import gc
import shutil
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest

from cmmlink.errors import StoreError
from cmmlink.scratch import FINISHING_BYTES, RESERVE_BYTES, ROWS_IN_MEMORY, RUNNING_BYTES, Scratch, points_that_fit, scratch_in

Usage = namedtuple("Usage", ["total", "used", "free"])


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


def test_a_full_disk_is_an_error_that_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cmmlink.scratch._mapped_file", full)
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
    assert scratch_in(tmp_path / "missing").folder == scratch_in(None).folder != tmp_path
    assert ROWS_IN_MEMORY >= 100_000
