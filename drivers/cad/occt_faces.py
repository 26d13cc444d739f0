"""What the child of occt_process.py finds of faces: exact splines, with loops where they are trimmed, and then triangles as well.

A face is whole where its loop runs along the border of a rectangle of its parameters. Planes, cylinders and the like become rational
splines. The triangles come with a bound of how far they lie off the faces, found at their middles, at those of their sides and
along the edges.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.cad.occt_loops import loop_of
from drivers.errors import CadError

Array = NDArray[np.float64]

_PLACES = 9  # along an edge at which its course is looked at
_STRAY = 0.1  # of the chord: how far segments may leave a loop
_TURN_RAD = 0.2  # between neighbouring triangles
_SAFETY = 1.5  # times the largest distance found
_ON_BORDER_MM = 1e-6
_ROUND_OFF = 1e-9  # of a period


def faces_of(faces: Sequence[Any], shape: Any, chord_mm: float) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    """The answer on faces: degrees and directions, with poles (a, b, 4) and knots of those that are exact splines.

    A trimmed one has the segments of its loops as well. Where there are such or faces without a spline, all are given as triangles
    (t, 3, 3) too, with the face of each (t,).
    """
    if not faces:
        raise CadError("holds no face; a surface is needed")
    told: dict[str, Any] = {"faces": [], "error_mm": 0.0}
    arrays: list[NDArray[Any]] = []
    for face in faces:
        each, found = _face(face, _STRAY * chord_mm)
        told["faces"].append(each)
        arrays += found
    if any(each["trimmed"] for each in told["faces"]):
        triangles, owner, told["error_mm"] = _triangles(faces, shape, chord_mm)
        arrays += [triangles, owner]
    return told, arrays


def _face(face: Any, stray_mm: float) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    """The answer on one face, and its arrays: none where it is no exact spline."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.BRepTools import BRepTools

    told: dict[str, Any] = {"trimmed": True, "reversed": _is_reversed(face)}
    bounds, surface = BRepTools.UVBounds_s(face), BRep_Tool.Surface_s(face)
    spline = _spline(face, surface, bounds)
    if spline is None:
        return told, []
    loop: list[NDArray[Any]] = []
    if _runs_along(face, surface, bounds):
        told["trimmed"] = False
    else:
        edges = ((BRepAdaptor_Curve2d(edge, face), float(BRep_Tool.Tolerance_s(edge))) for edge in _edges(face))
        found = loop_of(edges, surface, spline, stray_mm)
        if found is None:
            return told, []
        loop, told["loop_off_mm"] = [found[0]], found[1]
    told["degree"] = [spline.UDegree(), spline.VDegree()]
    return told, [_poles(spline), *_knots(spline), *loop]


def _is_reversed(face: Any) -> bool:
    from OCP.TopAbs import TopAbs_REVERSED

    return bool(face.Orientation() == TopAbs_REVERSED)


def _edges(face: Any) -> Iterator[Any]:
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    edges = TopExp_Explorer(face, TopAbs_EDGE)
    cast = getattr(TopoDS, "Edge", None) or TopoDS.Edge_s  # without an underscore since OCCT 8
    while edges.More():
        yield cast(edges.Current())
        edges.Next()


def _spline(face: Any, surface: Any, bounds: Sequence[float]) -> Any:
    """The surface of a face as a spline over the rectangle around its loops; None where it is no exact one."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_OffsetSurface, GeomAbs_OtherSurface
    from OCP.GeomConvert import GeomConvert

    if BRepAdaptor_Surface(face).GetType() in (GeomAbs_OffsetSurface, GeomAbs_OtherSurface):
        return None
    try:
        spline = GeomConvert.SurfaceToBSplineSurface_s(_restricted(surface, bounds))
    except RuntimeError:  # what the kernel does not turn into a spline is known by its triangles
        return None
    if spline.IsUPeriodic():
        spline.SetUNotPeriodic()
    if spline.IsVPeriodic():
        spline.SetVNotPeriodic()
    return spline


def _restricted(surface: Any, bounds: Sequence[float]) -> Any:
    """A surface over a rectangle of its parameters. A whole turn is not cut: round-off in its bounds would leave a gap."""
    from OCP.Geom import Geom_RectangularTrimmedSurface

    low_u, high_u, low_v, high_v = surface.Bounds()
    u0, u1, v0, v1 = bounds
    if not surface.IsUPeriodic():
        u0, u1 = max(u0, low_u), min(u1, high_u)
    if not surface.IsVPeriodic():  # round-off beyond the pole of a sphere is no place on it
        v0, v1 = max(v0, low_v), min(v1, high_v)
    whole_u = surface.IsUPeriodic() and abs(u1 - u0 - surface.UPeriod()) < _ROUND_OFF * surface.UPeriod()
    whole_v = surface.IsVPeriodic() and abs(v1 - v0 - surface.VPeriod()) < _ROUND_OFF * surface.VPeriod()
    if whole_u and whole_v:
        return surface
    if whole_u or whole_v:
        return Geom_RectangularTrimmedSurface(surface, *((v0, v1) if whole_u else (u0, u1)), not whole_u, True)
    return Geom_RectangularTrimmedSurface(surface, u0, u1, v0, v1, True, True)


def _runs_along(face: Any, surface: Any, bounds: Sequence[float]) -> bool:
    """Whether every edge of a face lies on one side of a rectangle of its parameters, to a nanometre in space."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.gp import gp_Pnt, gp_Vec

    point, by_u, by_v = gp_Pnt(), gp_Vec(), gp_Vec()
    for edge in _edges(face):
        curve = BRepAdaptor_Curve2d(edge, face)
        off = np.zeros(4)
        for t in np.linspace(curve.FirstParameter(), curve.LastParameter(), _PLACES):
            at = curve.Value(float(t))
            surface.D1(at.X(), at.Y(), point, by_u, by_v)
            u, v = by_u.Magnitude(), by_v.Magnitude()
            u0, u1, v0, v1 = bounds
            off = np.maximum(off, np.abs([(at.X() - u0) * u, (at.X() - u1) * u, (at.Y() - v0) * v, (at.Y() - v1) * v]))
        if off.min() > _ON_BORDER_MM:
            return False
    return True


def _poles(spline: Any) -> Array:
    """Poles (a, b, 4) in homogeneous form w x, w y, w z, w."""
    count_u, count_v = spline.NbUPoles(), spline.NbVPoles()
    result = np.empty((count_u, count_v, 4))
    for i in range(count_u):
        for j in range(count_v):
            pole, weight = spline.Pole(i + 1, j + 1), spline.Weight(i + 1, j + 1)
            result[i, j] = pole.X() * weight, pole.Y() * weight, pole.Z() * weight, weight
    return result


def _knots(spline: Any) -> tuple[Array, Array]:
    numbers_u, numbers_v = range(1, spline.NbUKnots() + 1), range(1, spline.NbVKnots() + 1)
    u = np.repeat([float(spline.UKnot(i)) for i in numbers_u], [int(spline.UMultiplicity(i)) for i in numbers_u])
    v = np.repeat([float(spline.VKnot(i)) for i in numbers_v], [int(spline.VMultiplicity(i)) for i in numbers_v])
    return u, v


def _triangles(faces: Sequence[Any], shape: Any, chord_mm: float) -> tuple[Array, NDArray[np.int64], float]:
    """Triangles (t, 3, 3) of all faces, outsides out, the face of each (t,), and a bound of how far they lie off the faces."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh

    BRepMesh_IncrementalMesh(shape, chord_mm, False, _TURN_RAD, False)
    found, owners, far = [], [], 0.0
    for number, face in enumerate(faces):
        corners, uv = _mesh_of(face, number)
        far = max(far, _farthest(face, corners, uv), _farthest_of_edges(face))
        found.append(corners[:, ::-1] if _is_reversed(face) else corners)
        owners.append(np.full(len(corners), number))
    return np.concatenate(found), np.concatenate(owners), _SAFETY * far


def _mesh_of(face: Any, number: int) -> tuple[Array, Array]:
    """The triangles (t, 3, 3) of a face, and the parameters of their corners (t, 3, 2)."""
    from OCP.BRep import BRep_Tool
    from OCP.TopLoc import TopLoc_Location

    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, location)
    if mesh is None or not mesh.HasUVNodes():
        raise CadError(f"face {number + 1} cannot be cut into triangles; export the part again")
    move = location.Transformation()
    nodes = [mesh.Node(i).Transformed(move) for i in range(1, mesh.NbNodes() + 1)]
    places = np.array([(node.X(), node.Y(), node.Z()) for node in nodes])
    uv = np.array([(node.X(), node.Y()) for node in (mesh.UVNode(i) for i in range(1, mesh.NbNodes() + 1))])
    numbers = np.array([mesh.Triangle(i).Get()[-3:] for i in range(1, mesh.NbTriangles() + 1)]) - 1
    return places[numbers], uv[numbers]


def _farthest(face: Any, corners: Array, uv: Array) -> float:
    """The farthest that the middles of triangles and of their sides lie from the face, at the middle of their parameters."""
    from OCP.BRep import BRep_Tool

    surface = BRep_Tool.Surface_s(face)
    far = 0.0
    for weights in ((1 / 3, 1 / 3, 1 / 3), (0.5, 0.5, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5)):
        places, at = np.einsum("k,tkd->td", weights, corners), np.einsum("k,tkd->td", weights, uv)
        exact = np.array([(p.X(), p.Y(), p.Z()) for p in (surface.Value(float(u), float(v)) for u, v in at)])
        far = max(far, float(np.linalg.norm(exact - places, axis=1).max()))
    return far


def _farthest_of_edges(face: Any) -> float:
    """The farthest that the edges of a face lie from the sides of triangles along them, at the middles of their parameters."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.TopLoc import TopLoc_Location

    location, far = TopLoc_Location(), 0.0
    mesh = BRep_Tool.Triangulation_s(face, location)
    for edge in _edges(face):
        line = BRep_Tool.PolygonOnTriangulation_s(edge, mesh, location)
        if BRep_Tool.Degenerated_s(edge) or line is None or not line.HasParameters():
            continue
        curve = BRepAdaptor_Curve(edge)
        t = np.array([line.Parameter(i) for i in range(1, line.NbNodes() + 1)])
        at, middle = ([curve.Value(float(each)) for each in values] for values in (t, (t[1:] + t[:-1]) / 2))
        places, exact = (np.array([(p.X(), p.Y(), p.Z()) for p in each]) for each in (at, middle))
        far = max(far, float(np.linalg.norm((places[1:] + places[:-1]) / 2 - exact, axis=1).max(initial=0.0)))
    return far
