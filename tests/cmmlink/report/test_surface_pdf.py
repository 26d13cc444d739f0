"""The report and the picture of a whole surface: a block with a defect and an unseen side, in both languages."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader

from cmmlink.events import Counts
from cmmlink.plan import SurfacePlan, plan_given_by
from cmmlink.report.report_input import ReportInput, with_settings
from cmmlink.report.speech import Speech
from cmmlink.report.surface_folder import write_surface
from cmmlink.report.surface_pdf import write_surface_report
from cmmlink.surface_json import NominalWords, surface_json
from inspection import ToleranceZone
from inspection.surface import SurfaceTerms, TriangleSurface, judge_surface
from tests.drivers.surface.meshes import box

ZONE = ToleranceZone(-0.05, 0.05, 0.005)
WORDS = NominalWords("triangles", "stl", None, 12, 0.0, 2232.0)


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """The nominal is drawn from few places: what is told beside the picture is tested here."""
    monkeypatch.setattr("cmmlink.report.surface_report.PLACES", 10_000)


@pytest.fixture(scope="module")
def block() -> TriangleSurface:
    return TriangleSurface(box((0.0, 0.0, 0.0), (30.0, 18.0, 12.0)))


def report_of(block: TriangleSurface, folder: Path, language: str = "en") -> list[str]:
    """Write the results of a scan of the block with a defect around (22, 7, 12) and nothing of its lower face."""
    places, normals = block.sample(4000)
    far = np.hypot(*(places - (22.0, 7.0, 12.0)).T[:2]) + 1e3 * (places[:, 2] < 11.9)
    points = places + normals * np.where(far < 2, 0.2 * (1 - far / 4), 0.0)[:, None]
    result = judge_surface(points[places[:, 2] > 0.01], block, SurfaceTerms(ZONE, fit="none", gap_max_mm=3.0, coverage_min=0.95))
    counts = Counts(received=result.received, judged=result.judged)
    document = {**surface_json(result, counts, WORDS), "part": "Block 4", "ending": "complete", "notes": list(result.notes)}
    settings = {"part": {"name": "Block 4"}, "surface": {"file": "block.stl"}, "tolerance": {"lower_mm": -0.05, "upper_mm": 0.05}}
    plan = plan_given_by(SurfacePlan, settings | {"device": {"type": "file", "file": "scan.csv"}}, {})
    return write_surface(folder, with_settings(ReportInput(document, plan), {"language": language}), result, block)


def text_of(path: Path) -> str:
    return " ".join(" ".join(page.extract_text() for page in PdfReader(path).pages).split())


def test_the_folder_holds_picture_and_report_which_names_every_region(block: TriangleSurface, tmp_path: Path) -> None:
    written = report_of(block, tmp_path)
    assert {"surface.png", "report.pdf", "deviations.ply", "result.json"} <= set(written)
    told = text_of(tmp_path / "report.pdf")
    for words in (
        "NOT CONFORM",
        "Block 4",
        "block.stl",
        "Weakest direction",
        "the pose was known",
        "Regions out of tolerance, the worst first",
        "Not measured, the largest first",
        "of 2232 mm²; widest place without points",
    ):
        assert words in told
    assert "of the surface was measured; 95.0% are needed." in told


def test_german_has_a_word_for_everything(block: TriangleSurface, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: set[str] = set()
    say = Speech.__call__

    def note(speech: Speech, text: str, /, **values: object) -> str:
        asked.add(text)
        return say(speech, text, **values)

    monkeypatch.setattr(Speech, "__call__", note)
    report_of(block, tmp_path, "de")
    assert asked - set(Speech("de").texts()) == set()
    told = text_of(tmp_path / "report.pdf")
    for words in ("NICHT KONFORM", "Bereiche außerhalb der Toleranz, der größte zuerst", "der Fläche wurden gemessen; 95,0% sind nötig."):
        assert words in told


def test_a_run_without_a_result_has_a_report_that_says_why(tmp_path: Path) -> None:
    document = {**surface_json(None, Counts(received=3, rejected=3), WORDS), "part": "Block 4", "ending": "complete", "notes": []}
    settings = {"part": {"name": "Block 4"}, "surface": {"file": "block.stl"}, "tolerance": {"lower_mm": -0.05, "upper_mm": 0.05}}
    plan = plan_given_by(SurfacePlan, settings | {"device": {"type": "file", "file": "scan.csv"}}, {})
    write_surface_report(replace(ReportInput(document, plan), message="the points do not look like the nominal"), None, tmp_path / "a.pdf")
    told = text_of(tmp_path / "a.pdf")
    assert "NOT MEASURED" in told
    assert "the points do not look like the nominal" in told
