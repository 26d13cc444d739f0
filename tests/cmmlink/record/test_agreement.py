"""What a replay says where it is not identical: the last bits of another processor, another decision, and what is missing."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.record import agreement
from cmmlink.record.bodies import pack_judged, unpack_judged
from cmmlink.record.kept_result import judged_bodies
from cmmlink.record.reader import open_to_read, recorded_run
from cmmlink.record.replay import replay_run
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.recorded import today


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The records of one run, with a characteristic."""
    folder = tmp_path_factory.mktemp("station")
    write_nominal(folder / "oval.yaml")
    write_points(folder / "points.csv", oval_points(np.linspace(-0.02, 0.04, 360)))
    plan = "part: {name: oval}\nnominal: {file: oval.yaml}\ndevice: {type: file, file: points.csv}\nregistration: {fit: none, datum: {}}\n"
    plan += "out: null\ncharacteristics:\n"
    plan += "  - {name: form, type: line-profile, zone: {width_mm: 0.1}}\n  - {name: chord, type: chord, upper_mm: 0.2}\n"
    (folder / "plan.yaml").write_text(plan, encoding="utf-8")
    assert cmmlink("run", folder / "plan.yaml", "--headless", "--records", folder / "records").code in (0, 1, 3)
    return folder


def replayed(folder: Path) -> agreement.Agreement:
    with open_to_read(folder / "records", today) as store:
        (begin, _), *_ = store.begins_and_ends()
        return replay_run(store, recorded_run(store, begin.run), lambda _: None).agreement


def with_rows(monkeypatch: pytest.MonkeyPatch, change: dict[str, Any]) -> None:
    """Let another processor have found other rows: `change` gives columns of rows for those that this one found."""

    def bodies(result: Any) -> Iterator[tuple[int, bytes]]:
        for _, body in judged_bodies(result):
            rows = unpack_judged(body)
            columns = {
                name: getattr(rows, name).copy() for name in ("actual_mm", "foot_mm", "station_mm", "deviation_mm", "verdicts", "rejection")
            }
            for name, changed in change.items():
                columns[name] = changed(columns[name])
            yield from pack_judged([type(rows)(**columns)])

    monkeypatch.setattr(agreement, "judged_bodies", bodies)


def test_the_same_bits_are_identical_and_so_is_the_decision(folder: Path) -> None:
    found = replayed(folder)
    assert (found.identical, found.same_decision, found.apart, found.differs) == (True, True, 0.0, ())
    again = replayed(folder)
    assert (again.result_sha256, again.decision_sha256) == (found.result_sha256, found.decision_sha256)


def test_last_bits_are_told_from_another_decision(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = replayed(folder)
    with_rows(monkeypatch, {"deviation_mm": lambda e: np.nextafter(e, np.inf)})
    found = replayed(folder)
    assert (found.identical, found.same_decision, found.holds) == (False, True, True)
    assert found.apart is not None
    assert 0 < found.apart < 1e-17
    assert found.decision_sha256 == sound.decision_sha256
    assert found.result_sha256 != sound.result_sha256
    assert "same decision" in found.words
    ended = cmmlink("replay", "last", "--records", folder / "records", "--json")
    assert (ended.code, ended.json()["identical"], ended.json()["same_decision"]) == (cmmlink_code(folder), False, True)
    assert ended.json()["decision_sha256"] == sound.decision_sha256


def cmmlink_code(folder: Path) -> int:
    shown = cmmlink("show", "last", "--records", folder / "records", "--json").json()
    return {"conform": 0, "nonconform": 1, "uncertain": 3}[shown["verdict"]]


@pytest.mark.parametrize("row", [0, 359])
@pytest.mark.parametrize("column", ["verdicts", "rejection"])
def test_one_point_decided_otherwise_is_another_decision(folder: Path, monkeypatch: pytest.MonkeyPatch, column: str, row: int) -> None:
    def change(codes: Any) -> Any:
        codes[row] = 1 if codes[row] != 1 else 0
        return codes

    with_rows(monkeypatch, {column: change})
    found = replayed(folder)
    assert (found.identical, found.same_decision, found.holds) == (False, False, False)
    assert "another decision" in found.words
    assert "nothing was changed, yet" in cmmlink("replay", "last", "--records", folder / "records").failed(5)


@pytest.mark.parametrize("by_mm", [1e-6, -1e-8, np.nan])
def test_numbers_farther_apart_than_last_bits_do_not_hold(folder: Path, monkeypatch: pytest.MonkeyPatch, by_mm: float) -> None:
    def change(deviation: Any) -> Any:
        deviation[100] += by_mm
        return deviation

    with_rows(monkeypatch, {"deviation_mm": change})
    found = replayed(folder)
    assert (found.identical, found.same_decision, found.holds) == (False, True, False)
    assert found.apart == (pytest.approx(abs(by_mm), rel=1e-6) if np.isfinite(by_mm) else np.inf)
    assert "nothing was changed, yet" in cmmlink("replay", "last", "--records", folder / "records").err


def test_a_missing_point_does_not_hold(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with_rows(
        monkeypatch, dict.fromkeys(("actual_mm", "foot_mm", "station_mm", "deviation_mm", "verdicts", "rejection"), lambda rows: rows[:-1])
    )
    found = replayed(folder)
    assert (found.same_decision, found.apart, found.holds) == (False, np.inf, False)


def result(verdict: str = "conform", value: float | None = 0.1, kind: str = "gap") -> dict[str, Any]:
    return {
        "verdict": verdict,
        "received": 3,
        "rms_mm": 0.5,
        "reasons": [{"kind": kind, "words": "a gap of 1.25 mm"}],
        "characteristics": [{"name": "chord", "verdict": verdict, "value": value}],
    }


def test_a_decision_holds_no_number_that_was_computed() -> None:
    other = result(value=0.2) | {"rms_mm": 0.4, "reasons": [{"kind": "gap", "words": "a gap of 1.26 mm"}]}
    assert agreement.decision_of(other) == agreement.decision_of(result())
    for changed in (result("nonconform"), result(kind="lost"), result() | {"received": 4}, result() | {"characteristics": []}):
        assert agreement.decision_of(changed) != agreement.decision_of(result())


def test_a_value_that_only_one_of_them_has_is_infinitely_far() -> None:
    assert agreement._values_apart(result(), result(value=0.1 + 1e-12)) == pytest.approx(1e-12, rel=1e-3)
    assert agreement._values_apart(result(), result(value=None)) == np.inf
    assert agreement._values_apart(result(), result() | {"characteristics": []}) == np.inf
    assert agreement._values_apart(result(value=None), result(value=None)) == 0.0
