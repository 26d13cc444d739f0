"""Records of a station with runs of every kind, and the databases that they are pushed to."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from cmmlink.record.bodies import pack_document
from cmmlink.record.chain import Draft, Kind
from cmmlink.record.reader import open_to_record, recorded_run
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.plant.conftest import address, server
from tests.cmmlink.recorded import today

__all__ = ["address", "server"]


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that does not conform, one that does, and a judgement of the first that was made later; with what the command told of them."""
    folder = tmp_path_factory.mktemp("pushed")
    nominal = write_nominal(folder / "oval.yaml")
    for name, bump_mm in (("bad", 0.06), ("good", 0.01)):
        deviation_mm = np.zeros(360)
        deviation_mm[100:110] = bump_mm
        points = write_points(folder / f"{name}.csv", oval_points(deviation_mm))
        asked = ("inspect", points, "--nominal", nominal, "--tolerance", -0.05, 0.05, "--fit", "none")
        told = cmmlink(*asked, "--records", folder / "records", "--json").json()
        (folder / f"{name}.json").write_text(json.dumps(told), encoding="utf-8")
    changed = ("--set", "tolerance.upper_mm=0.08", "--reason", "concession 4711", "--operator", "Ada")
    assert cmmlink("replay", "last~1", "--records", folder / "records", *changed).code == 0
    return folder


@pytest.fixture
def records(measured: Path, tmp_path: Path) -> Path:
    """A copy of these records."""
    return Path(shutil.copytree(measured / "records", tmp_path / "records"))


def add_runs(folder: Path, count: int) -> list[str]:
    """Add runs that were aborted before a point came: all that a run needs, and quick to write."""
    with open_to_record(folder, today) as store:
        like = recorded_run(store, store.begins_and_ends()[0][0].run)
        first = store.count_runs() + 1
        names = [f"20260314-150926-{number:04d}" for number in range(first, first + count)]
        for name in names:
            header = {**like.header, "run": name, "part": "quick"}
            end = {"state": "aborted", "message": "", "ended": header["started"], "received": 0, "verdict": None, "coverage": None}
            bodies: tuple[tuple[Kind, bytes], ...] = (
                ("run", pack_document(header)), ("plan", like.plan.encode()), ("nominal", like.nominal), ("end", pack_document(end)),
            )  # fmt: skip
            store.append([Draft(name, kind, body) for kind, body in bodies])
    return names
