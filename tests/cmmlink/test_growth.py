"""What a file costs grows with its points and no faster: counted work of every stage of a run, over two decades. No time is measured."""

import importlib
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import inspection
from cmmlink.devices import Connected
from cmmlink.plan import FileDevice
from cmmlink.report import write_run
from cmmlink.run import carry_out
from drivers import PointFileSource
from drivers.files import plain_rows
from inspection.cloud import row_blocks
from inspection.kernels import PoseFit, judge_rows
from tests.cmmlink.recorded import small_plan, small_profile, today

COUNTS = (300, 3_000, 30_000)
PACKAGE = Path(inspection.__file__).parent
IN_PIECES = [
    ".".join(["inspection", *file.relative_to(PACKAGE).with_suffix("").parts])
    for file in sorted(PACKAGE.rglob("*.py"))
    if "row_blocks" in file.read_text(encoding="utf-8")
]
STEPS_APART = 1.6  # a fit may take some steps more of other points; work that grows faster than its points is beyond this after two decades


class Work(Counter[str]):
    """Counted work of one run: bytes read, rows gone through, judged and fitted, calls of Python, bytes on record and written."""

    def watch(self, patch: pytest.MonkeyPatch) -> None:
        """Count from now on."""

        def blocks(*args: int | None) -> Iterator[slice]:
            for rows in row_blocks(*args):  # type: ignore[arg-type]  # handed on as they come
                self["rows gone through"] += rows.stop - rows.start
                yield rows

        def judge(section_mm: Any, columns: Any, places: Any, base: int, first: int, stop: int, *settings: Any) -> None:
            self["rows judged"] += stop - first
            judge_rows(section_mm, columns, places, base, first, stop, *settings)

        def settled(fit: PoseFit, pose: tuple[float, float, float], most_steps: int) -> Any:
            found = settle(fit, pose, most_steps)
            self["rows fitted"] += (found.steps + 1) * len(fit.weights)
            return found

        def parse(text: bytes, *settings: Any) -> NDArray[np.float64]:
            self["bytes read"] += len(text)
            return read(text, *settings)

        settle, read = PoseFit.settle, plain_rows._parse
        for name in IN_PIECES:
            patch.setattr(importlib.import_module(name), "row_blocks", blocks)
        patch.setattr("inspection.scan_rows.judge_rows", judge)
        patch.setattr(PoseFit, "settle", settled)
        patch.setattr(plain_rows, "_parse", parse)

    def count_call(self, _frame: object, event: str, _arg: object) -> None:
        """Count a call of a function, in Python or in C."""
        if event in ("call", "c_call"):
            self["calls"] += 1


def points_of(count: int) -> str:
    """A scan of the small plan's part, turned and moved, with form and noise, and a row without numbers now and then."""
    profile, rng = small_profile(), np.random.default_rng(1)
    place = profile.curve.point(np.linspace(*profile.curve.domain, count, endpoint=False)) + rng.normal(0, 0.004, (count, 2))
    x, y = (place @ np.array([[0.8, 0.6], [-0.6, 0.8]]) + [20.0, -7.0]).T
    x[5::1000] = np.nan
    return "x,y\n" + "".join(f"{a:.6f},{b:.6f}\n" for a, b in zip(x.tolist(), y.tolist(), strict=True))


def work_of(count: int, folder: Path) -> Work:
    file, work = folder / "points.csv", Work()
    file.write_text(points_of(count))
    probe = small_plan().probe.model_copy(update={"tip_radius_mm": 0.0})
    plan = small_plan().model_copy(update={"device": FileDevice(type="file", file=file), "probe": probe})
    with pytest.MonkeyPatch.context() as patch:
        work.watch(patch)
        threading.setprofile(work.count_call)
        sys.setprofile(work.count_call)
        try:
            device = Connected(PointFileSource(file), "file", simulated=False)
            records = folder / "records"
            clock = time.monotonic
            finished = carry_out(plan, small_profile(), device, records=records, clock=clock, now=today, stop=threading.Event())
            write_run(folder / "results", finished)
        finally:
            sys.setprofile(None)
            threading.setprofile(None)
    assert finished.outcome.counts.received == count
    work["bytes on record"] = sum(path.stat().st_size for path in (folder / "records").iterdir())
    work["bytes written"] = (folder / "results" / "deviations.csv").stat().st_size
    return work


def test_the_work_of_every_stage_grows_no_faster_than_the_points(tmp_path: Path) -> None:
    found = []
    for count in COUNTS:
        (tmp_path / str(count)).mkdir()
        found.append(work_of(count, tmp_path / str(count)))
    assert {"inspection.cloud", "inspection.scan_rows", "inspection.evaluation.basis"} < set(IN_PIECES)
    assert found[-1]["bytes read"] > 0, "the long file was not read as a stream"
    for smaller, larger, times in ((found[0], found[1], 10), (found[1], found[2], 10), (found[0], found[2], 100)):
        grew = {stage: round(larger[stage] / done, 1) for stage, done in smaller.items() if larger[stage] > STEPS_APART * times * done}
        assert not grew, f"{times} times the points take more than so many times the work: {grew}"
