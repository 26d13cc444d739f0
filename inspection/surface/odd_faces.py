"""What is odd about the faces of a nominal and may make its answers odd: faces on each other, slivers, and surfaces that cut themselves."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.surface.feet import FootKind, SurfaceFeet
from inspection.surface.patches import PatchSurface
from inspection.surface.spline_face import SplineFace
from inspection.surface.triangles import TriangleSurface
from inspection.surface.welding import weld

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Truth = NDArray[np.bool_]

_SAMPLES, _ALONG = 40, 7  # places of a face that are looked for on others; of a whole one in u and in v
_ON_EACH_OTHER = 1e-6  # of the size of the part
_NEARLY_ALL = 0.9
_SLIVER = 1e-3  # of the square of its length: the area of a face that is a thousand times as long as wide
_NAMED = 3  # of a kind that are named one by one
_MOST_TRIANGLES, _MOST_ENTRIES, _MOST_PAIRS = 150_000, 5_000_000, 20_000_000
_PAIRS_AT_ONCE = 1 << 18
_INSIDE = 1e-6  # of a triangle: what passes beside it does not cut


@dataclass(frozen=True, slots=True, eq=False)
class SingleFace:
    """One face of a part as it is looked at.

    places, normals : (n, 3) on it, and outward
    area_mm2        : of the face
    project         : finds feet on it alone
    """

    places: Array
    normals: Array
    area_mm2: float
    project: Callable[[Array], SurfaceFeet]

    @classmethod
    def of_triangles(cls, triangles: Array) -> "SingleFace":
        """A face that is given by triangles (n, 3, 3), some of which have an area."""
        surface = TriangleSurface(triangles)
        return cls(*surface.sample(_SAMPLES), surface.area_mm2, surface.project)

    @classmethod
    def of_spline(cls, face: SplineFace) -> "SingleFace":
        """A whole face. Its pieces are made only where feet on it are asked for."""
        u, v = (line[0] + (np.arange(_ALONG) + 0.5) / _ALONG * (line[-1] - line[0]) for line in (face.breaks(0)[0], face.breaks(1)[0]))
        on = face.on_grid(u, v, 1)
        across = np.cross(on[1, 0], on[0, 1]).reshape(-1, 3) * (-1.0 if face.reversed else 1.0)
        length = np.linalg.norm(across, axis=1)
        area = float(length.mean() * (u[-1] - u[0]) * (v[-1] - v[0]) * (_ALONG / (_ALONG - 1)) ** 2)
        normals = across / np.where(length > 0, length, 1.0)[:, None]
        return cls(on[0, 0].reshape(-1, 3), normals, area, lambda points: PatchSurface([face], joined=False).project(points))


def words_on_odd_faces(faces: Sequence[SingleFace], error_mm: float = 0.0) -> tuple[str, ...]:
    """Sentences on slivers and on faces that lie on each other; they are counted from 1.

    error_mm : how far what is given may lie off the faces
    """
    low, high = (np.array([function(face.places, axis=0) for face in faces]) for function in (np.min, np.max))
    length = (high - low).max(axis=1)
    thin = [i for i, face in enumerate(faces) if face.area_mm2 < _SLIVER * length[i] ** 2]
    verb = "is a sliver" if len(thin) == 1 else "are slivers"
    said = [f"{_named('face', thin)} {verb}, a thousand times as long as wide"] if thin else []
    near_mm = 2 * error_mm + _ON_EACH_OTHER * float((high.max(axis=0) - low.min(axis=0)).max())
    for i, face in enumerate(faces):
        holds = (low <= low[i] + 0.02 * length[i] + near_mm).all(axis=1) & (high >= high[i] - 0.02 * length[i] - near_mm).all(axis=1)
        for j in np.flatnonzero(holds & (np.arange(len(faces)) != i)).tolist():
            if f"{_named('face', sorted([i, j]))} lie" in " ".join(said):
                continue
            feet = faces[j].project(face.places)
            on = np.abs(feet.distance_mm) <= near_mm
            if on.mean() < _NEARLY_ALL:
                continue
            same = float((feet.normal * face.normals)[on & (feet.kind == FootKind.FACE)].sum()) >= 0
            told = "one of them stands twice" if same else "their outsides are opposite: the side of a point there is by lot"
            said.append(f"{_named('face', sorted([i, j]))} lie on each other, and {told}")
    return tuple(said)


def _named(noun: str, numbers: list[int]) -> str:
    """The first of some numbers, from 0, by name, from 1."""
    listed = ", ".join(str(number + 1) for number in numbers[:_NAMED])
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return f"{noun}{'' if len(numbers) == 1 else 's'} {listed}{more}"


def words_on_odd_triangles(triangles: Array, face: Index | None = None) -> tuple[str, ...]:
    """Sentences on triangles (n, 3, 3) that stand twice or cut through others; where they belong to faces (n,), these are named."""
    said = []
    if face is None:
        _, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        _, first, again = np.unique(np.sort(corners.reshape(-1, 3), axis=1), axis=0, return_index=True, return_inverse=True)
        twice = np.flatnonzero(first[again.ravel()] != np.arange(len(triangles)))
        if len(twice):
            said.append(f"{_named('triangle', twice.tolist())} {'has' if len(twice) == 1 else 'have'} the corners of another one")
    if len(triangles) > _MOST_TRIANGLES:
        return (*said, f"{len(triangles):,} triangles are too many to look whether they cut through each other")
    welded = weld(triangles)
    noun, number = ("triangle", welded.given) if face is None else ("face", face[welded.given])
    triangles = welded.corners_mm[welded.triangles]
    pairs = cutting_pairs(triangles, welded.triangles)
    if pairs is None:
        return (*said, "the triangles are of too different sizes to look whether they cut through each other")
    one, other = pairs
    if len(one):
        x, y, z = triangles[one[0]].mean(axis=0)
        names = sorted({int(each) for each in (number[one[0]], number[other[0]])})
        said.append(
            f"the surface cuts through itself at {len(one)} pairs of triangles, the first of {_named(noun, names)} near "
            f"({x:.6g}, {y:.6g}, {z:.6g}) mm: what is inside is not clear there"
        )
    return tuple(said)


def cutting_pairs(triangles: Array, corners: Index) -> tuple[Index, Index] | None:
    """Pairs of triangles (n, 3, 3) of which an edge of one passes through the inside of the other; None where there are too many to try.

    corners : (n, 3) numbers of the corners: triangles that share one are neighbours
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    near = _near_pairs(low, high)
    if near is None:
        return None
    one, other = near
    touching_mm = _ON_EACH_OTHER * float((high.max(axis=0) - low.min(axis=0)).max())
    found = []
    for begin in range(0, len(one), _PAIRS_AT_ONCE):
        a, b = one[begin : begin + _PAIRS_AT_ONCE], other[begin : begin + _PAIRS_AT_ONCE]
        meets = ((low[a] <= high[b]) & (high[a] >= low[b])).all(axis=1)
        meets &= ~(corners[a][:, :, None] == corners[b][:, None]).any(axis=(1, 2))
        a, b = a[meets], b[meets]
        cuts = _passes_through(triangles[a], triangles[b], touching_mm) | _passes_through(triangles[b], triangles[a], touching_mm)
        found.append(np.stack([a[cuts], b[cuts]]))
    pairs = np.unique(np.concatenate(found, axis=1), axis=1) if found else np.empty((2, 0), dtype=np.int64)
    return pairs[0], pairs[1]


def _near_pairs(low: Array, high: Array) -> tuple[Index, Index] | None:
    """Pairs of boxes that have a cell of a grid in common, as wide as most boxes; None where there are too many."""
    wide = float(np.median((high - low).max(axis=1))) * 1.5
    begin = np.floor((low - low.min(axis=0)) / wide).astype(np.int64)
    count = np.floor((high - low.min(axis=0)) / wide).astype(np.int64) - begin + 1
    many = count.prod(axis=1)
    if many.sum() > _MOST_ENTRIES:
        return None
    box = np.repeat(np.arange(len(low)), many)
    step = np.arange(len(box)) - np.repeat(np.cumsum(many) - many, many)
    within = np.stack([step % count[box, 0], step // count[box, 0] % count[box, 1], step // (count[box, 0] * count[box, 1])], axis=1)
    cell = begin[box] + within
    across = cell.max(axis=0) + 1
    key = (cell[:, 0] * across[1] + cell[:, 1]) * across[2] + cell[:, 2]
    order = np.argsort(key, kind="stable")
    box, key = box[order], key[order]
    end = np.searchsorted(key, key, side="right")
    ahead = end - np.arange(len(key)) - 1
    if ahead.sum() > _MOST_PAIRS:
        return None
    first = np.repeat(np.arange(len(key)), ahead)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(ahead) - ahead, ahead)
    return np.minimum(box[first], box[second]), np.maximum(box[first], box[second])


def _passes_through(edges_of: Array, triangles: Array, touching_mm: float) -> Truth:
    """Whether an edge of triangles (k, 3, 3) passes through the inside of others (k, 3, 3) (Moeller and Trumbore 1997).

    touching_mm : an end of an edge that is nearer to their plane only touches them
    """
    a, e, g = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(e, g)
    with np.errstate(divide="ignore", invalid="ignore"):  # one without area is cut by nothing
        height = ((edges_of - a[:, None]) * (normal / np.linalg.norm(normal, axis=1)[:, None])[:, None]).sum(axis=2)
    result = np.zeros(len(triangles), dtype=bool)
    for i in range(3):
        j = (i + 1) % 3
        beyond = (np.minimum(height[:, i], height[:, j]) < -touching_mm) & (np.maximum(height[:, i], height[:, j]) > touching_mm)
        way = edges_of[:, j] - edges_of[:, i]
        across = np.cross(way, g)
        with np.errstate(divide="ignore", invalid="ignore"):
            per, off = 1 / (e * across).sum(axis=1), edges_of[:, i] - a
            u, v = (off * across).sum(axis=1) * per, (way * np.cross(off, e)).sum(axis=1) * per
            result |= beyond & (u > _INSIDE) & (v > _INSIDE) & (u + v < 1 - _INSIDE)
    return result
