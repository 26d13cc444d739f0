"""Points as coordinate measuring machines and scanning programs export them, by example: the layouts are written here by hand."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivers.files.point_file import read_points

TURN = np.arange(40) * 2 * np.pi / 40
POINTS = np.round(np.column_stack([30 + 10 * np.cos(TURN), 40 + 8 * np.sin(TURN), np.full(40, 12.5)]), 4)
NORMALS = np.column_stack([np.cos(TURN), np.sin(TURN), np.zeros(40)])


def comma(text: str) -> str:
    return text.replace(".", ",")


Row = Callable[[int, float, float, float, str], str]
EXPORTS: dict[str, tuple[str, Row, str]] = {
    "PC-DMIS, vectors": ("XYZIJK METRIC\n", lambda i, x, y, z, n: f"{x:.5f},{y:.5f},{z:.5f},{n}\n", "columns left out: i, j, k"),
    "PC-DMIS, vectors in inch": (
        "XYZIJK\n",
        lambda i, x, y, z, n: f"{x / 25.4:.9f},{y / 25.4:.9f},{z / 25.4:.9f},{n}\n",
        "line 1 states XYZIJK without METRIC, which means inch: read in inch",
    ),
    "PC-DMIS, table of a scan": (
        "SCN1\nID\tX\tY\tZ\n",
        lambda i, x, y, z, n: f"SCN1.PT{i}\t{x:.4f}\t{y:.4f}\t{z:.4f}\n",
        "columns left out: ID",
    ),
    "CALYPSO, numbered": ("Nr\tX\tY\tZ\n", lambda i, x, y, z, n: comma(f"{i}\t{x:.4f}\t{y:.4f}\t{z:.4f}\n"), "columns left out: Nr"),
    "CALYPSO, curve": (
        "# Einheit: mm\n",
        lambda i, x, y, z, n: f"{x:12.5f} {y:12.5f} {z:12.5f} {n.replace(',', ' ')}\n",
        "the first three of 6 columns taken as x, y, z",
    ),
    "GOM": (
        "Name;X [mm];Y [mm];Z [mm];Deviation [mm]\n",
        lambda i, x, y, z, n: comma(f"Point {i};{x:.4f};{y:.4f};{z:.4f};0.0012\n"),
        "columns left out: Name, Deviation [mm]",
    ),
    "Zeiss": (
        '"Point ID","Actual X","Actual Y","Actual Z"\n',
        lambda i, x, y, z, n: f'"P{i}",{x:.4f},{y:.4f},{z:.4f}\n',
        "columns left out: Point ID",
    ),
    "actual beside nominal, in German": (
        "Element;Ist X;Ist Y;Ist Z;Soll X;Soll Y;Soll Z\n",
        lambda i, x, y, z, n: comma(f"P{i};{x:.4f};{y:.4f};{z:.4f};{x + 1:.4f};{y:.4f};{z:.4f}\n"),
        "columns left out: Element, Soll X, Soll Y, Soll Z",
    ),
    "nominal before actual, in inch": (
        "ID,X Nominal,Y Nominal,Z Nominal,X Actual [inch],Y Actual [inch],Z Actual [inch]\n",
        lambda i, x, y, z, n: f"P{i},{x:.4f},{y:.4f},{z:.4f},{x / 25.4:.9f},{y / 25.4:.9f},{z / 25.4:.9f}\n",
        "the header gives X in inch: read in inch",
    ),
    "x_meas beside x_nom": (
        "id,x_meas,y_meas,z_meas,x_nom,y_nom,z_nom\n",
        lambda i, x, y, z, n: f"{i},{x:.4f},{y:.4f},{z:.4f},{x + 1:.4f},{y:.4f},{z:.4f}\n",
        "columns left out: id, x_nom, y_nom, z_nom",
    ),
    "CloudCompare": (
        "//X Y Z R G B Nx Ny Nz\n",
        lambda i, x, y, z, n: f"{x:.8f} {y:.8f} {z:.8f} 255 0 0 {n.replace(',', ' ')}\n",
        "columns left out: R, G, B, Nx, Ny, Nz",
    ),
    "CloudCompare, counted": (
        "//X,Y,Z,Scalar field\n40\n",
        lambda i, x, y, z, n: f"{x:.8f},{y:.8f},{z:.8f},0.125\n",
        "line 2 counts the points",
    ),
}


@pytest.mark.parametrize("program", EXPORTS)
def test_an_export_is_read_as_its_program_means_it(tmp_path: Path, program: str) -> None:
    head, row, note = EXPORTS[program]
    rows = []
    for i in range(len(POINTS)):
        x, y, z = POINTS[i].tolist()
        rows.append(row(i + 1, x, y, z, ",".join(f"{value:.6f}" for value in NORMALS[i])))
    (tmp_path / "points.txt").write_text(head + "".join(rows), encoding="utf-8")
    found = read_points(tmp_path / "points.txt")
    np.testing.assert_allclose(found.points_mm, POINTS, atol=1e-6)
    assert note in found.notes
