"""The report: the numbers of the result, the same bytes each time, and pages for whatever a run can be."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imsave
from pypdf import PdfReader

from cmmlink.errors import PlanError
from cmmlink.events import Counts
from cmmlink.plan import Plan, ReportSettings
from cmmlink.report.further_pages import out_by
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.pdf import write_report
from cmmlink.report.picture_content import content_of
from cmmlink.report.report_input import ReportInput, regions_in, with_settings
from cmmlink.report.speech import Speech
from cmmlink.result_json import result_json
from inspection import InspectionResult, NominalProfile
from tests.cmmlink.judged_oval import bumped, inspect_oval
from tests.cmmlink.recorded import small_plan

KNOWN: dict[str, Any] = {
    "part": "Oval", "serial_number": "0017", "operator": "A. Müller", "device": "file oval.csv", "simulated": False, "ending": "complete",
    "notes": ["the unit mm was assumed"], "measured_at": "2026-03-14T15:09:26.535Z", "run": "20260314-150926-0001",
    "chain_sha256": "ab" * 32, "plan_sha256": "cd" * 32, "nominal_sha256": "ef" * 32, "software": {"cmmlink": "0.1.0"},
}  # fmt: skip


def report_of(result: InspectionResult | None, profile: NominalProfile, message: str = "", **known: Any) -> ReportInput:
    judged = result.judged if result is not None else 0
    received = result.received if result is not None else 7
    document = result_json(result, Counts(received=received, judged=judged, rejected=received - judged, lost=3)) | KNOWN | known
    content = None
    if result is not None and judged:
        content = content_of(scan_of(result), profile, "oval", regions=regions_in(document))
    return ReportInput(document, small_plan(), message, content)


def text_of(path: Path) -> str:
    """The text of all pages, without what breaks lines."""
    return re.sub(r"\s+", " ", " ".join(page.extract_text() for page in PdfReader(path).pages))


@pytest.fixture
def bad(profile: NominalProfile) -> ReportInput:
    return report_of(inspect_oval(profile, bumped()), profile)


def test_the_text_of_the_report_says_the_numbers_of_the_result(bad: ReportInput, tmp_path: Path) -> None:
    write_report(bad, tmp_path / "a.pdf")
    told, found = text_of(tmp_path / "a.pdf"), bad.document
    worst, gap, zone = found["worst"], found["largest_gap"], found["tolerance"]
    assert "NOT CONFORM" in told
    assert (
        f"{worst['deviation_mm']:+.4f} mm at station {worst['station_mm']:.2f} mm (x {worst['x_mm']:.3f}, y {worst['y_mm']:.3f} mm)" in told
    )
    assert f"{found['out_of_tolerance']} points out of tolerance, in {len(found['stretches'])} stretches" in told
    width = zone["upper_mm"] - zone["lower_mm"]
    one_value = (f"{found['zone_error_mm']:.4f}", f"{width:.4f}", f"{found['zone_error_mm'] - width:.4f}")
    largest = (f"{found['max_deviation_mm']:+.4f}", f"{zone['upper_mm']:+.4f}", f"{found['max_deviation_mm'] - zone['upper_mm']:.4f}")
    smallest = (f"{found['min_deviation_mm']:+.4f}", f"{zone['lower_mm']:+.4f}", f"{zone['lower_mm'] - found['min_deviation_mm']:.4f}")
    for numbers in (one_value, largest, smallest):
        assert " ".join(numbers) in told
    assert f"{found['profile_error_mm']:.4f} mm (2 x the largest |deviation|); rms {found['rms_mm']:.4f} mm" in told
    assert f"received {found['received']} = judged {found['judged']} + rejected {found['rejected']}; lost {found['lost']}" in told
    assert f"{found['coverage']:.1%} of the profile; largest gap {found['largest_gap_mm']:.3f} mm at station {gap['from_mm']:.2f}" in told
    assert zone["decision_rule"] in told
    assert found["reasons"][0]["words"] in told
    for stretch in found["stretches"]:
        assert f"{stretch['from_mm']:.2f} {stretch['to_mm']:.2f}" in told
        assert f"worst {stretch['worst_mm']:+.4f} mm" in told
    for key in ("part", "serial_number", "operator", "device", "run", "chain_sha256", "plan_sha256", "nominal_sha256"):
        assert found[key] in told
    assert "2026-03-14 15:09:26 UTC" in told


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        ({"sent": True, "verdict": "nonconform", "problem": None}, "NOT CONFORM for request 4711, sent 2026-03-14T15:09:27.000Z"),
        ({"sent": False, "verdict": None, "problem": "there is no folder"}, "not sent: there is no folder"),
    ],
)
def test_the_report_says_what_the_machine_was_told(answer: dict[str, Any], told: str, profile: NominalProfile, tmp_path: Path) -> None:
    known: dict[str, Any] = {"signature": None, "answer": {"request": 4711, "at": "2026-03-14T15:09:27.000Z", "unrecorded": None, **answer}}
    write_report(report_of(inspect_oval(profile, bumped()), profile, **known), tmp_path / "a.pdf")
    assert f"Answer to the machine {told}" in text_of(tmp_path / "a.pdf")


def test_every_characteristic_stands_in_the_table_with_what_it_is_out_by(bad: ReportInput, tmp_path: Path) -> None:
    base = bad.document["characteristics"][0]
    chord = {"type": "chord", "method": "caliper", "nominal": 20.0, "value": 20.031, "deviation": 0.031, "lower": None, "upper": 0.025}
    some = [base, base | {"name": "chord", **chord}, base | {"name": "no value", **chord, "value": None, "deviation": None}]
    many = [*some, *(base | {"name": f"c{number} <b>&amp;", "region": {"from_mm": 1.0, "to_mm": 9.0}} for number in range(37))]
    for found in (some, many):
        write_report(replace(bad, document={**bad.document, "characteristics": found}), tmp_path / "a.pdf")
        told = text_of(tmp_path / "a.pdf")
        assert all(one["name"] in told for one in found)
        assert "chord mm 20.0310 20.0000 +0.0310 \u2013 +0.025 0.0060" in told
        assert "no value mm \u2013 20.0000 \u2013 \u2013 +0.025" in told
    assert len(PdfReader(tmp_path / "a.pdf").pages) > 3
    assert told.count("Lower limit") >= 2  # the head of the table is repeated
    assert [out_by(one) for one in some[:2]] == pytest.approx([0.13, 0.006])
    assert out_by(some[2]) == 0.0


def test_the_same_run_gives_the_same_bytes_without_clock_or_path_and_with_its_fonts(bad: ReportInput, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_report(bad, tmp_path / name / f"{name}.pdf")
    written = (tmp_path / "a" / "a.pdf").read_bytes()
    assert written == (tmp_path / "b" / "b.pdf").read_bytes()
    reader = PdfReader(tmp_path / "a" / "a.pdf")
    assert reader.metadata is not None
    assert "2000" in str(reader.metadata.get("/CreationDate"))  # what reportlab writes in place of the clock
    streams = [stream for page in reader.pages if (stream := page.get_contents()) is not None]
    everything = written + b"".join(stream.get_data() for stream in streams)
    assert str(tmp_path).encode() not in everything
    assert isinstance(bad.plan, Plan)
    assert str(bad.plan.nominal.file.parent).encode() not in everything
    assert not re.search(rb"/BaseFont /(?!\w{6}\+DejaVuSans|Helvetica)", written)
    assert written.count(b"/FontFile2") >= 2  # the plain and the bold one


def test_german_has_a_word_for_everything_and_writes_numbers_with_a_comma(
    profile: NominalProfile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: set[str] = set()
    say = Speech.__call__

    def note(speech: Speech, text: str, /, **values: object) -> str:
        asked.add(text)
        return say(speech, text, **values)

    monkeypatch.setattr(Speech, "__call__", note)
    reports = [
        report_of(inspect_oval(profile, bumped()), profile),
        report_of(inspect_oval(profile, bumped()), profile, simulated=True, ending="aborted", replay_of="1", chain_sha256=""),
        report_of(None, profile, "the points do not look like the nominal"),
    ]
    for number, report in enumerate(reports):
        write_report(with_settings(report, {"language": "de", "paper": "letter"}), tmp_path / f"{number}.pdf")
    assert asked - set(Speech("de").texts()) == set()
    told = text_of(tmp_path / "0.pdf")
    worst = reports[0].document["worst"]
    assert f"{worst['deviation_mm']:+.4f} mm an Station {worst['station_mm']:.2f} mm".replace(".", ",") in told
    assert "NICHT KONFORM" in told
    assert "6 Punkte liegen um mehr als U = 0,01 mm außerhalb der Grenzen -0,05 .. 0,07 mm." in told
    assert "NICHT GEMESSEN" in text_of(tmp_path / "2.pdf")
    assert PdfReader(tmp_path / "0.pdf").pages[0].mediabox[2:] == [612, 792]


def test_every_text_of_the_catalogue_keeps_its_places_and_is_found_in_a_sentence() -> None:
    for text, said in Speech("de").texts().items():
        assert sorted(re.findall(r"\{\w+\}", text)) == sorted(re.findall(r"\{\w+\}", said)), text
    assert (
        Speech("de")
        .sentence("The largest gap is 1.25 mm, from station 3 to 4.5 mm; 1 mm are allowed.")
        .startswith("Die größte Lücke ist 1,25 mm")
    )
    assert Speech("de").sentence("who knows") == Speech("en").sentence("who knows") == "who knows"
    told = Speech("de").sentence("upper side: 6 points lie nearer to a limit than U = 0.004 mm: neither side is proven.")
    assert told == "upper side: 6 Punkte liegen näher an einer Grenze als U = 0,004 mm: Keine Seite ist nachgewiesen."
    assert Speech("en").number(-1e-9, "+.4f") == "+0.0000"


@pytest.mark.parametrize("ending", ["aborted", "interrupted"])
def test_an_early_end_stands_on_every_page_in_place_of_a_verdict(profile: NominalProfile, tmp_path: Path, ending: str) -> None:
    write_report(report_of(inspect_oval(profile, bumped()), profile, "the cable was pulled", ending=ending), tmp_path / "a.pdf")
    for page in PdfReader(tmp_path / "a.pdf").pages:
        assert f"{ending.upper()} AT 99 %" in page.extract_text() or f"{ending.upper()} AT 100 %" in page.extract_text()
        assert "NOT CONFORM" not in page.extract_text().split("Characteristics")[0]
    assert "the cable was pulled" in text_of(tmp_path / "a.pdf")


def test_a_run_without_a_result_says_why_and_shows_no_numbers(profile: NominalProfile, tmp_path: Path) -> None:
    write_report(report_of(None, profile, "the points do not look like the nominal: <b>"), tmp_path / "a.pdf")
    told = text_of(tmp_path / "a.pdf")
    assert "NOT MEASURED the points do not look like the nominal: <b>" in told
    assert "Reporting rule" not in told
    assert "received 7 = judged 0 + rejected 7" in told


def test_names_may_hold_any_signs_and_be_of_any_length(bad: ReportInput, tmp_path: Path) -> None:
    name = "<b>&amp; $x_1$ \u202e\u6f22\u5b57 \0\n " + "long " * 900
    known = {"part": name, "serial_number": "9" * 3000, "operator": name, "device": name, "notes": [name] * 30}
    reasons = [{"kind": "gap", "words": name}] * 9
    settings = {"company": "Müller & Söhne <Präzision> " + "x" * 200}
    write_report(with_settings(replace(bad, document={**bad.document, **known, "reasons": reasons}), settings), tmp_path / "a.pdf")
    assert "<b>&amp; $x_1$" in text_of(tmp_path / "a.pdf")


def test_the_logo_stands_in_place_of_the_name_and_one_that_is_no_picture_is_refused(bad: ReportInput, tmp_path: Path) -> None:
    imsave(tmp_path / "logo.png", np.full((100, 300, 3), 0.4))
    (tmp_path / "text.png").write_text("no picture", encoding="utf-8")
    write_report(with_settings(bad, {"company": "ACME", "logo": tmp_path / "logo.png"}), tmp_path / "a.pdf")
    (picture,) = PdfReader(tmp_path / "a.pdf").pages[0].images
    assert picture.image is not None
    assert picture.image.size == (300, 100)
    assert "ACME" not in text_of(tmp_path / "a.pdf")
    write_report(with_settings(bad, {"company": "ACME", "logo": tmp_path / "gone.png"}), tmp_path / "a.pdf")
    assert "ACME" in text_of(tmp_path / "a.pdf")
    with pytest.raises(PlanError, match=r"text\.png: the logo of the report cannot be read; expected a PNG or JPEG"):
        write_report(with_settings(bad, {"logo": tmp_path / "text.png"}), tmp_path / "a.pdf")


def test_a_plan_says_where_its_logo_lies() -> None:
    assert ReportSettings(logo=Path("logo.png")).with_path_from(Path("/plans")).logo == Path("/plans/logo.png")
    assert ReportSettings().with_path_from(Path("/plans")) == ReportSettings()
