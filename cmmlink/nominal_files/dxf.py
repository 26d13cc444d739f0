"""DXF, from R12 to R2018, as text or binary, read by ezdxf and converted here: its own paths are polygons.

Arcs, circles and polylines live in the coordinate system of their extrusion; blocks are placed as their INSERT says. What is no curve
is left out and counted. ezdxf is loaded when a drawing is read, and nowhere else.
"""

import logging
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files.chains import counted_names
from cmmlink.nominal_files.drawing import Drawing
from cmmlink.nominal_files.pieces import Piece, conic_arc, polyline, spline, through_vertices, wrap
from drivers import read_bytes, shorten
from inspection import NominalError, SectionPlane

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

SUFFIXES = (".dxf",)

Array = NDArray[np.float64]

# The units of $INSUNITS that parts are drawn in; ezdxf has 25.400000000101603 mm for an inch.
_UNITS: Final = {
    1: ("inch", 25.4),
    2: ("foot", 304.8),
    4: ("mm", 1.0),
    5: ("cm", 10.0),
    6: ("m", 1000.0),
    8: ("microinch", 25.4e-6),
    9: ("mil", 0.0254),
    13: ("um", 1e-3),
    14: ("dm", 100.0),
}
_DEEPEST = 12  # blocks in blocks
_MOST = 200_000  # entities, those of blocks as often as they are placed
_MAGIC = 6  # bytes that tell a DWG file, like AC1032
_TAIL = 200  # bytes in which the end mark stands
_FRAME = 16  # flag of a vertex that is not on the curve but holds it
_RELEASES: Final = {
    "AC1009": "r12",
    "AC1012": "r13",
    "AC1014": "r14",
    "AC1015": "r2000",
    "AC1018": "r2004",
    "AC1021": "r2007",
    "AC1024": "r2010",
    "AC1027": "r2013",
    "AC1032": "r2018",
}


def draw(path: Path, section: SectionPlane | None) -> Drawing:
    """The curves of the model space. A drawing does not depend on the plane that is asked for."""
    del section
    document, notes = _document(path)
    pieces: list[Piece] = []
    left_out: list[str] = []
    try:
        for entity, layer in _entities(document.modelspace(), None, 0):
            _take(entity, layer, pieces, left_out, document)
            if len(pieces) + len(left_out) > _MOST:
                raise NominalError(f"holds more than {_MOST} entities; expected a drawing of a profile: export it alone")
    except NominalError:
        raise
    except Exception as error:  # ezdxf raises what Python does where a value is not what it expects: one sentence comes of it
        raise NominalError(f"is damaged: {_told(error)}; export it again") from None
    if left_out:
        notes.append(f"left out: {counted_names(left_out)}")
    mm_per_unit, unit = _unit(document, path)
    release = _RELEASES.get(document.dxfversion, document.dxfversion.lower())
    return Drawing(tuple(pieces), f"dxf-{release}", mm_per_unit, unit, notes=tuple(notes))


def _document(path: Path) -> "tuple[Document, list[str]]":
    """The drawing as ezdxf reads it, and what it had to mend."""
    content = read_bytes(path)
    if content[:2] == b"AC" and content[2:_MAGIC].isdigit():
        raise NominalError("is a DWG file, not DXF; export the drawing as DXF")
    if (
        b"SECTION" in content and b"EOF" not in content[-_TAIL:]
    ):  # ezdxf would read what is left of it, and curves would be missing silently
        raise NominalError("has no end (EOF); expected a whole DXF drawing: it is cut off")
    from ezdxf import recover  # noqa: PLC0415 - half a second, for drawings only
    from ezdxf.filemanagement import readfile  # noqa: PLC0415

    logger = logging.getLogger("ezdxf")  # what it says goes to our log, and never to the screen
    logger.addHandler(logging.NullHandler())
    try:
        return readfile(path), []
    except Exception as error:  # its own errors, and whatever Python raises on damaged values; then it is asked to recover the file
        logger.debug("not read at once: %s", error)
    try:
        document, auditor = recover.readfile(path)
    except Exception as error:  # as above
        raise NominalError(f"is no DXF drawing that can be read: {_told(error)}; export it again") from None
    lost = [problem.message for problem in (*auditor.errors, *auditor.fixes)]
    told = f" ({shorten(lost[0])}{f', and {len(lost) - 1} more' if len(lost) > 1 else ''})" if lost else ""
    return document, [f"the file is damaged and was mended by ezdxf{told}"]


def _told(error: Exception) -> str:
    return shorten(" ".join(str(error).split()) or type(error).__name__)


def _unit(document: "Document", path: Path) -> tuple[float | None, str]:
    """How many mm a unit is, None where the file does not say it, and its words. ezdxf puts metres into a header that is not there."""
    code = document.header.get("$INSUNITS", 0) if b"$INSUNITS" in read_bytes(path) else 0
    if code in _UNITS:
        name, mm = _UNITS[code]
        return mm, f"{name} ($INSUNITS {code})"
    if document.dxfversion == "AC1009" and not code:
        return None, "a drawing of release 12 that states no unit"
    return None, f"states no unit ($INSUNITS {code})" if not code else f"states a unit that parts are not drawn in ($INSUNITS {code})"


def _entities(container: Any, layer_of_block: str | None, depth: int) -> Iterator[tuple[Any, str]]:
    """Every entity that is drawn, with its layer; those of a block on layer 0 take the layer of the INSERT."""
    if depth > _DEEPEST:
        raise NominalError(f"has blocks in blocks, more than {_DEEPEST} deep; expected a drawing of a profile: explode its blocks")
    for entity in container:
        own = str(entity.dxf.get("layer", "0"))
        layer = layer_of_block if own == "0" and layer_of_block is not None else own
        if entity.dxftype() != "INSERT":
            yield entity, layer
            continue
        for copy in entity.multi_insert() if entity.mcount > 1 else (entity,):
            yield from _entities(copy.virtual_entities(), layer, depth + 1)


def _take(entity: Any, layer: str, pieces: list[Piece], left_out: list[str], document: "Document") -> None:
    """Convert one entity, or count it among what is left out."""
    kind = entity.dxftype()
    convert = _CONVERSIONS.get(kind)
    if convert is None:
        left_out.append(kind)
    elif _hidden(entity, layer, document):
        left_out.append(f"hidden {kind}")
    else:
        name = f"{kind} {entity.dxf.get('handle') or ''}".strip()
        try:
            piece = convert(entity)
        except NominalError as error:
            raise NominalError(f"{name} on layer {layer}: {error}") from None
        if piece is None or not np.isfinite(piece.poles).all():
            raise_if_not_finite(piece, name, layer)
            left_out.append(f"{kind} without length or of another kind")
        else:
            pieces.append(replace(piece, layer=layer, name=name))


def raise_if_not_finite(piece: Piece | None, name: str, layer: str) -> None:
    """Raise NominalError for a curve with numbers that are none."""
    if piece is not None:
        raise NominalError(f"{name} on layer {layer}: holds a number that is not finite; export it again")


def _hidden(entity: Any, layer: str, document: "Document") -> bool:
    if entity.dxf.get("invisible", 0):
        return True
    if layer not in document.layers:
        return False
    drawn = document.layers.get(layer)
    return bool(drawn.is_off() or drawn.is_frozen())


def _line(entity: Any) -> Piece | None:
    ends = np.array([tuple(entity.dxf.start), tuple(entity.dxf.end)])
    return None if np.array_equal(*ends) else polyline(ends)


def _arc(entity: Any) -> Piece | None:
    """An arc or a circle: counter-clockwise about its extrusion, in its own coordinate system."""
    whole = entity.dxftype() == "CIRCLE"
    radius = float(entity.dxf.radius)
    if not radius > 0:
        return None
    start = 0.0 if whole else math.radians(entity.dxf.start_angle)
    sweep = 2 * math.pi if whole else math.radians((entity.dxf.end_angle - entity.dxf.start_angle) % 360) or 2 * math.pi
    center = tuple(entity.dxf.center)
    return _to_world(conic_arc(center, (radius, 0, 0), (0, radius, 0), start, start + sweep), entity)


def _ellipse(entity: Any) -> Piece | None:
    dxf = entity.dxf
    major, minor = np.array(tuple(dxf.major_axis)), np.array(tuple(entity.minor_axis))
    if not major.any() or not minor.any():
        return None
    start, end = float(dxf.start_param), float(dxf.end_param)
    sweep = end - start
    if not 0 < sweep <= 2 * math.pi:
        sweep = sweep % (2 * math.pi) or 2 * math.pi
    return conic_arc(tuple(dxf.center), major, minor, start, start + sweep)


def _spline(entity: Any) -> Piece | None:
    """A spline by its control points, or through its fit points as CAD draws it; periodic ones are spelt in two ways."""
    points = np.array([tuple(point) for point in entity.control_points], dtype=np.float64).reshape(-1, 3)
    if not len(points):
        if len(entity.fit_points) < 2:
            return None
        through = entity.construction_tool()
        return spline(through.degree, [tuple(point) for point in through.control_points], list(through.knots()))
    degree, knots = int(entity.dxf.degree), np.array(entity.knots, dtype=np.float64)
    weights = np.array(entity.weights, dtype=np.float64) if len(entity.weights) else None
    if len(knots) == len(points) + 1 and degree > 0 and (np.diff(knots) > 0).all() and (weights is None or len(weights) == len(points)):
        return wrap(degree, points, knots, weights)
    return spline(degree, points, knots, weights)


def _lwpolyline(entity: Any) -> Piece | None:
    rows = np.array([tuple(row) for row in entity.get_points("xyb")], dtype=np.float64).reshape(-1, 3)
    height = float(entity.dxf.get("elevation", 0.0))
    return _through(np.column_stack([rows[:, :2], np.full(len(rows), height)]), rows[:, 2], entity.closed, entity)


def _polyline(entity: Any) -> Piece | None:
    """A polyline of the old kind: plane with bulges, or in space. Meshes are no curves."""
    if not (entity.is_2d_polyline or entity.is_3d_polyline):
        return None
    vertices = [vertex for vertex in entity.vertices if not int(vertex.dxf.get("flags", 0)) & _FRAME]
    points = np.array([tuple(vertex.dxf.location) for vertex in vertices], dtype=np.float64).reshape(-1, 3)
    bulges = np.array([float(vertex.dxf.get("bulge", 0.0)) for vertex in vertices])
    if entity.is_3d_polyline:
        return _through(points, np.zeros(len(points)), entity.is_closed, None)
    points[:, 2] = float(tuple(entity.dxf.get("elevation", (0, 0, 0)))[2])
    return _through(points, bulges, entity.is_closed, entity)


def _through(points: Array, bulges: Array, closed: bool, plane: Any) -> Piece | None:
    """Lines and arcs through vertices; a closed polyline goes on to its first vertex by the bulge of the last."""
    if len(points) < 2:
        return None
    if closed:
        points, bulges = np.vstack([points, points[:1]]), np.append(bulges, 0.0)
    piece = through_vertices(points, bulges[:-1].tolist())
    return piece if piece is None or plane is None else _to_world(piece, plane)


def _to_world(piece: Piece, entity: Any) -> Piece:
    """A piece in the coordinate system of an entity's extrusion, in that of the drawing."""
    system = entity.ocs()
    if not system.transform:
        return piece
    axes = np.array([tuple(axis) for axis in (system.ux, system.uy, system.uz)])
    return replace(piece, poles=np.column_stack([piece.poles[:, :3] @ axes, piece.poles[:, 3]]))


_CONVERSIONS: Final[dict[str, Callable[[Any], Piece | None]]] = {
    "LINE": _line,
    "ARC": _arc,
    "CIRCLE": _arc,
    "ELLIPSE": _ellipse,
    "SPLINE": _spline,
    "LWPOLYLINE": _lwpolyline,
    "POLYLINE": _polyline,
}
