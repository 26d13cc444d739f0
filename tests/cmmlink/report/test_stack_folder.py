"""The table of contours beside a section."""

import csv
from pathlib import Path

import numpy as np

from cmmlink.report.stack_folder import CONTOUR_COLUMNS, write_contours
from drivers.surface import Contour


def test_contours_are_byte_for_byte_what_plain_formats_write(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    kinds = [(3000, True, False), (5, True, True), (2, False, False)]
    contours = [Contour(rng.normal(0, 80, (m, 3)), rng.normal(0, 80, (m, 2)), closed, hole, 1.0) for m, closed, hole in kinds]
    write_contours(contours, tmp_path / "contours.csv")
    with (tmp_path / "plain.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(CONTOUR_COLUMNS)
        for number, contour in enumerate(contours, start=1):
            head = (number, "closed" if contour.closed else "open", "hole" if contour.hole else "outer")
            for row in np.column_stack([contour.points_mm, contour.section_mm]).tolist():
                writer.writerow([*head, *(f"{value:.6f}" for value in row)])
    assert (tmp_path / "contours.csv").read_bytes() == (tmp_path / "plain.csv").read_bytes()
