"""One recorded run in every format, written when it ended, and what else the tests of the formats share."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.cmmlink.command import cmmlink
from tests.cmmlink.judged_oval import bumped
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points

PART, SERIAL, OPERATOR = '=HYPERLINK("//x";"y") <blade> & \'M\u00fcller\'', "@0042", "+Ada;=1+1"
OUT = "{folder: out, formats: [qif, dfq, xlsx, csv, json]}"
PLAN = """
part: {{name: {part}, serial_number: '{serial}'}}
operator: '{operator}'
nominal: {{file: oval.yaml}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.07, uncertainty_mm: 0.01}}
registration: {{datum: {{}}}}
characteristics:
  - {{name: a side with a name that is too long for some, type: line-profile, zone: 0.3 UZ +0.05, from: {{station_mm: 5}},
     to: {{station_mm: 20}}, fit: none}}
  - {{name: a zone that varies, type: line-profile, fit: none,
     zone: {{stations_mm: [0, 56], lower_mm: [-0.1, -0.2], upper_mm: [0.2, 0.3]}}}}
device: {{type: file, file: points.csv}}
records: records
out: {out}
"""


@dataclass(frozen=True, slots=True)
class Measured:
    """A recorded run: its folder, its result.json, and the stem of its other files."""

    folder: Path
    result: dict[str, Any]

    @property
    def out(self) -> Path:
        return self.folder / "out"

    def exported(self, where: Path, *formats: str) -> list[Path]:
        """The files that `export` writes of it from its record."""
        asked = [word for name in formats for word in ("--format", name)]
        told = cmmlink("export", self.result["run"], *asked, "--out", where, "--records", self.folder / "records", "--json")
        assert told.code == 0, told.err
        return [Path(file) for file in told.json()["files"]]


def measure(folder: Path, **changed: str) -> Measured:
    """Measure the oval with a bump by the plan, with keys of it replaced."""
    words = {"part": json.dumps(PART), "serial": SERIAL, "operator": OPERATOR, "out": OUT} | changed
    write_nominal(folder / "oval.yaml")
    write_points(folder / "points.csv", oval_points(bumped()))
    (folder / "plan.yaml").write_text(PLAN.format(**words), encoding="utf-8")
    ran = cmmlink("run", folder / "plan.yaml", "--headless", "--json")
    return Measured(folder, ran.json())


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    return measure(tmp_path_factory.mktemp("measured"))
