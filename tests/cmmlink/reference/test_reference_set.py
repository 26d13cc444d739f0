"""The reference set as it is written: the same everywhere, whole, in every format; a few digits of its truth.

`make reference` checks every point of every case.
"""

import hashlib
import json
import re
from collections import Counter
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from cmmlink.nominal_files import load_nominal
from cmmlink.reference import CaseKind, reference_cases, texts_of
from tests.cmmlink.command import cmmlink
from tests.cmmlink.reference.formats import check_formats

# Written once here, by CPython 3.11 on x86-64 with its decimal library in C; the one in Python gives the same.
# A case that is added or changed changes it.
GOLDEN = "be09e69587c5dce94c40b2ff45c79e5649d2010851330a68a48530133353ed89"
PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference-set" / "README.md"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The set as the command writes it."""
    folder = tmp_path_factory.mktemp("reference") / "set"
    ended = cmmlink("reference", folder)
    assert (ended.code, ended.err) == (0, "")
    return folder


def test_the_set_is_the_same_to_the_last_bit_on_every_machine(written: Path) -> None:
    assert hashlib.sha256((written / "SHA256SUMS").read_bytes()).hexdigest() == GOLDEN


def test_the_sums_are_of_all_files_and_nothing_is_overwritten(written: Path) -> None:
    listed = dict(line.split("  ")[::-1] for line in (written / "SHA256SUMS").read_text(encoding="ascii").splitlines())
    there = {path.relative_to(written).as_posix(): path for path in written.rglob("*") if path.is_file()}
    assert set(there) - set(listed) == {"SHA256SUMS"}
    assert listed == {name: hashlib.sha256(there[name].read_bytes()).hexdigest() for name in listed}
    assert "nothing is overwritten" in cmmlink("reference", written).refused()


def test_there_are_the_cases_of_the_page_and_a_row_of_the_sheet_for_every_number(written: Path) -> None:
    folders = sorted(path for path in written.iterdir() if path.is_dir())
    kinds = Counter(json.loads((path / "truth.json").read_text(encoding="ascii"))["kind"] for path in folders)
    assert len(folders) >= 40
    assert dict(re.findall(r"^\| ([a-z-]+) \| (\d+) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)) == {
        k: str(n) for k, n in kinds.items()
    }
    assert set(kinds) == set(get_args(CaseKind))
    rows = (written / "scoring.csv").read_text(encoding="ascii").splitlines()
    assert rows[0] == "case,quantity,unit,truth,their_value,difference"
    assert {row.split(",")[0] for row in rows[1:]} == {path.name for path in folders}
    assert rows[3].endswith(',,"=IF(E4="""","""",E4-D4)"')


def test_every_format_holds_the_same_numbers(written: Path) -> None:
    for folder in sorted(path for path in written.iterdir() if path.is_dir()):
        check_formats(folder, "inch" if "inch" in folder.name else "mm")


@pytest.mark.parametrize("name", ["inch-closed", "rational-curve"])
def test_drawings_are_read_as_the_curve_of_the_yaml_file(written: Path, name: str) -> None:
    curves = [load_nominal(written / name / f"nominal.{suffix}").curve for suffix in ("yaml", "dxf", "igs")]
    places = [curve.point(np.linspace(*curve.domain, 50)) for curve in curves]  # a drawing is given parameters of its own
    assert abs(places[1] - places[0]).max() < 1e-12
    assert abs(places[2] - places[0]).max() < 1e-12
    assert {(curve.degree, curve.closed) for curve in curves} == {(3, name == "inch-closed")}


def test_what_is_written_depends_on_no_decimal_context_of_the_caller() -> None:
    from decimal import ROUND_UP, localcontext

    first = next(iter(texts_of([next(reference_cases())])))
    with localcontext(prec=6, rounding=ROUND_UP):
        assert next(iter(texts_of([next(reference_cases())]))) == first


@pytest.mark.parametrize("name", ["inch-ball-centres", "corners", "edge-of-an-eighth", "best-fit-by-length", "outliers-open", "tiny"])
def test_deviations_are_distances_to_the_curve(written: Path, name: str) -> None:
    pytest.importorskip("mpmath", reason="mpmath is not installed: pip install 'cmmlink[test]' brings it")
    from tests.cmmlink.reference.exact_truth import Written, check_deviations, check_sums

    case = Written(written / name)
    check_deviations(case, [case.truth["worst"]["row"], len(case.points) - 1])
    check_sums(case)


def test_minimum_zones_and_consumptions_have_their_certificates(written: Path) -> None:
    pytest.importorskip("mpmath", reason="mpmath is not installed: pip install 'cmmlink[test]' brings it")
    from tests.cmmlink.reference.exact_truth import Written, check_consumption, check_zone

    check_zone(Written(written / "minimum-zone-beside-the-nominal"))
    check_consumption(Written(written / "consumption-open"))
