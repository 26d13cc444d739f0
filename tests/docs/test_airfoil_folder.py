"""The benchmark over a folder of airfoils, on a shipped file and on one that is written here, each in a dialect of UIUC."""

import shutil
from pathlib import Path

import numpy as np

from tests.benchmarks.airfoil_folder import hold, table
from tests.inspection import profiles

SHIPPED = Path(__file__).resolve().parents[1] / "data" / "airfoils" / "goe404.dat"


def test_two_curves_agree_with_the_verifier_and_an_odd_file_is_named(tmp_path: Path) -> None:
    shutil.copy(SHIPPED, tmp_path)
    rows = profiles.naca_points("2412", 1.0, sharp=False)
    half = len(rows) // 2
    both = ["\n".join(f"{x:.7f} {y:.7f}" for x, y in side) for side in (rows[half::-1], rows[half:])]
    (tmp_path / "lednicer.dat").write_text(f"NACA 2412\n {half + 1}. {len(rows) - half}.\n\n{both[0]}\n\n{both[1]}\n")
    (tmp_path / "odd.dat").write_text("no airfoil\n1 2 3\nfour\n")
    held = [hold(path, proof=False) for path in sorted(tmp_path.glob("*.dat"))]
    assert [(row.name, row.kind) for row in held] == [
        ("goe404.dat", "uiuc-selig, closed"),
        ("lednicer.dat", "uiuc-lednicer, closed"),
        ("odd.dat", ""),
    ]
    assert np.array([[row.deviation_mm, row.zone_mm] for row in held[:2]]).max() < 1e-9
    assert max(row.pose_mm for row in held[:2]) < 1e-8
    assert "line 2" in held[2].refused
    assert table(held).splitlines()[-1].startswith("2 held, 1 refused; largest differences ")
