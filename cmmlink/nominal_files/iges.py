"""The curves of IGES files: arcs, conics, polylines, lines, B-splines, composites of them, and the matrices that place them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files.chains import counted_names
from cmmlink.nominal_files.drawing import Drawing
from cmmlink.nominal_files.iges_records import Entity, IgesFile, parse_iges
from cmmlink.nominal_files.pieces import Piece, conic_arc, polyline, reverse, spline
from cmmlink.nominal_files.solids import drawing_by_kernel
from drivers import read_bytes
from inspection import NominalError, SectionPlane

SUFFIXES = (".iges", ".igs")

Array = NDArray[np.float64]

_UNITS: Final = {
    1: ("inch", 25.4),
    2: ("mm", 1.0),
    4: ("foot", 304.8),
    5: ("mile", 1_609_344.0),
    6: ("m", 1000.0),
    7: ("km", 1e6),
    8: ("mil", 0.0254),
    9: ("um", 1e-3),
    10: ("cm", 10.0),
    11: ("microinch", 25.4e-6),
}
_NAMES: Final = {"IN": 1, "INCH": 1, "MM": 2, "FT": 4, "MI": 5, "M": 6, "KM": 7, "MIL": 8, "UM": 9, "CM": 10, "UIN": 11}
_SURFACES: Final = {108, 114, 118, 120, 122, 128, 140, 143, 144, *range(150, 199), 510, 514}
_OTHER = 3  # the flag of a unit that is told by its name
_COMPOSITE, _MATRIX = 102, 124
_DEEPEST = 20
_OFF_THE_CURVE = 1e-4  # of the radius: an end of an arc farther off is no rounding
_ROUNDING = 1e-7  # of a coefficient of a conic
_USES = {1: "annotation", 5: "curve on a surface", 6: "construction"}
_NO_DRAWING: Final = {_MATRIX, 314, 402, 404, 406, 410}  # matrices, colours, groups, sheets, properties, views


def draw(path: Path, section: SectionPlane | None) -> Drawing:
    """The curves of a file, each once: those of a composite within it. Without curves, the section of its surfaces and solids."""
    file = parse_iges(read_bytes(path).decode("latin-1"))
    mm_per_unit, unit = _unit(file)
    pieces: list[Piece] = []
    left_out: list[str] = []
    for entity in _free(file):
        if entity.hidden or entity.use in _USES:
            left_out.append("hidden entity" if entity.hidden else f"{_USES[entity.use]} entity")
        elif entity.kind == _COMPOSITE or entity.kind in _CURVES:
            made = _curves_of(file, entity, 0)
            pieces += [replace(piece, layer=str(entity.level)) for piece in made]
            left_out += [] if made else [f"entity {entity.kind} of form {entity.form} or without length"]
        elif entity.kind not in _NO_DRAWING:
            left_out.append(f"entity {entity.kind}")
    if not pieces and _SURFACES & {entity.kind for entity in file.entities.values()}:
        return drawing_by_kernel(path, "iges", section, "iges", mm_per_unit, unit)
    notes = [f"left out: {counted_names(left_out)}"] if left_out else []
    return Drawing(tuple(pieces), "iges", mm_per_unit, unit, notes=tuple(notes))


def _unit(file: IgesFile) -> tuple[float | None, str]:
    """The unit of the file: a flag, or for flag 3 a name. A model scale is applied by some programs and not by others: it says none."""
    scale, flag, name = (file.settings.get(number, "").strip() for number in (13, 14, 15))
    if scale and _number(scale) != 1.0:
        return None, f"states a model scale of {scale}, which some programs apply and others do not"
    if not flag and not name:
        return None, "states no unit"
    code = int(_number(flag)) if flag else _OTHER
    by_name = _NAMES.get(name.upper())
    code = by_name or code if code == _OTHER else code
    if code not in _UNITS:
        return None, f"states a unit that is not known (flag {flag or 'empty'}, name '{name}')"
    word, mm = _UNITS[code]
    contrary = f", although its name is {name}" if by_name not in (None, code) else ""
    return mm, f"{word} (unit flag {flag or 'empty'}{contrary})"


def _number(text: str) -> float:
    try:
        return float(text.replace("D", "E").replace("d", "e"))
    except ValueError:
        raise NominalError(f"the global section has '{text}' where a number is expected; export the file again") from None


def _free(file: IgesFile) -> list[Entity]:
    """The entities that are drawn for themselves: no children of composites, and no parts of surfaces, dimensions or figures."""
    children = {abs(child.number) for entity in file.entities.values() if entity.kind == _COMPOSITE for child in _children(file, entity)}
    return [entity for entity in file.entities.values() if entity.number not in children and not entity.dependent]


def _children(file: IgesFile, composite: Entity) -> list[Entity]:
    count = composite.whole(0)
    if not 0 < count <= len(file.entities):
        raise NominalError(f"{composite.name}: is made of {count} curves; the file holds {len(file.entities)} entities")
    return [_pointed_at(file, composite, round(pointer)) for pointer in composite.reals(1, count)]


def _pointed_at(file: IgesFile, by: Entity, pointer: int) -> Entity:
    if abs(pointer) not in file.entities:
        raise NominalError(f"{by.name}: points to an entity D{abs(pointer)}, which is not there; export the file again")
    return file.entities[abs(pointer)]


def _curves_of(file: IgesFile, entity: Entity, depth: int) -> list[Piece]:
    """The curves of an entity where its matrix places them; a composite gives those of its children, in its order."""
    if depth > _DEEPEST:
        raise NominalError(f"{entity.name}: composites in composites, more than {_DEEPEST} deep; do they hold one another?")
    if entity.kind == _COMPOSITE:
        made = [piece for child in _children(file, entity) for piece in _curves_of(file, child, depth + 1)]
    elif entity.kind in _CURVES:
        try:
            piece = _CURVES[entity.kind](entity)
        except NominalError as error:
            raise NominalError(f"{entity.name}: {str(error).removeprefix(f'{entity.name}: ')}") from None
        made = [] if piece is None else [replace(piece, name=entity.name)]
    else:
        raise NominalError(f"{entity.name}: is a part of a curve, and of a kind that is not read; export the profile as B-splines")
    return [_placed(file, entity, piece) for piece in made]


def _placed(file: IgesFile, entity: Entity, piece: Piece) -> Piece:
    """A curve where the matrices of its entity place it, one after another."""
    poles, by = piece.poles, entity
    for _ in range(_DEEPEST):
        if not by.transform:
            return replace(piece, poles=poles) if poles is not piece.poles else piece
        by = _pointed_at(file, by, by.transform)
        if by.kind != _MATRIX:
            raise NominalError(f"{entity.name}: is placed by {by.name}, which is no matrix; export the file again")
        matrix = np.array(by.reals(0, 12)).reshape(3, 4)
        if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:, :3])) < 1e-9:
            raise NominalError(f"{by.name}: is a matrix that flattens what it places; export the file again")
        poles = np.column_stack([poles @ matrix.T, poles[:, 3]])
    raise NominalError(f"{entity.name}: is placed by more than {_DEEPEST} matrices; do they place one another?")


def _arc(entity: Entity) -> Piece | None:
    """An arc in a plane of constant z, counter-clockwise; start and end at one place make a circle."""
    z, *rest = entity.reals(0, 7)
    center, start, end = np.array(rest).reshape(3, 2)
    radius, far = float(np.hypot(*(start - center))), float(np.hypot(*(end - center)))
    if not radius > 0:
        return None
    if abs(far - radius) > _OFF_THE_CURVE * radius:
        raise NominalError(f"its end lies {far - radius:+.4g} off its circle of radius {radius:.6g}; expected both ends on it")
    first, last = (float(np.arctan2(*(point - center)[::-1])) for point in (start, end))
    sweep = 2 * np.pi if np.array_equal(start, end) else (last - first) % (2 * np.pi)
    return None if sweep == 0 else conic_arc((*center, z), (radius, 0, 0), (0, radius, 0), first, first + sweep)


def _conic(entity: Entity) -> Piece | None:
    """The arc of A x^2 + B x y + C y^2 + D x + E y + F = 0 in a plane of constant z, from start to end; an ellipse counter-clockwise."""
    *told, f, z = entity.reals(0, 7)
    start, end = np.array(entity.reals(7, 4)).reshape(2, 2)
    a, b, c, d, e = _through_ends(np.array(told), f, np.array([start, end]))
    matrix, slope = np.array([[a, b / 2], [b / 2, c]]), np.array([d, e])
    if np.linalg.det(matrix) <= 1e-12 * np.abs(matrix).max() ** 2:
        return _open_conic(matrix, slope, f, z, start, end)
    center = np.linalg.solve(matrix, -slope / 2)
    squares, axes = np.linalg.eigh(matrix / -(f + slope @ center / 2))
    if (squares <= 0).any():
        raise NominalError("its coefficients describe no ellipse; expected a conic with points on it")
    major, minor = axes[:, 0] / np.sqrt(squares[0]), axes[:, 1] / np.sqrt(squares[1])
    if major[0] * minor[1] < major[1] * minor[0]:
        minor = -minor
    inverse = np.linalg.inv(np.column_stack([major, minor]))
    at = [inverse @ (point - center) for point in (start, end)]
    if any(abs(np.hypot(*point) - 1) > _OFF_THE_CURVE for point in at):
        raise NominalError("an end does not lie on its ellipse; expected both ends on it")
    first, last = (float(np.arctan2(point[1], point[0])) for point in at)
    sweep = 2 * np.pi if np.array_equal(start, end) else (last - first) % (2 * np.pi) or 2 * np.pi
    return conic_arc((*center, z), (*major, 0), (*minor, 0), first, first + sweep)


def _through_ends(told: Array, constant: float, ends: Array) -> Array:
    """The coefficients (5,) of a conic, changed by no more than their rounding so that it passes its ends (2, 2).

    OCCT writes coefficients with nine digits and points with thirteen: 3e-8 mm of an ellipse of 11 mm would be lost otherwise.
    """
    x, y = ends.T
    terms = np.column_stack([x * x, x * y, y * y, x, y]) * told
    share = np.linalg.lstsq(terms, -(terms.sum(axis=1) + constant), rcond=1e-6)[0]
    return told * (1 + share) if np.abs(share).max() < _ROUNDING else told


def _open_conic(matrix: Array, slope: Array, constant: float, z: float, start: Array, end: Array) -> Piece | None:
    """A parabola or one branch of a hyperbola as one rational quadratic: its middle pole is where the tangents of the ends meet."""
    if np.array_equal(start, end):
        return None
    normals = np.array([2 * matrix @ point + slope for point in (start, end)])
    if abs(np.linalg.det(normals)) <= 1e-12 * np.prod(np.linalg.norm(normals, axis=1)):
        raise NominalError("its ends have the same tangent; expected a conic that bends")
    pole = np.linalg.solve(normals, (normals * [start, end]).sum(axis=1))
    middle = (start + end) / 2
    ray = pole - middle
    # the shoulder: where the line from the middle of the chord to the pole crosses the conic, at a share t = w / (1 + w)
    square = ray @ matrix @ ray
    linear = 2 * middle @ matrix @ ray + slope @ ray
    rest = middle @ matrix @ middle + slope @ middle + constant
    roots = np.roots([square, linear, rest] if abs(square) > 1e-14 * abs(linear) else [linear, rest])
    shares = [float(root.real) for root in roots if abs(root.imag) < 1e-9 and 0 < root.real < 1]
    if not shares:
        raise NominalError("its ends lie on different branches; expected one piece of a conic")
    weight = shares[0] / (1 - shares[0])
    points = np.column_stack([np.vstack([start, pole, end]), np.full(3, z)])
    return spline(2, points, [0, 0, 0, 1, 1, 1], [1, weight, 1])


def _path(entity: Entity) -> Piece | None:
    """Copious data as a polyline: pairs at one z, triples, or triples with a vector beside each."""
    if entity.form not in (1, 2, 3, 11, 12, 13, 63):
        return None
    kind, count = entity.whole(0), entity.whole(1)
    width = {1: 2, 2: 3, 3: 6}.get(kind)
    if width is None or not 0 < count <= len(entity.parameters):
        raise NominalError(f"holds {count} points of kind {kind}; expected kind 1, 2 or 3, and some points")
    first = 3 if kind == 1 else 2
    rows = np.array(entity.reals(first, width * count)).reshape(count, width)
    points = np.column_stack([rows[:, :2], np.full(count, entity.real(2))]) if kind == 1 else rows[:, :3]
    if entity.form == 63 and not np.array_equal(points[0], points[-1]):
        points = np.vstack([points, points[:1]])
    different = np.append(True, (points[1:] != points[:-1]).any(axis=1))
    return polyline(points[different]) if different.sum() > 1 else None


def _line(entity: Entity) -> Piece | None:
    """A line between two points; a ray or an endless line is no part of a profile."""
    ends = np.array(entity.reals(0, 6)).reshape(2, 3)
    return None if entity.form in (1, 2) or np.array_equal(*ends) else polyline(ends)


def _spline(entity: Entity) -> Piece | None:
    """A rational B-spline, cut to the part of its range that is used; its flags are often wrong and not needed."""
    upper, degree = entity.whole(0), entity.whole(1)
    if not (0 < degree <= upper and 4 * upper < len(entity.parameters)):
        raise NominalError(
            f"a spline of degree {degree} with {upper + 1} control points and {len(entity.parameters)} parameters: is the file cut off?"
        )
    count = upper + 1
    knots = entity.reals(6, count + degree + 1)
    weights = entity.reals(6 + len(knots), count)
    at = 6 + len(knots) + count
    points = np.array(entity.reals(at, 3 * count)).reshape(count, 3)
    used = entity.reals(at + 3 * count, 2) if at + 3 * count + 2 <= len(entity.parameters) else [knots[degree], knots[-degree - 1]]
    if used[1] < used[0]:
        return reverse(spline(degree, points, knots, weights, (used[1], used[0])))
    return spline(degree, points, knots, weights, (used[0], used[1]))


_CURVES: Final[dict[int, Callable[[Entity], Piece | None]]] = {100: _arc, 104: _conic, 106: _path, 110: _line, 126: _spline}
