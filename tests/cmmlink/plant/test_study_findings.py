"""Findings of studies: budgets by hand, what a study lacks in words, and its file, which comes back as it was written."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.plant import (
    Reference,
    StudiedCharacteristic,
    Study,
    StudyRun,
    budget_of,
    crossed_study,
    findings_of,
    read_study,
    study_text,
)

CHORD = StudiedCharacteristic("chord", "chord", "mm", 59.9, 60.1, {"device": 0.0012})
# AIAG MSA, 4th edition, table III-B 6a: 10 parts, operators A, B and C, 3 trials; here the first three parts
TABLE = np.array(
    [
        [[0.29, 0.41, 0.64], [0.08, 0.25, 0.07], [0.04, -0.11, -0.15]],
        [[-0.56, -0.68, -0.58], [-0.47, -1.22, -0.68], [-1.38, -1.13, -0.96]],
        [[1.34, 1.17, 1.27], [1.19, 0.94, 1.34], [0.88, 1.09, 0.67]],
    ]
)


def run(number: int, part: str, operator: str, value: float, strip: tuple[float | None, ...] = (0.0, 0.0)) -> StudyRun:
    return StudyRun(f"run{number}", f"{number:064x}", "2026-11-02T08:00:00Z", part, operator, {"chord": value}, strip)


def crossed(values: Any = TABLE) -> Study:
    runs = [
        run(100 * p + 10 * o + r, f"P{p}", "ABC"[o], value, (value, 2 * value))
        for p, of_part in enumerate(values)
        for o, of_operator in enumerate(of_part)
        for r, value in enumerate(of_operator)
    ]
    return Study("crossed", "blade", {}, 200.0, (CHORD,), tuple(runs))


def test_a_crossed_study_finds_what_the_analysis_of_its_table_finds_whatever_the_order_of_its_runs() -> None:
    study = crossed()
    found = findings_of(study)
    assert (found.parts, found.operators, found.repeats) == (("P0", "P1", "P2"), ("A", "B", "C"), 3)
    (chord,) = found.findings
    assert chord.crossed == crossed_study(TABLE, CHORD.tolerance)
    mixed = np.random.default_rng(3).permutation(len(study.runs))
    again = findings_of(replace(study, runs=tuple(study.runs[k] for k in mixed)))
    assert again.findings[0].budget.expanded == pytest.approx(chord.budget.expanded, rel=1e-12)
    assert found.along.gauge[1] == pytest.approx(2 * found.along.gauge[0])
    assert found.along.gauge[0] == pytest.approx(chord.crossed.line("gauge R&R").sigma)


def test_the_budget_adds_squares_and_takes_k_from_the_effective_degrees_of_freedom() -> None:
    # GUM G.4.1: u = 5, from 3 with 4 degrees of freedom and 4 with infinitely many; 625 / (81 / 4) = 30.86
    found = budget_of([("a", "A", 3.0, 4), ("b", "B", 4.0, None)])
    assert found.standard == 5.0
    assert found.freedom == pytest.approx(625 / (81 / 4))
    assert 2.07 < found.factor < 2.09  # by table G.2, t for 95.45 % and 35 and 30 degrees of freedom
    assert found.expanded == found.factor * 5.0
    assert [line.share for line in found.sources] == pytest.approx([0.36, 0.64])
    assert budget_of([("b", "B", 4.0, None)]).factor == 2.0
    for freedom, factor in ((4, 2.87), (10, 2.28), (50, 2.05)):  # the same table
        assert budget_of([("a", "A", 1.0, freedom)]).factor == pytest.approx(factor, abs=5e-3)


def test_a_type_one_study_counts_its_bias_as_rectangular_and_its_reference_by_half_its_u() -> None:
    values = 60.003 + 0.002 * np.array([-1, 1, -1, 1, 0, 0])
    runs = tuple(run(k, "master", "", value, (value - 60, None)) for k, value in enumerate(values))
    found = findings_of(Study("type-1", "master", {"chord": Reference(60.0, 0.0008)}, 200.0, (CHORD,), runs))
    (chord,) = found.findings
    sigma = math.sqrt(4 * 0.002**2 / 5)
    assert [line.standard for line in chord.budget.sources] == pytest.approx([sigma, 0.003 / math.sqrt(3), 0.0004, 0.0012])
    assert chord.type_one is not None
    assert chord.type_one.cgk == pytest.approx((0.1 * 0.2 - 0.003) / (3 * sigma))
    assert found.along.repeatability[0] == pytest.approx(sigma)
    assert math.isnan(found.along.repeatability[1])


def test_what_a_study_lacks_is_said_in_words() -> None:
    study = crossed()
    lacking = {
        "no runs yet": replace(study, runs=()),
        "part P2 by operator C has 2 of 3 repeats: every pair": replace(study, runs=study.runs[:-1]),
        "part P2 by operator B has 0 of 3 repeats, and so do 1 more": replace(study, runs=study.runs[:-6]),
        "has 1 part and 3 operators": replace(study, runs=study.runs[:9]),
        "is of one part, and the runs are of 3: P0, P1, P2": replace(study, kind="type-1"),
        "has 3 runs; a type-1 study needs at least 5": replace(study, kind="type-1", runs=study.runs[:3]),
        "chord is left out: no reference value was stated": replace(study, kind="type-1", runs=study.runs[:9]),
    }
    for words, one in lacking.items():
        with pytest.raises(ValueError, match=words):
            findings_of(one)


def test_a_study_comes_back_from_its_file_and_what_is_none_is_refused(tmp_path: Path) -> None:
    study = crossed()
    path = tmp_path / "blade.json"
    path.write_text(study_text(study), encoding="utf-8")
    assert read_study(path) == study
    for text in (
        "",
        "[]",
        "{}",
        '{"schema": 9}',
        study_text(study).replace('"crossed"', '"nested"'),
        study_text(study).replace("0.29", '"x"'),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=r"blade\.json: no study"):
            read_study(path)
