"""The picture of a nominal in a terminal, held against the circle and the line that it shows."""

import numpy as np
import pytest

from cmmlink.nominal_files import NominalFile
from cmmlink.report.nominal_text import text_picture
from inspection import NurbsCurve

# where the eight dots of a Braille character are, as Unicode numbers them: bit, column, row from above
DOTS = [(0, 0, 0), (1, 0, 1), (2, 0, 2), (3, 1, 0), (4, 1, 1), (5, 1, 2), (6, 0, 3), (7, 1, 3)]


def dots(text: str) -> set[tuple[int, int]]:
    """Column and row, from the top left, of every dot."""
    found = set()
    for row, line in enumerate(text.splitlines()):
        for column, sign in enumerate(line):
            code = ord(sign) - 0x2800
            if 0 <= code < 256:
                found |= {(2 * column + x, 4 * row + y) for bit, x, y in DOTS if code >> bit & 1}
    return found


def circle(radius: float) -> NurbsCurve:
    turn = np.linspace(0.0, 2 * np.pi, 400)
    points = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    points[-1] = points[0]
    return NurbsCurve.interpolate(points, closed=True)


@pytest.mark.parametrize("radius", [0.01, 7.0, 3e4])
def test_a_circle_is_round_in_dots_whatever_its_size(radius: float) -> None:
    text = text_picture(NominalFile(circle(radius), "a circle", ()), 60, 30)
    lines = text.splitlines()
    assert max(map(len, lines)) <= 60
    assert len(lines) <= 30
    found = np.array(sorted(dots(text)), dtype=float)
    middle = (found.max(axis=0) + found.min(axis=0)) / 2
    away = np.hypot(*(found - middle).T)
    assert len(found) > 150
    assert away.max() - away.min() < 2.5, "dots, of a circle of some 60 dots radius"


def test_the_start_and_the_direction_are_shown() -> None:
    lines = text_picture(NominalFile(circle(7.0), "a circle", ()), 60, 30).splitlines()
    assert "S" in lines[len(lines) // 2][-2:] or "S" in lines[(len(lines) - 1) // 2][-2:], "a circle begins at its right"
    upper, lower = "".join(lines[: len(lines) // 4]), "".join(lines[-len(lines) // 4 :])
    assert "<" in upper
    assert ">" in lower, "counterclockwise"
    assert ">" not in upper
    assert "<" not in lower


def test_a_level_line_is_one_row() -> None:
    line = NurbsCurve(1, np.array([[0.0, 0.0], [50.0, 0.0]]), np.array([0.0, 0.0, 1.0, 1.0]))
    assert len(text_picture(NominalFile(line, "a line", ()), 40, 10).splitlines()) == 1
