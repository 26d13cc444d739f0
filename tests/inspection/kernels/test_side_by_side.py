"""Two processes that compile at once: the other one is started where it pays, and its end is waited for, whatever happens."""

import gc
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from inspection.kernels import OutlierLimit, PoseFit, pose, side_by_side
from inspection.kernels.outliers import mark_outliers
from inspection.kernels.pose_sums import _evaluate_optimised_again, add_up
from inspection.kernels.side_by_side import fit_compiled_beside, is_fit_compiled
from tests.inspection import profiles

MARK = "import sys; from pathlib import Path; Path({!r}).write_text(chr(10).join(sys.argv[1:]))"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the compiled code would be; what stands for compiling leaves a mark."""
    monkeypatch.setattr(side_by_side, "compiled_code_folder", lambda: tmp_path)
    monkeypatch.setattr(side_by_side, "_CHILD", MARK.format(str(tmp_path / "mark")))
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    return tmp_path


def test_the_other_process_has_ended_with_the_block_and_imports_this_very_package(folder: Path) -> None:
    for outliers in (False, True):
        with fit_compiled_beside(outliers) as comes:
            assert comes
            assert not gc.isenabled()
        assert gc.isenabled()
        root, asked = (folder / "mark").read_text().splitlines()
        assert Path(root) / "inspection" / "kernels" == Path(side_by_side.__file__).parent
        assert asked == ("outliers" if outliers else "fit")


def test_no_other_process_where_the_fit_is_on_disk_or_there_is_one_processor(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    with fit_compiled_beside():
        pass
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    assert not is_fit_compiled()
    (folder / "of_this_package").mkdir()
    (folder / "of_this_package" / "pose._settle_pose-128.py311.nbi").touch()
    assert is_fit_compiled()
    with fit_compiled_beside() as comes:
        assert not comes
        assert gc.isenabled()
    assert not (folder / "mark").exists()


@pytest.mark.usefixtures("folder")
def test_an_error_in_the_block_ends_the_other_process_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[subprocess.Popen[bytes]] = []
    popen = subprocess.Popen

    def start(command: list[str], **pipes: Any) -> "subprocess.Popen[bytes]":
        started.append(popen(command, **pipes))
        return started[-1]

    monkeypatch.setattr(side_by_side, "_CHILD", "import time; time.sleep(50)")
    monkeypatch.setattr(subprocess, "Popen", start)
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt), fit_compiled_beside():
        raise KeyboardInterrupt
    assert started[0].returncode is not None
    assert time.monotonic() - began < 30
    assert gc.isenabled()


@pytest.mark.usefixtures("folder")
def test_where_no_process_can_be_started_this_one_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    with fit_compiled_beside():
        went_on = True
    assert went_on


def test_nothing_is_left_to_compile_for_a_fit_once_it_was_compiled_without_a_point() -> None:
    pose.compile_fit(outliers=True)
    kernels: list[Any] = [pose._settle_pose, mark_outliers, pose._next_pose, add_up]
    compiled = [len(kernel.signatures) for kernel in kernels]
    nominal = profiles.nominal_of("P3", 500)
    fit = PoseFit(nominal.points_mm + 0.01, nominal.grid, None, "exact", nominal.outward, 0.0)
    fit.settle((0.0, 0.0, 0.0), 5)
    fit.settle_nearby((0.0, 0.0, 0.0))
    limit = OutlierLimit(10.0, 1e-3, 1e-6)
    fit.find_outliers_nearby(fit.find_outliers((0.0, 0.0, 0.0), limit, 5), limit)
    assert [len(kernel.signatures) for kernel in kernels] == compiled
    assert all(compiled)
    shared: Any = _evaluate_optimised_again
    assert len(shared.signatures) == 1, "what takes longest is compiled once for all that call it"
