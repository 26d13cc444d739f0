"""Draws figures of matplotlib into a PDF as vectors: lines, marks and text stay sharp, and text can be searched and copied."""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.figure import Figure
from matplotlib.path import Path
from numpy.typing import NDArray
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from cmmlink.report.pdf_fonts import BOLD, PLAIN

Array = NDArray[np.float64]

_CAPS = {"butt": 0, "round": 1, "projecting": 2}
_JOINS = {"miter": 0, "round": 1, "bevel": 2}
_OPERATORS = {Path.MOVETO: "m", Path.LINETO: "l", Path.CURVE4: "c"}
_MANY = 128  # corners, from which on those that lie on a line with their neighbours, to a ninth of a point, are left out
_BEYOND_FRAME = 4.0  # points, by which lines are drawn beyond what is seen of them
_FEW_CORNERS = 8  # of a mark: more do not show


class DrawnFigure(Flowable):
    """A figure of matplotlib with 72 dots an inch as a part of a page."""

    def __init__(self, figure: Figure) -> None:
        super().__init__()
        self._figure = figure
        self.width, self.height = (float(size) for size in figure.bbox.size)

    def draw(self) -> None:
        """Draw it at the origin of the page's canvas."""
        self._figure.draw(_Renderer(self.canv, self.width, self.height))


class _Renderer(RendererBase):
    """Writes what matplotlib draws as operators of a page."""

    def __init__(self, canvas: Canvas, width: float, height: float) -> None:
        super().__init__()
        self._canvas, self._size = canvas, (width, height)

    def get_canvas_width_height(self) -> tuple[float, float]:
        return self._size

    def flipy(self) -> bool:
        return False  # the origin of a page is at its lower left

    def new_gc(self) -> GraphicsContextBase:
        return GraphicsContextBase()

    def draw_path(self, gc: Any, path: Path, transform: Any, rgbFace: Any = None) -> None:
        straight = path.codes is None or np.isin(path.codes, [Path.MOVETO, Path.LINETO, Path.CLOSEPOLY]).all()
        many = bool(straight) and len(np.asarray(path.vertices)) > _MANY
        frame = gc.get_clip_rectangle()
        clip = frame.padded(_BEYOND_FRAME).extents if frame is not None and rgbFace is None else None
        self._paint(gc, rgbFace, operators_of(path.cleaned(transform, remove_nans=True, clip=clip, simplify=many, curves=True)))

    def draw_markers(self, gc: Any, marker_path: Path, marker_trans: Any, path: Path, trans: Any, rgbFace: Any = None) -> None:
        outlines = marker_path.to_polygons(marker_trans.frozen(), closed_only=rgbFace is not None)
        places = trans.transform(path.vertices)
        places = places[np.isfinite(places).all(axis=1)]
        marks = [_marks(places, thinned(np.asarray(outline)), closed=rgbFace is not None) for outline in outlines]
        self._paint(gc, rgbFace, "\n".join(marks))

    def draw_text(self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float, ismath: Any = False, mtext: Any = None) -> None:
        canvas = self._canvas
        canvas.saveState()
        canvas.setFillColorRGB(*gc.get_rgb()[:3])
        canvas.translate(x, y)
        canvas.rotate(angle)
        canvas.setFont(BOLD if prop.get_weight() in ("bold", 700) else PLAIN, prop.get_size_in_points())
        canvas.drawString(0, 0, s)
        canvas.restoreState()

    def draw_quad_mesh(self, gc: Any, master_transform: Any, meshWidth: int, meshHeight: int, coordinates: Any, *more: Any) -> None:
        colours: Array = np.asarray(more[2], dtype=np.float64).round(3).reshape(meshHeight, meshWidth, 4)
        corners = master_transform.transform(np.asarray(coordinates).reshape(-1, 2)).reshape(meshHeight + 1, meshWidth + 1, 2)
        clip = gc.get_clip_rectangle()
        frame = [] if clip is None else ["{:.3f} {:.3f} {:.3f} {:.3f} re W n".format(*clip.bounds)]
        self._canvas.addLiteral("\n".join(["q", *frame, *_fields(corners, colours), "Q"]))

    def _paint(self, gc: Any, face: Any, operators: str) -> None:
        """Fill and stroke a path, as far as its colours are not transparent."""
        filled = face is not None and (len(face) < 4 or face[3] > 0)
        stroked = gc.get_linewidth() > 0 and gc.get_rgb()[3] > 0
        if not operators or not (filled or stroked):
            return
        how = "B" if filled and stroked else "f" if filled else "S"
        self._canvas.addLiteral("\n".join(["q", *_state(gc, face if filled else None), operators, how, "Q"]))


def _fields(corners: Array, colours: Array) -> Iterator[str]:
    """The fields of a grid along the axes, corners (h + 1, w + 1, 2) and colours (h, w, 4): those alike in a row as one rectangle."""
    for row, line in enumerate(colours):
        starts = [0, *(np.flatnonzero((line[1:] != line[:-1]).any(axis=1)) + 1).tolist(), len(line)]
        for start, end in pairwise(starts):
            (x, y), (right, top) = corners[row, start], corners[row + 1, end]
            if line[start, 3] > 0:
                red, green, blue = line[start, :3]
                yield f"{red:.3f} {green:.3f} {blue:.3f} rg {x:.2f} {y:.2f} {right - x:.2f} {top - y:.2f} re f"


def _state(gc: Any, face: Any) -> Iterator[str]:
    """Clip, colours, and the kind of line."""
    clip = gc.get_clip_rectangle()
    if clip is not None:
        yield "{:.3f} {:.3f} {:.3f} {:.3f} re W n".format(*clip.bounds)
    if face is not None:
        yield "{:.4f} {:.4f} {:.4f} rg".format(*face[:3])
    yield "{:.4f} {:.4f} {:.4f} RG".format(*gc.get_rgb()[:3])
    yield f"{gc.get_linewidth():.3f} w {_CAPS[str(gc.get_capstyle())]} J {_JOINS[str(gc.get_joinstyle())]} j"
    offset, dashes = gc.get_dashes()
    if dashes is not None:
        yield f"[{' '.join(f'{length:.3f}' for length in dashes)}] {offset:.3f} d"


def operators_of(path: Path) -> str:
    """The operators of a path whose curves are cubic, in hundredths of a point."""
    codes, corners = np.asarray(path.codes), np.asarray(path.vertices, dtype=np.float64)
    if not len(corners):
        return ""
    if not np.isin(codes, [Path.MOVETO, Path.LINETO, Path.STOP]).all():
        return "\n".join(_pieces(path))
    drawn = codes != Path.STOP
    letters = np.where(codes[drawn] == Path.MOVETO, "m", "l").tolist()
    return "".join(f"{x:.2f} {y:.2f} {letter}\n" for (x, y), letter in zip(corners[drawn].tolist(), letters, strict=True))


def _pieces(path: Path) -> Iterator[str]:
    last = np.zeros(2)
    for ends, code in path.iter_segments(curves=True, simplify=False):
        if code == Path.CLOSEPOLY:
            yield "h"
        elif code == Path.CURVE3:  # a parabola as a cubic
            control, end = ends[:2], ends[2:]
            yield _numbers([*(last + 2 * control) / 3, *(end + 2 * control) / 3, *end]) + " c"
        elif code != Path.STOP:
            yield f"{_numbers(ends)} {_OPERATORS[code]}"
        last = ends[-2:]


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.2f}" for value in values)


def _marks(places: Array, outline: Array, closed: bool) -> str:
    """A copy of an outline (k, 2) at each place (m, 2)."""
    if not len(outline) or not len(places):
        return ""
    if closed:
        outline = outline[:-1]  # which repeats its first corner
    one = "%.2f %.2f m " + "%.2f %.2f l " * (len(outline) - 1) + ("h\n" if closed else "\n")
    corners = places[:, None, :] + outline[None, :, :]
    return (one * len(places)) % tuple(corners.reshape(-1).tolist())


def thinned(outline: Array) -> Array:
    """A closed outline (k, 2) with few corners; its last one stays its first."""
    if len(outline) <= _FEW_CORNERS + 1:
        return outline
    few: Array = outline[np.linspace(0, len(outline) - 1, _FEW_CORNERS + 1).astype(int)]
    return few
