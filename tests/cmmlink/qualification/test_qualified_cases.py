"""A wrong program does not qualify: with a mistake of one kind, the errors of that kind are outside their limits."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import inspection.scan_rows
from cmmlink.qualification.budget import QUANTITIES, FoundError
from cmmlink.qualification.cases import errors_of_case
from cmmlink.reference import ReferenceCase, reference_cases, write_reference
from inspection import ToleranceZone

NAMES = ("circle", "best-fit-closed", "minimum-zone-closed")
Judged = Callable[..., None]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, ReferenceCase]]:
    """A few cases of the set, one of a kind, as files."""
    folder = tmp_path_factory.mktemp("qualified") / "set"
    cases = {case.name: case for case in reference_cases() if case.name in NAMES}
    write_reference(folder, cases.values())
    return folder, cases


def outside(written: tuple[Path, dict[str, ReferenceCase]], *names: str) -> set[str]:
    """The kinds in which cases are outside their limits."""
    folder, cases = written
    found = [error for name in names for error in errors_of_case(cases[name], folder)]
    assert found
    return {error.quantity.kind for error in found if not error.error <= error.quantity.limit}


def _mistaken(monkeypatch: pytest.MonkeyPatch, change: Callable[[Any], None]) -> None:
    """Change the deviations of rows behind the projection."""
    judge = inspection.scan_rows.ScanRows._judge

    def judge_wrongly(rows: inspection.scan_rows.ScanRows, first: int, stop: int, *more: Any, **named: Any) -> None:
        judge(rows, first, stop, *more, **named)
        change(rows.deviation[first:stop])

    monkeypatch.setattr(inspection.scan_rows.ScanRows, "_judge", judge_wrongly)


def test_a_sound_program_is_inside_every_limit_by_far(written: tuple[Path, dict[str, ReferenceCase]]) -> None:
    folder, cases = written
    found = [error for case in cases.values() for error in errors_of_case(case, folder)]
    assert {error.quantity for error in found} <= set(QUANTITIES)
    assert {error.quantity.kind for error in found} == {"deviation", "pose", "zone"}
    assert [error for error in found if error.error > error.quantity.limit / 100] == []
    assert {error.problem for error in found} == {""}


def test_a_projection_that_is_off_by_a_nanometre_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def add(deviation: Any) -> None:
        deviation += 1e-6

    _mistaken(monkeypatch, add)
    assert "deviation" in outside(written, "circle")


def test_a_sign_that_is_flipped_does_not_qualify(written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch) -> None:
    def flip(deviation: Any) -> None:
        deviation *= -1

    _mistaken(monkeypatch, flip)
    assert "deviation" in outside(written, "circle")


@pytest.mark.parametrize("wider_mm", [1e-6, -1e-6])
def test_a_zone_that_is_a_nanometre_wider_or_narrower_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch, wider_mm: float
) -> None:
    def wider(lower_mm: float, upper_mm: float, uncertainty_mm: float) -> ToleranceZone:
        return ToleranceZone(lower_mm - wider_mm, upper_mm + wider_mm, uncertainty_mm)

    monkeypatch.setattr("cmmlink.plan.deciding.ToleranceZone", wider)
    assert outside(written, "circle") == {"zone"}


def test_whatever_a_case_raises_is_told_and_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> Iterator[FoundError]:
        raise ArithmeticError("a broken library")

    folder, cases = written
    monkeypatch.setattr("cmmlink.qualification.cases.profile_of", fail)
    [error] = errors_of_case(cases["minimum-zone-closed"], folder)
    assert (error.quantity.kind, error.problem) == ("zone", "minimum-zone-closed: a broken library")
    assert outside(written, "minimum-zone-closed") == {"zone"}
