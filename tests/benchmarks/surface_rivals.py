"""Ways of other libraries to measure points against faces and meshes, each as it is fastest: built once, kept, and asked for all points.

A library that cannot be loaded is left out, and said so with the reason. Each is loaded only when its ways are made.
"""

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.surface import SplineFace

Array = NDArray[np.float64]
_FEW = 500  # points of a way that takes milliseconds for each
_SOME = 2_000  # of one that takes up to seven tenths of a millisecond
_MOST_OF_RTREE = 300_000  # triangles; of a million its tree takes minutes and 8 GB


def _as_it_is(answer: Any, _: Array) -> Array:
    return np.asarray(answer, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Way:
    """How distances of points from a surface are asked for.

    ask       : takes points (m, 3); this is what is timed
    read      : makes distances (m,) of its answer and the points, positive outside; not timed
    is_signed : whether these distances have a sign
    most      : more points are not given to it
    is_one_by_one : whether `read` takes much longer than `ask`, so that few points are read
    """

    name: str
    ask: Callable[[Array], Any]
    read: Callable[[Any, Array], Array] = _as_it_is
    is_signed: bool = True
    most: int = 10**9
    is_one_by_one: bool = False

    def distances(self, points: Array) -> Array:
        """Distances (m,) of points (m, 3) in mm."""
        return self.read(self.ask(points), points)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A library that is not measured, and why."""

    rival: str
    reason: str

    @property
    def words(self) -> str:
        """One line."""
        return f"{self.rival} is left out: {self.reason}"


Corners = Array
Triangles = NDArray[np.int64]
OfMesh = Callable[[Any, Corners, Triangles], Iterator[Way]]


def indexed(triangles: Array) -> tuple[Corners, Triangles]:
    """Each corner (k, 3) once, and the numbers (n, 3) of those of each triangle: pseudonormals need neighbours."""
    corners, numbers = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return corners, numbers.reshape(-1, 3).astype(np.int64)


def ways_on_mesh(triangles: Array, wanted: Callable[[Way], bool] = lambda _: True) -> tuple[list[Way], list[LeftOut]]:
    """What each library offers for a mesh (n, 3, 3), and which of them are left out."""
    corners, numbers = indexed(triangles)
    ways, left = list[Way](), list[LeftOut]()
    for library, make in _OF_MESHES.items():
        try:
            ways += [way for way in make(importlib.import_module(library), corners, numbers) if wanted(way)]
        except (ImportError, OSError, MemoryError) as error:  # not installed, or without what it needs
            left.append(LeftOut(library, str(error).splitlines()[0]))
    return ways, left


def ways_on_face(face: SplineFace) -> tuple[list[Way], list[LeftOut]]:
    """What Open CASCADE offers for a face without weights."""
    try:
        peer = importlib.import_module("tests.inspection.surface.occt_surfaces")
    except (ImportError, OSError) as error:
        return [], [LeftOut("Open CASCADE", str(error).splitlines()[0])]
    surface = peer.surface_of(
        {
            "degree": np.array(face.degree),
            "knots_u": face.knots_u,
            "knots_v": face.knots_v,
            "control_points": face.control_points_mm,
            "weights": np.ones(face.control_points_mm.shape[:2]),
        }
    )
    inside = peer.GeomAPI_ProjectPointOnSurf()
    inside.Init(surface, *surface.Bounds(), peer.Extrema_ExtAlgo.Extrema_ExtAlgo_Tree)

    def by_tree(points: Array) -> Array:
        result = np.empty(len(points))
        for i, point in enumerate(points):
            inside.Perform(peer.gp_Pnt(*point.tolist()))
            result[i] = inside.LowerDistance() if inside.NbPoints() else np.nan
        return result

    return [Way("Open CASCADE, one object kept, tree", by_tree, is_signed=False, most=_FEW)], []


def _of_open3d(open3d: Any, corners: Corners, triangles: Triangles) -> Iterator[Way]:
    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(corners.astype(np.float32), triangles.astype(np.uint32))

    def plain(points: Array) -> Any:
        return scene.compute_distance(points.astype(np.float32), nthreads=1).numpy()

    def signed(rays: int) -> Callable[[Array], Any]:
        return lambda points: scene.compute_signed_distance(points.astype(np.float32), nthreads=1, nsamples=rays).numpy()

    yield Way("Open3D, float32", plain, is_signed=False)
    yield Way("Open3D, float32, sign by a ray", signed(1))
    yield Way("Open3D, float32, sign by 11 rays", signed(11))


def _of_libigl(igl: Any, corners: Corners, triangles: Triangles) -> Iterator[Way]:
    tree = igl.AABB()
    tree.init(corners, triangles)

    def signed(kind: Any) -> Callable[[Array], Any]:
        return lambda points: igl.signed_distance(points, corners, triangles, kind)[0]

    yield Way("libigl", lambda points: np.sqrt(tree.squared_distance(corners, triangles, points)[0]), is_signed=False)
    yield Way("libigl, pseudonormals", signed(igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL))
    yield Way("libigl, fast winding number", signed(igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER))


def _of_fcpw(fcpw: Any, corners: Corners, triangles: Triangles) -> Iterator[Way]:
    scene = fcpw.scene_3D()
    scene.set_object_count(1)
    scene.set_object_vertices(np.asfortranarray(corners, dtype=np.float32), 0)
    scene.set_object_triangles(np.asfortranarray(triangles, dtype=np.int32), 0)
    scene.build(fcpw.aggregate_type.bvh_surface_area, True)

    def ask(points: Array) -> Any:
        found = fcpw.interaction_3D_list()
        scene.find_closest_points(points.astype(np.float32, order="F"), np.full(len(points), np.inf, np.float32), found, True)
        return found

    def read(found: Any, points: Array) -> Array:
        return np.array([one.signed_distance(point) for one, point in zip(found, points.astype(np.float32), strict=True)])

    yield Way("FCPW, float32, sign by the triangle's normal", ask, read, is_one_by_one=True)


def _of_engeom(_: Any, corners: Corners, triangles: Triangles) -> Iterator[Way]:
    mesh = importlib.import_module("engeom.geom3").Mesh3(corners, triangles.astype(np.uint32))
    yield Way("engeom", lambda points: mesh.measure_deviations(points, "point"))


def _of_trimesh(trimesh: Any, corners: Corners, triangles: Triangles) -> Iterator[Way]:
    importlib.import_module("rtree")
    if len(triangles) > _MOST_OF_RTREE:
        raise MemoryError(f"its tree of {len(triangles):,} triangles takes minutes and gigabytes")
    mesh = trimesh.Trimesh(corners, triangles, process=False)
    yield Way("trimesh", lambda points: trimesh.proximity.closest_point(mesh, points)[1], is_signed=False, most=_SOME)
    yield Way("trimesh, signed", lambda points: -trimesh.proximity.signed_distance(mesh, points), most=_SOME)


_OF_MESHES: dict[str, OfMesh] = {
    "open3d": _of_open3d,
    "igl": _of_libigl,
    "fcpw": _of_fcpw,
    "engeom": _of_engeom,
    "trimesh": _of_trimesh,
}
