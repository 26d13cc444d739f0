"""An archive judged again gives what a replay of each run gives, whoever judges; what was kept is not judged twice."""

import csv
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from threading import Event
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from distributed import LocalCluster

from cmmlink.archive import COLUMNS, Cluster, Here, Keeper, judge_runs, rejudge
from cmmlink.archive.tasks import Outcome, Task
from cmmlink.archive_keys import ArchiveRejudged
from cmmlink.record import RunSearch, judged_by_means, open_archive, open_to_record
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.recorded import today
from tests.drivers.surface.meshes import binary_stl, tube, write

BUMPS_MM = (0.03, 0.06, 0.07, 0.12)  # against a limit of 0.05, and then of 0.08
WIDER = ("--set", "tolerance.upper_mm=0.08")


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records of four parts with bumps."""
    folder = tmp_path_factory.mktemp("archive")
    nominal = write_nominal(folder / "oval.yaml")
    for name, bump_mm in zip("abcd", BUMPS_MM, strict=True):
        deviation_mm = np.zeros(360)
        deviation_mm[100:110] = bump_mm
        points = write_points(folder / f"part-{name}.csv", oval_points(deviation_mm))
        cmmlink("inspect", points, "--nominal", nominal, "--tolerance", -0.05, 0.05, "--fit", "none", "--records", folder / "records")
    return folder / "records"


@pytest.fixture
def archive(measured: Path, tmp_path: Path) -> Path:
    return shutil.copytree(measured, tmp_path / "records")


def again(archive: Path, *asked: object) -> dict[str, Any]:
    found = cmmlink("rejudge", archive, *asked, "--json").json()
    ArchiveRejudged.model_validate(found)
    return found


def judgements(archive: Path) -> dict[str, list[tuple[str, str]]]:
    """Of each run the hash of every judgement on record, with every deviation to the last bit, and its reason."""
    with open_archive(archive, today) as store:
        runs = [str(begin.run) for begin, _ in store.begins_and_ends()]
        return {run: [(kept.result_sha256, kept.why) for kept in judged_by_means(store, run).values()] for run in runs}


@pytest.fixture(scope="module")
def replayed(measured: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[str, str]]]:
    """The same by one replay after another."""
    folder = shutil.copytree(measured, tmp_path_factory.mktemp("replayed") / "records")
    for run in range(1, len(BUMPS_MM) + 1):
        cmmlink("replay", run, "--records", folder, *WIDER, "--reason", "wider")
    return judgements(folder)


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """A scheduler with two workers, on the loopback of this computer."""
    one_process = {"processes": False, "protocol": "tcp", "host": "127.0.0.1", "dashboard_address": None}
    with LocalCluster(n_workers=2, threads_per_worker=1, **one_process) as cluster:  # type: ignore[no-untyped-call]
        yield cluster.scheduler_address


@pytest.mark.parametrize("who", ["here", "processes", "cluster"])
def test_whoever_judges_the_result_is_that_of_a_replay_to_the_last_bit(
    archive: Path, replayed: dict[str, list[tuple[str, str]]], scheduler: str, who: str
) -> None:
    options = {"here": (), "processes": ("--workers", 2), "cluster": ("--scheduler", scheduler)}[who]
    told = again(archive, *WIDER, "--why", "wider", *options)
    assert judgements(archive) == replayed
    assert [(run["recorded"], run["again"], run["changed"], run["state"], run["kept"]) for run in told["runs"]] == [
        ("CONFORM", "CONFORM", False, "judged", True),
        ("NOT CONFORM", "CONFORM", True, "judged", True),
        ("NOT CONFORM", "CONFORM", True, "judged", True),
        ("NOT CONFORM", "NOT CONFORM", False, "judged", True),
    ]
    assert (told["exit_status"], told["changed"], told["left"]) == (1, 2, 0)
    assert cmmlink("verify", "--records", archive, "--json").json()["state"] == "intact and signed"


def test_nothing_is_kept_without_a_reason_and_nothing_judged_twice_with_one(archive: Path) -> None:
    before = (archive / "station.sqlite").read_bytes()
    tried = again(archive, *WIDER)
    assert (archive / "station.sqlite").read_bytes() == before
    kept = again(archive, *WIDER, "--why", "wider", "--part", "part-B")
    assert [run["part"] for run in kept["runs"]] == ["part-b"]
    more = again(archive, *WIDER, "--why", "wider")
    assert [run["state"] for run in more["runs"]] == ["judged", "known", "judged", "judged"]
    last = again(archive, *WIDER, "--why", "wider")
    assert {run["state"] for run in last["runs"]} == {"known"}
    assert {run: len(found) for run, found in judgements(archive).items()} == dict.fromkeys(judgements(archive), 1)
    told = [[{**run, "state": "", "kept": True} for run in found["runs"]] for found in (tried, more, last)]
    assert told[0] == told[1] == told[2]
    other = again(archive, "--set", "tolerance.upper_mm=0.09", "--why", "wider still")
    assert {run["state"] for run in other["runs"]} == {"judged"}


def test_what_was_stopped_goes_on_where_it_stood(archive: Path, replayed: dict[str, list[tuple[str, str]]]) -> None:
    stop, asked = Event(), list[str]()

    def judge(task: Task) -> list[Outcome]:
        asked.extend(one.run for one in task.runs)
        stop.set()
        return judge_runs(task)

    keeper = Keeper(archive, who="Ada", why="wider", now=today)
    with open_archive(archive, today) as store:
        found = rejudge(
            store, {"tolerance.upper_mm": "0.08"}, lambda _: FourPlaces(), search=RunSearch(), stop=stop, keeper=keeper, judge=judge
        )
    assert (len(found.rows), found.left, len(keeper.kept), len(asked)) == (1, 3, 1, 1)
    assert found.rows[0].kept
    told = again(archive, *WIDER, "--why", "wider")
    assert [run["state"] for run in told["runs"]] == ["known", "judged", "judged", "judged"]
    assert judgements(archive) == replayed


class FourPlaces(Here):
    """As if four judged: each run is a task by itself."""

    places = 4


def test_runs_that_cannot_be_judged_are_named_and_keep_no_other_from_it(archive: Path) -> None:
    with closing(sqlite3.connect(archive / "station.sqlite")) as connection:
        runs = [run for (run,) in connection.execute("SELECT run FROM record WHERE kind = 'run' ORDER BY number")]
        connection.execute("UPDATE record SET body = x'00' || body WHERE run = ? AND kind = 'points'", (runs[1],))
        connection.commit()
    told = again(archive, *WIDER, "--why", "wider")
    assert (told["exit_status"], told["failed"]) == (5, 1)
    assert [run["state"] for run in told["runs"]] == ["judged", "failed", "judged", "judged"]
    assert "what was altered is not judged again" in told["runs"][1]["problem"]
    ended = cmmlink("rejudge", archive, *WIDER)
    assert ended.code == 5
    assert ended.err.startswith(f"cmmlink: {runs[1]}: ")
    assert "4 runs: 0 judged again, 3 as judged before, 1 cannot be judged again" in ended.out


def test_a_backup_is_read_and_the_judgements_are_kept_with_the_runs(archive: Path, tmp_path: Path) -> None:
    backup = tmp_path / "backup.sqlite"
    cmmlink("backup", backup, "--records", archive)
    held = backup.read_bytes()
    assert "expected --records DIR" in cmmlink("rejudge", backup, *WIDER, "--why", "wider").refused()
    told = again(backup, *WIDER, "--why", "wider", "--records", archive)
    assert [run["kept"] for run in told["runs"]] == [True] * 4
    assert {run["state"] for run in again(backup, *WIDER, "--why", "wider", "--records", archive)["runs"]} == {"known"}
    assert backup.read_bytes() == held
    empty = tmp_path / "other"
    with open_to_record(empty, today):
        pass
    lost = again(backup, *WIDER, "--why", "wider", "--records", empty)
    assert (lost["exit_status"], lost["failed"]) == (5, 4)
    assert "add it with `cmmlink merge` first" in lost["runs"][0]["problem"]


def test_an_exported_run_is_an_archive_of_one(archive: Path, tmp_path: Path) -> None:
    cmmlink("export", 2, "--records", archive, "--out", tmp_path / "evidence")
    told = again(tmp_path / "evidence", *WIDER)
    assert [(run["part"], run["recorded"], run["again"]) for run in told["runs"]] == [("part-b", "NOT CONFORM", "CONFORM")]


def test_sections_of_a_surface_are_judged_like_any_run(tmp_path: Path) -> None:
    """A bump of 0.06 mm lies within 0.03 mm of the best zone, and within 0.02 mm of none."""
    deviation_mm = np.zeros(360)
    deviation_mm[100:110] = 0.06
    nominal = write_nominal(tmp_path / "oval.yaml")
    surface = write(tmp_path / "oval.stl", binary_stl(tube(oval_points(deviation_mm), np.array([0.0, 10.0]))))
    options = ("--nominal", nominal, "--tolerance", -0.05, 0.05, "--heights", 3, 6, "--cutter", "numpy", "--no-pictures")
    cmmlink("ct", surface, *options, "--records", tmp_path / "records")
    told = again(tmp_path / "records", "--set", "tolerance.upper_mm=0.02", "--set", "tolerance.lower_mm=-0.02")
    assert [(run["section"], run["recorded"], run["again"]) for run in told["runs"]] == [
        ("section 1 of 2 at 3.000 mm", "CONFORM", "NOT CONFORM"),
        ("section 2 of 2 at 6.000 mm", "CONFORM", "NOT CONFORM"),
    ]


@pytest.mark.parametrize("name", ["table.csv", "table.xlsx"])
def test_the_table_holds_every_run(archive: Path, tmp_path: Path, name: str) -> None:
    ended = cmmlink("rejudge", archive, *WIDER, "--out", tmp_path / name)
    assert "changed: 2, 2 NOT CONFORM -> CONFORM" in ended.out
    assert "now: 3 CONFORM, 1 NOT CONFORM" in ended.out
    assert [path.name for path in tmp_path.glob("table*")] == [name]
    if name.endswith(".csv"):
        with (tmp_path / name).open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
        assert list(rows[0]) == list(COLUMNS)
        assert [row["changed"] for row in rows] == ["0", "1", "1", "0"]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ((), "Missing option '--set'"),
        (("--set", "tolerance.uper_mm=1"), "tolerance.uper_mm is no key of a plan"),
        (("--set", "device.file=x.csv"), "device.file cannot be changed"),
        ((*WIDER, "--out", "table.pdf"), "expected a file that ends in .csv or .xlsx"),
        ((*WIDER, "--out", "nowhere/table.csv"), "there is no folder"),
        ((*WIDER, "--workers", 2, "--scheduler", "tcp://127.0.0.1:1"), "expected one"),
        ((*WIDER, "--records", "there"), "expected --why TEXT"),
        ((*WIDER, "--why", " "), "--why is empty"),
    ],
)
def test_what_cannot_be_asked_is_refused_in_words(measured: Path, asked: tuple[object, ...], words: str) -> None:
    before = (measured / "station.sqlite").read_bytes()
    assert words in cmmlink("rejudge", measured, *asked).refused()
    assert (measured / "station.sqlite").read_bytes() == before


def test_a_scheduler_that_does_not_answer_is_a_failed_link(measured: Path) -> None:
    with patch.object(Cluster.__init__, "__defaults__", (0.2,)):
        assert "no scheduler of Dask answers there" in cmmlink("rejudge", measured, *WIDER, "--scheduler", "tcp://127.0.0.1:1").failed(4)


def test_workers_without_dask_are_told_how_to_have_it(measured: Path) -> None:
    with patch.dict("sys.modules", {"distributed": None}):
        told = cmmlink("rejudge", measured, *WIDER, "--scheduler", "tcp://127.0.0.1:1").refused()
    assert "pip install 'cmmlink[cluster]'" in told
