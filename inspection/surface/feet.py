"""What every kind of nominal surface answers: the closest point to each measured point, on which side, and what it lies on."""

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.kernels.surfaces import SpaceFeet, layout
from inspection.verdict import Rejection

Array = NDArray[np.float64]
Index = NDArray[np.int64]

KILOMETRE_MM = 1e6  # as for profiles: no part is so far from zero
_OPPOSITE = 0.5  # cosine of 60 degrees


class FootKind(IntEnum):
    """What a foot lies on."""

    FACE = layout.ON_FACE
    EDGE = layout.ON_EDGE
    CORNER = layout.ON_CORNER
    BORDER = layout.ON_BORDER  # of an open surface: which side the point is on is then not known
    NONE = layout.NO_FOOT  # the point is not finite


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceFeet:
    """Closest points of a nominal surface to m measured points.

    foot_mm     : (m, 3) the closest nominal points
    distance_mm : (m,) the signed deviation, positive out of material
    normal      : (m, 3) unit direction in which the deviation grows; on a face its outward normal
    face        : (m,) number of the face, from 0, that the foot lies on; -1 where there is no foot
    parameter   : (m, 2) where on it: u and v of a spline face; of a triangle the weights of its second and third corner
    kind        : (m,) codes of `FootKind`
    error_mm    : (m,) bound of how far the nominal may lie off what it stands for there: 0 on faces of CAD that are projected on as they
                  are. It counts against the verdict on that point as U does; none is above the nominal's `nominal_error_mm`
    """

    foot_mm: Array
    distance_mm: Array
    normal: Array
    face: NDArray[np.int32]
    parameter: Array
    kind: NDArray[np.uint8]
    error_mm: Array

    def __post_init__(self) -> None:
        m = len(self.distance_mm)
        shapes = ((m, 3), (m,), (m, 3), (m,), (m, 2), (m,), (m,))
        arrays: list[NDArray[Any]] = [self.foot_mm, self.distance_mm, self.normal, self.face, self.parameter, self.kind, self.error_mm]
        if any(array.shape != shape for array, shape in zip(arrays, shapes, strict=True)):
            raise ValueError(f"expected {shapes}, got {[array.shape for array in arrays]}")
        for array in arrays:
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.distance_mm)

    def __repr__(self) -> str:
        known = self.distance_mm[self.kind < FootKind.BORDER]
        extent = f", {known.min():+.4f} .. {known.max():+.4f} mm" if len(known) else ""
        return f"<SurfaceFeet of {len(self)} points{extent}, {np.count_nonzero(self.kind == FootKind.BORDER)} beyond a border>"


class NominalSurface(Protocol):
    """A nominal surface of any kind: patches, triangles or a cloud."""

    @property
    def nominal_error_mm(self) -> float:
        """Bound of how far this surface may lie off the one that it stands for, anywhere. `SurfaceFeet.error_mm` is that of each point."""

    @property
    def sides_known(self) -> bool:
        """Whether it is known which side of this surface is out of material; else only the size of a deviation may be judged."""

    @property
    def area_mm2(self) -> float:
        """Area of the surface."""

    @property
    def size_mm(self) -> float:
        """The longest side of the box that holds the surface."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed about the input, or done to it, in sentences."""

    def project(self, points_mm: ArrayLike) -> SurfaceFeet:
        """Closest points of the surface to points (m, 3) in its coordinates. Points that are not finite have no foot."""

    def sample(self, count: int) -> tuple[Array, Array]:
        """At least `count` places (n, 3) spread evenly over the area, and the outward normals (n, 3) there."""


def rejections(feet: SurfaceFeet, farthest_mm: float, scan_normals: ArrayLike | None = None) -> NDArray[np.int8]:
    """Why points are not judged, as codes (m,) of `Rejection`; NONE for those that are.

    farthest_mm  : a point farther from the surface is OFF_SURFACE: dust, a fixture, or what is not nominal
    scan_normals : (m, 3) outward directions of the measured surface, of any length, where the scanner gives them; zero or NaN where it
                   does not. A foot whose normal is more than 60 degrees off lies on the OPPOSITE_FACE of a thin wall
    """
    result = np.full(len(feet), Rejection.NONE, dtype=np.int8)
    if scan_normals is not None:
        normals = np.asarray(scan_normals, dtype=np.float64)
        if normals.shape != feet.normal.shape:
            raise ValueError(f"scan normals must have shape {feet.normal.shape}, got {normals.shape}")
        result[faces_away(feet, normals)] = Rejection.OPPOSITE_FACE
    result[np.abs(feet.distance_mm) > farthest_mm] = Rejection.OFF_SURFACE
    result[feet.kind == FootKind.BORDER] = Rejection.BEYOND_EDGE  # however far: what lies there is not this surface
    result[feet.kind == FootKind.NONE] = Rejection.NOT_FINITE
    return result


def faces_away(feet: SurfaceFeet, scan_normals: Array) -> NDArray[np.bool_]:
    """Whether feet (m,) lie on a face that looks elsewhere, by more than 60 degrees, than the measured surface did at the points.

    scan_normals : (m, 3) its outward directions, of any length; zero or NaN where they are not known
    """
    along = (scan_normals * feet.normal).sum(axis=1)
    return np.asarray(along < _OPPOSITE * np.sqrt((scan_normals**2).sum(axis=1)))


def with_rows(feet: SurfaceFeet, rows: Index, which: NDArray[np.bool_], others: SurfaceFeet) -> SurfaceFeet:
    """The feet with those of others (k,) that are marked (k,) in place of some rows, one for each mark."""
    made = {field.name: getattr(feet, field.name).copy() for field in fields(SurfaceFeet)}
    for name, column in made.items():
        column[rows] = getattr(others, name)[which]
    return SurfaceFeet(**made)


def surface_feet(found: SpaceFeet, error_mm: float, face: NDArray[np.int32] | None = None) -> SurfaceFeet:
    """Feet as the loops fill them in, as a record. The face of an item (n,) stands in for its number, where there is more than one item."""
    error = np.full(len(found.kind), error_mm)
    items = found.item if face is None else face[found.item]
    if len(items) and found.item.min() < 0:
        items = np.where(found.item >= 0, items, np.int32(-1))
    return SurfaceFeet(found.foot_mm, found.distance_mm, found.normal, items, found.parameter, found.kind, error)


def points_in_space(points_mm: ArrayLike) -> Array:
    """Points as a float array (m, 3). Those that are no place of a part, farther than a kilometre, are NaN."""
    points = np.asarray(points_mm, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points must have shape (m, 3), got {points.shape}")
    if not len(points) or (points.max() <= KILOMETRE_MM and points.min() >= -KILOMETRE_MM):  # not so where one is NaN
        return points
    near = np.asarray((np.abs(points) <= KILOMETRE_MM).all(axis=1))
    return np.where(near[:, None], points, np.nan)
