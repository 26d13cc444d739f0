"""`run --serial --operator --next`: parts in series, serial numbers that a plan asks for, and ones that were measured before."""

from pathlib import Path

import numpy as np
import pytest
import typer

from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import oval_points, write_points


class Station:
    """A plan of a file of points, and records of its own."""

    def __init__(self, folder: Path, asked: str = "") -> None:
        write_points(folder / "nominal.csv", np.vstack([oval_points(0.0), oval_points(0.0)[:1]]))
        write_points(folder / "points.csv", oval_points(0.0))
        self.plan, self.records = folder / "plan.yaml", folder / "records"
        self.plan.write_text(
            f"part: {{name: oval}}\nnominal: {{file: nominal.csv}}\ntolerance: {{lower_mm: -1, upper_mm: 1}}\n"
            f"device: {{type: file, file: points.csv}}\nout: null\n{asked}\n",
            encoding="utf-8",
        )

    def run(self, *words: object) -> Ended:
        return cmmlink("run", self.plan, "--records", self.records, "--headless", *words)

    def measured(self) -> list[tuple[str, str]]:
        shown = [cmmlink("show", run["run"], "--records", self.records, "--json").json() for run in self.runs()]
        return [(run["serial_number"], run["operator"]) for run in shown]

    def runs(self) -> list[dict[str, str]]:
        found = cmmlink("runs", "--records", self.records, "--json").json()["runs"]
        assert isinstance(found, list)
        return found


@pytest.fixture
def station(tmp_path: Path) -> Station:
    return Station(tmp_path)


def test_a_series_is_counted_up_and_its_runs_are_found_by_every_name(station: Station) -> None:
    assert "give the first one with --serial" in station.run("--next").refused()
    assert "expected one of them" in station.run("--next", "--serial", 1).refused()
    assert station.run("--serial", "B-099", "--operator", "A. Weber").code == 0
    assert station.run("--next").code == 0
    assert station.run("--next", "--operator", "C. Mai").code == 0
    assert station.measured() == [("B-099", "A. Weber"), ("B-100", ""), ("B-101", "C. Mai")]
    ids = [run["run"] for run in station.runs()]
    for name, expected in {
        "last": 2, "last~0": 2, "last~2": 0, "2": 1, "0002": 1, "B-099": 0, ids[0]: 0, ids[1][:-1] + "2": 1,
    }.items():  # fmt: skip
        assert cmmlink("show", name, "--records", station.records, "--json").json()["run"] == ids[expected], name
    for name in ("last~3", "4", "B-1", "B-102", "last~", ""):
        assert cmmlink("show", name, "--records", station.records).code == 2, name
    assert "3 runs are meant by" in cmmlink("show", ids[0][:8], "--records", station.records).refused()


def test_a_serial_number_that_was_measured_before_is_said_beside_the_verdict(station: Station) -> None:
    first = station.run("--serial", 7, "--json").json()
    assert not [note for note in first["notes"] if "measured before" in note]
    again = station.run("--serial", 7, "--json").json()
    assert f"the serial number 7 of this part was measured before: run {first['run']}" in again["notes"]
    ended = cmmlink("show", 7, "--records", station.records)
    assert "2 runs are meant by '7'" in ended.refused()


def test_somebody_at_a_terminal_is_asked_once(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)

    def confirm(text: str, **_: object) -> bool:
        asked.append(text)
        return len(asked) > 1

    monkeypatch.setattr(typer, "confirm", confirm)
    assert station.run("--serial", 7).code == 0
    assert asked == []
    assert "it was not measured again" in station.run("--serial", 7).refused()
    assert station.run("--serial", 7).code == 0
    assert len(asked) == 2
    assert len(station.runs()) == 2


def test_a_required_serial_number_is_asked_for_or_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    station = Station(tmp_path, "serial_number: required")
    assert "the plan asks for a serial number, and none was given" in station.run().refused()
    assert station.run("--serial", "7").code == 0
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr(typer, "prompt", lambda *_, **__: "8")
    assert station.run().code == 0
    assert [serial for serial, _ in station.measured()] == ["7", "8"]


@pytest.mark.parametrize(
    ("pattern", "good", "bad"),
    [
        ("B-####", ["B-0042", "B-9999"], ["B-042", "b-0042", "B-00420", "XB-0042", "B-00a2", "B-\u0663\u0663\u0663\u0663"]),
        ("@@ #.?", ["ab 1.x", "ZZ 9.."], ["a1 1.x", "ab 1xx", "ab 1."]),
        ("(a+)+$", ["(a+)+$"], ["a" * 60]),
    ],
)
def test_a_serial_number_is_spelled_as_the_plan_asks(tmp_path: Path, pattern: str, good: list[str], bad: list[str]) -> None:
    station = Station(tmp_path, f"serial_number: {{pattern: '{pattern}'}}")
    for serial in bad:
        assert "is not spelled as the plan asks" in station.run("--serial", serial).refused(), serial
    assert station.run("--serial", good[0]).code == 0
    for serial in good[1:]:
        assert "pattern" not in station.run("--serial", serial).err


def test_a_plan_whose_own_serial_number_or_rule_is_wrong_is_refused(tmp_path: Path) -> None:
    for asked, words in (
        ("serial_number: {pattern: B-####}", "a pattern that part.serial_number has"),
        ("serial_number: wanted", "the word required, or a mapping"),
    ):
        station = Station(tmp_path, asked)
        station.plan.write_text(
            station.plan.read_text(encoding="utf-8").replace("name: oval", "name: oval, serial_number: C-1"), encoding="utf-8"
        )
        assert words in cmmlink("check", station.plan).refused()
    assert "printable text on one line" in Station(tmp_path).run("--serial", "a\nb").refused()
