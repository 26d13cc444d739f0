"""The report of a stack: every section in the matrix, and a page for each that does not conform."""

import re
from pathlib import Path

import numpy as np
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
