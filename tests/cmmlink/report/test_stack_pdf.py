"""The report of a stack: every section in the matrix, and a page for each that does not conform."""

import re
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader

from tests.cmmlink.command import cmmlink
from tests.drivers.surface.ct_phantom import GOE404, airfoil, write_spline
from tests.drivers.surface.meshes import binary_stl, tube, write


def test_the_report_has_the_numbers_of_every_section_and_a_page_for_those_that_do_not_conform(tmp_path: Path) -> None:
    spline = airfoil(GOE404, 60.0)
    profile = spline(np.linspace(0, 1, 600))
    bent = profile.copy()
    bent[200:210] *= 1.02
    mesh = write(tmp_path / "blade.stl", binary_stl(tube(bent, np.array([0.0, 20.0]))))
    nominal = write_spline(spline, tmp_path / "blade.yaml")
    options = ("--nominal", nominal, "--tolerance", -0.05, 0.05, "--heights", 5, 10, "--cutter", "numpy", "--records", tmp_path)
    found = cmmlink("ct", mesh, *options, "--out", tmp_path / "out", "--json").json()
    reader = PdfReader(tmp_path / "out" / "report.pdf")
    told = re.sub(r"\s+", " ", reader.pages[0].extract_text())
    assert found["verdict"] == "nonconform"
    assert "NOT CONFORM" in told
    assert "2 of 2 sections do not conform or are not proven." in told
    for section in found["slices"]:
        worst = section["worst"]
        assert f"{section['height_mm']:.3f} {worst['deviation_mm']:+.4f} {worst['station_mm']:.2f} {section['zone_error_mm']:.4f}" in told
        assert any(f"at height {section['height_mm']:.3f} mm" in page.extract_text() for page in reader.pages[1:])
    assert str(tmp_path).encode() not in (tmp_path / "out" / "report.pdf").read_bytes()
    check_report_from_the_records(tmp_path, found["slices"][0]["run"], reader)


def check_report_from_the_records(folder: Path, run: str, written: PdfReader) -> None:
    """From the records of its sections a stack has the report that was written at once, but for when it began and what an import says."""
    said = cmmlink("report", run, "--stack", "--records", folder, "-o", folder / "a.pdf", "--json").json()
    again = PdfReader(said["file"])
    assert len(again.pages) == len(written.pages)
    for page, other in zip(again.pages, written.pages, strict=True):
        assert without_times(page.extract_text()) == without_times(other.extract_text())
    named = cmmlink("report", said["run"], "--records", folder, "-o", folder / "b.pdf", "--json").json()
    assert named["run"] == said["run"]
    assert (folder / "b.pdf").read_bytes() == (folder / "a.pdf").read_bytes()
    alone = PdfReader(cmmlink("report", run, "--records", folder, "-o", folder / "c.pdf", "--json").json()["file"])
    assert "sections do not conform" not in alone.pages[0].extract_text()


def without_times(text: str) -> str:
    return re.sub(r"\d\d:\d\d:\d\d", "", text)


def test_characteristics_of_a_stack_come_out_of_the_records_and_every_section_has_a_page_on_request(tmp_path: Path) -> None:
    spline = airfoil(GOE404, 60.0)
    outline, turn = spline(np.linspace(0, 1, 600)), np.radians(0.3)
    turned = outline @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    surface = np.concatenate([tube(outline, np.array([0.0, 10.0])), tube(turned, np.array([10.0, 20.0]))])
    mesh = write(tmp_path / "blade.stl", binary_stl(surface))
    write_spline(spline, tmp_path / "blade.yaml")
    plan = tmp_path / "plan.yaml"
    plan.write_text(
        f"part: {{name: blade}}\nmesh: {{file: {mesh.name}}}\nnominal: {{file: blade.yaml}}\n"
        "tolerance: {lower_mm: -0.05, upper_mm: 0.05}\nsections: {heights_mm: [5, 15]}\ncut: {cutter: numpy}\n"
        "stack_characteristics: [{name: twist, type: relative-twist, lower_deg: -0.5, upper_deg: 0.5}]\n",
        encoding="utf-8",
    )
    found = cmmlink("ct", plan, "--no-pictures", "--records", tmp_path, "--json").json()
    assert found["verdict"] == "conform"
    assert cmmlink("report", "last", "--stack", "--sections", "all", "--records", tmp_path, "-o", tmp_path / "a.pdf").code == 0
    pages = [re.sub(r"\s+", " ", page.extract_text()) for page in PdfReader(tmp_path / "a.pdf").pages]
    (twist,) = found["characteristics"]
    assert abs(twist["value"]) == pytest.approx(0.3, abs=1e-3)
    assert f"twist deg {twist['value']:.4f} 0.0000 {twist['deviation']:+.4f} -0.5 +0.5" in pages[0]
    assert "judged again from the points on record" in " ".join(pages)
    assert "not what is on record" not in " ".join(pages)
    for height in (5, 15):
        assert any(f"at height {height:.3f} mm" in page for page in pages[1:])
    said = cmmlink("report", "nobody", "--stack", "--records", tmp_path).refused()
    assert "there is no run 'nobody'" in said
