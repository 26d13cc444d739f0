"""A wrong program does not qualify: with a mistake of one kind, the errors of that kind are outside their limits."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import inspection.filters
import inspection.fine
import inspection.scan_rows
from cmmlink.qualification.budget import QUANTITIES, FoundError
from cmmlink.qualification.cases import errors_of_case
from cmmlink.reference import ReferenceCase, write_reference
from inspection import RigidTransform, ToleranceZone
from tests.cmmlink.qualification.few_cases import case_named

USED = ("open-curve", "best-fit-closed", "minimum-zone-closed", "filter-gaussian", "section-too-large")
chord_file = import_module("inspection.characteristics.chord")  # whose name is a function's at the front door


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, ReferenceCase]]:
    """A few cases of the set, one of a kind, as files."""
    folder = tmp_path_factory.mktemp("qualified") / "set"
    cases = {name: case_named(name) for name in USED}
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
    assert {error.quantity.kind for error in found} == {"deviation", "pose", "zone", "filter", "characteristics"}
    assert [error for error in found if error.error > error.quantity.limit / 2] == []
    assert {error.problem for error in found} == {""}


def test_a_projection_that_is_off_by_a_nanometre_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def add(deviation: Any) -> None:
        deviation += 1e-6

    _mistaken(monkeypatch, add)
    assert "deviation" in outside(written, "open-curve")


def test_a_sign_that_is_flipped_does_not_qualify(written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch) -> None:
    def flip(deviation: Any) -> None:
        deviation *= -1

    _mistaken(monkeypatch, flip)
    assert "deviation" in outside(written, "open-curve")


@pytest.mark.parametrize("wider_mm", [1e-6, -1e-6])
def test_a_zone_that_is_a_nanometre_wider_or_narrower_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch, wider_mm: float
) -> None:
    def wider(lower_mm: float, upper_mm: float, uncertainty_mm: float) -> ToleranceZone:
        return ToleranceZone(lower_mm - wider_mm, upper_mm + wider_mm, uncertainty_mm)

    monkeypatch.setattr("cmmlink.plan.deciding.ToleranceZone", wider)
    assert outside(written, "open-curve") == {"zone"}


def test_a_cutoff_that_is_wrong_by_a_ten_thousandth_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inspection.filters, "_GAMMA", {order: 1.0001 * gamma for order, gamma in inspection.filters._GAMMA.items()})
    assert outside(written, "filter-gaussian") == {"filter"}


def test_a_fit_that_ends_twenty_picometres_off_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch
) -> None:
    pose_of = inspection.fine._pose_of

    def a_little_off(fit: Any) -> RigidTransform:
        pose = pose_of(fit)
        return RigidTransform(pose.rotation_rad, pose.translation_mm + 2e-8)

    monkeypatch.setattr(inspection.fine, "_pose_of", a_little_off)
    assert outside(written, "best-fit-closed") == {"pose"}


def test_a_chord_that_is_wrong_by_a_millionth_does_not_qualify(
    written: tuple[Path, dict[str, ReferenceCase]], monkeypatch: pytest.MonkeyPatch
) -> None:
    between = chord_file._between

    def longer(*given: Any) -> Any:
        found = between(*given)
        return replace(found, value=found.value * (1 + 1e-6))

    monkeypatch.setattr(chord_file, "_between", longer)
    assert outside(written, "section-too-large") == {"characteristics"}


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
