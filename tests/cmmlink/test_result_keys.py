"""What every command prints as JSON, and every table that it writes, has the keys that docs/results.md explains, and no other."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from cmmlink import archive_keys, comparison_keys, inspection_keys, plant_keys, record_keys, result_keys
from cmmlink.deviations_csv import COLUMNS
from cmmlink.plan.reference import groups_of
from cmmlink.plant_keys import PlantAddress, PlantAgreement, PlantOutbox
from cmmlink.record.evidence import CHAIN_COLUMNS
from cmmlink.record.export import POINT_COLUMNS, WIRE_COLUMNS
from cmmlink.record_keys import KeyHandedOver, KeyShown, StationKey, Verified
from cmmlink.report.stack_folder import CONTOUR_COLUMNS, SECTION_COLUMNS
from cmmlink.result_keys import (
    Exported,
    Inspected,
    Measured,
    Recorded,
    Replayed,
    Reported,
    Runs,
    Shown,
    StackInspected,
    Understood,
)
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.drivers.surface.meshes import binary_stl, tube, write

KEYS = vars(result_keys) | vars(inspection_keys) | vars(archive_keys) | vars(comparison_keys) | vars(plant_keys) | vars(record_keys)
OBJECTS = [value for value in KEYS.values() if isinstance(value, type) and issubclass(value, BaseModel) and value.model_fields]


def printed(model: type[BaseModel], *arguments: object) -> Any:
    """The object that a command prints, with every key known to the model and of its type."""
    found = cmmlink(*arguments, "--json").json()
    model.model_validate(found)
    return found


def header_of(path: Path) -> list[str]:
    with path.open(encoding="utf-8", newline="") as file:
        return next(csv.reader(file))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A nominal, points off it with a bump, a plan for them, and the record of one run."""
    folder = tmp_path_factory.mktemp("oval")
    write_nominal(folder / "oval.yaml")
    deviation_mm = 0.001 * np.sin(np.arange(360))
    deviation_mm[100:110] = 0.2
    write_points(folder / "points.csv", oval_points(deviation_mm))
    (folder / "plan.yaml").write_text(
        "part: {name: oval}\nnominal: {file: oval.yaml}\ntolerance: {lower_mm: -0.05, upper_mm: 0.05}\n"
        "device: {type: file, file: points.csv}\nrecords: records\nout: out\n",
        encoding="utf-8",
    )
    printed(Recorded, "run", folder / "plan.yaml", "--headless")
    return folder


@pytest.mark.parametrize("model", OBJECTS)
def test_every_key_is_explained(model: type[BaseModel]) -> None:
    assert [key.name for group in groups_of(model) for key in group.keys if not key.meaning] == []


def test_inspect(folder: Path) -> None:
    out = folder / "inspected"
    arguments = ("inspect", folder / "points.csv", "--nominal", folder / "oval.yaml", "--tolerance", -0.05, 0.05, "--out", out)
    found = printed(Recorded, *arguments)
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", found["measured_at"])
    printed(Measured, *arguments[:7], "--no-record")
    assert found["verdict"] == "nonconform"
    assert len(found["stretches"]) == 1
    assert found["registration"]["other_poses"]  # an ellipse fits half a turn on, too
    assert json.loads((out / "result.json").read_text(encoding="utf-8")) == found
    assert header_of(out / "deviations.csv") == list(COLUMNS)


def test_a_run_without_a_result_has_the_same_keys(folder: Path) -> None:
    plan = folder / "few.yaml"
    write_points(folder / "few.csv", oval_points(0.0)[:2])
    plan.write_text((folder / "plan.yaml").read_text(encoding="utf-8").replace("points.csv", "few.csv"), encoding="utf-8")
    found = printed(Recorded, "run", plan, "--headless")
    assert (found["worst"], found["registration"], found["tolerance"]) == (None, None, None)
    assert Shown.model_validate(cmmlink("show", "last", "--records", folder / "records", "--json").json()).verdict is None


def test_records(folder: Path) -> None:
    records = ("--records", folder / "records")
    first = printed(Runs, "runs", *records)["runs"][0]["run"]
    assert printed(Shown, "show", first, *records)["result"]["verdict"] == "nonconform"
    assert printed(Replayed, "replay", first, *records)["identical"] is True
    changed = printed(Replayed, "replay", first, "--tolerance", -0.3, 0.3, *records)
    assert [change["key"] for change in changed["changed"]] == ["tolerance.lower_mm", "tolerance.upper_mm"]
    assert not printed(Verified, "verify", *records)["altered"]
    shown = printed(StationKey, "key", "show", *records)
    assert printed(Verified, "verify", *records)["signatures"]["keys"][0]["public_key"] == shown["public_key"]
    assert printed(KeyHandedOver, "key", "rotate", "--reason", "yearly", *records)["before"] == shown["public_key"]
    printed(KeyShown, "key", "new", folder / "stick.pem")
    assert printed(PlantOutbox, "plant", "status", *records)["waiting"] == printed(PlantOutbox, "plant", "push", *records)["added"] > 0
    assert printed(PlantAgreement, "plant", "verify", *records)["sound"]
    assert printed(PlantAddress, "plant", "address", *records)["address"] == str(folder / "records" / "plant.sqlite")
    written = printed(Exported, "export", first, "--out", folder / "exported", *records)["files"]
    assert Path(printed(Reported, "report", first, "-o", folder / "a.pdf", *records)["file"]).read_bytes().startswith(b"%PDF")
    tables = {Path(name).name: header_of(Path(name)) for name in written if name.endswith(".csv") and "nominal" not in name}
    columns = {"points.csv": POINT_COLUMNS, "wire.csv": WIRE_COLUMNS, "chain.csv": CHAIN_COLUMNS, "deviations.csv": COLUMNS}
    assert tables == {name: list(keys) for name, keys in columns.items()}
    Shown.model_validate_json((folder / "exported" / "run.json").read_bytes())
    Inspected.model_validate_json((folder / "exported" / "result.json").read_bytes())


def test_an_altered_record(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "station.sqlite"
    content = (folder / "records" / "station.sqlite").read_bytes()
    assert b"best-fit" in content
    copy.write_bytes(content.replace(b"best-fit", b"best-fIt", 1))
    found = printed(Verified, "verify", "--records", tmp_path)
    assert found["altered"]
    assert found["first"]["message"]


def test_surfaces(folder: Path) -> None:
    oval = oval_points(0.0)
    surface = write(folder / "oval.stl", binary_stl(tube(oval, np.array([0.0, 10.0]))))
    out = folder / "stack"
    arguments = ("--nominal", folder / "oval.yaml", "--tolerance", -0.05, 0.05, "--heights", 3, 6, "--cutter", "numpy", "--no-pictures")
    found = printed(StackInspected, "ct", surface, *arguments, "--out", out)
    assert [section["height_mm"] for section in found["slices"]] == [3.0, 6.0]
    assert header_of(out / "sections.csv") == list(SECTION_COLUMNS)
    assert header_of(out / "section-001_3.000mm" / "contours.csv") == list(CONTOUR_COLUMNS)


def test_nominal(folder: Path) -> None:
    assert printed(Understood, "nominal", folder / "oval.yaml")["degree"] == 2
