"""The child of occt_process.py: it reads STEP and IGES by Open CASCADE, and cuts what has faces.

This and occt_faces.py are the only files that import OCP, when it serves. Lengths are mm whatever the unit of the file, and assemblies
are placed: the kernel sees to both. Poles and knots are read one by one, because the array classes have other names in OCCT 7 than in 8.
"""

import importlib.util
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.cad.occt_faces import faces_of
from drivers.cad.occt_process import CadCurve, Kind
from drivers.errors import CadError
from drivers.helper_process import Answer, answer_questions

Array = NDArray[np.float64]

_IN_THE_PLANE = 1e-6  # mm: a face no farther from the plane lies in it
_PARALLEL = 1e-9
_FIRST_POINTS = 33  # of a section through a free-form face; more come where the curve between them leaves the face
_GOOD_MM = 1e-8
_MOST_POINTS, _ROUNDS, _NEWTON_STEPS = 20_000, 12, 8
_DEGREE = 5
_ENDLESS_MM = 1e9
_ADJOINS, _LEAST_GAP_MM = 1e-5, 1e-6  # of the size: borders of faces that are nearer to each other are one edge, as CAD systems promise it


def serve() -> None:
    """Run as the child."""
    answer_questions(_load)


def _load() -> tuple[dict[str, Any], Answer | None]:
    try:
        from OCP.Message import Message, Message_PrinterOStream
    except Exception as error:  # whatever keeps it from being loaded is told to the operator
        return {"error": " ".join(str(error).split()), "installed": importlib.util.find_spec("OCP") is not None}, None
    Message.DefaultMessenger_s().RemovePrinters(Message_PrinterOStream.get_type_descriptor_s())
    return {}, _answer


def _answer(request: dict[str, Any], arrays: list[NDArray[Any]]) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    del arrays
    try:
        shape = _shape(request["path"], request["do"])
        if "chord_mm" in request:
            return _faces(shape, request["chord_mm"], request["do"])
        return _curves(shape, np.array(request["origin_mm"]), np.array(request["normal"]))
    except CadError as error:
        return {"error": str(error)}, []
    except Exception as error:  # the kernel raises what it likes on a bad file: one sentence comes of it
        told = " ".join(str(error).split())[:120] or type(error).__name__
        return {"error": f"Open CASCADE cannot use it ({told}); export the file again, or the profile alone as DXF or IGES"}, []


def _shape(path: str, kind: Kind) -> Any:
    """All that a file shows, as one shape. Its entities may not be asked for after a failed read: that crashes."""
    from OCP.IFSelect import IFSelect_ReturnStatus

    if kind == "step":
        from OCP.STEPControl import STEPControl_Reader as Reader
    else:
        from OCP.IGESControl import IGESControl_Reader as Reader
    reader = Reader()
    if reader.ReadFile(path) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise CadError(f"is no {kind.upper()} file that can be read; export it again")
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape is None or shape.IsNull():
        raise CadError("holds no shape; is it cut off, or does it only point to other files?")
    return shape


def _curves(shape: Any, origin: Array, normal: Array) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    """The loose edges of a shape, or where it has none, the section of its faces."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE

    loose = list(_parts(shape, TopAbs_EDGE, TopAbs_FACE))
    faces = list(_parts(shape, TopAbs_FACE))
    if not loose and not faces:
        raise CadError("holds no curve and no face; does it only point to other files, or only tell of a product?")
    left_out: list[str] = []
    residual = 0.0
    if loose:
        made = [_spline(edge, left_out) for edge in loose]
    else:
        made, residual = _section(shape, faces, origin, normal / np.linalg.norm(normal), left_out)
    curves = [curve for curve in made if curve is not None]
    arrays = [array for curve in curves for array in (curve.poles, curve.knots)]
    told = {
        "degrees": [curve.degree for curve in curves],
        "faces": len(faces),
        "cut": not loose,
        "residual_mm": residual,
        "left_out": left_out,
    }
    return told, arrays


def _faces(shape: Any, chord_mm: float, kind: Kind) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    """All faces of a shape. Those of IGES know nothing of each other: what adjoins is sewn together, or the mesh would gape there."""
    from OCP.TopAbs import TopAbs_FACE

    whole = _sewn(shape) if kind == "iges" else shape
    return faces_of([_cast(face, "Face") for face in _parts(whole, TopAbs_FACE)], whole, chord_mm)


def _sewn(shape: Any) -> Any:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing

    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box)
    sewing = BRepBuilderAPI_Sewing(max(_ADJOINS * float(box.SquareExtent()) ** 0.5, _LEAST_GAP_MM))
    sewing.Add(shape)
    sewing.Perform()
    return sewing.SewedShape()


def _parts(shape: Any, kind: Any, *but_in: Any) -> Iterator[Any]:
    """The parts of a kind, but not those within others."""
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(shape, kind, *but_in)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _cast(shape: Any, kind: str) -> Any:
    """A shape as an edge or a face: the function has an underscore less since OCCT 8."""
    from OCP.TopoDS import TopoDS

    return (getattr(TopoDS, kind, None) or getattr(TopoDS, f"{kind}_s"))(shape)


def _spline(shape: Any, left_out: list[str]) -> CadCurve | None:
    """An edge as a rational spline in its own direction; None, and a word for it, where it has no exact one."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.Geom import Geom_TrimmedCurve
    from OCP.GeomAbs import GeomAbs_OffsetCurve, GeomAbs_OtherCurve
    from OCP.GeomConvert import GeomConvert
    from OCP.TopAbs import TopAbs_REVERSED

    edge = _cast(shape, "Edge")
    if BRep_Tool.Degenerated_s(edge):
        return None
    adaptor = BRepAdaptor_Curve(edge)
    first, last = adaptor.FirstParameter(), adaptor.LastParameter()
    if not adaptor.Is3DCurve() or adaptor.GetType() in (GeomAbs_OffsetCurve, GeomAbs_OtherCurve) or not last - first < _ENDLESS_MM:
        left_out.append("endless line" if adaptor.Is3DCurve() and not last - first < _ENDLESS_MM else "curve without an exact spline")
        return None
    trimmed = Geom_TrimmedCurve(adaptor.Curve().Curve(), first, last).Transformed(adaptor.Trsf())
    spline = GeomConvert.CurveToBSplineCurve_s(trimmed)
    if spline.IsPeriodic():
        spline.SetNotPeriodic()
    weights = np.array([spline.Weight(i) for i in range(1, spline.NbPoles() + 1)])
    points = np.array([(p.X(), p.Y(), p.Z()) for p in (spline.Pole(i) for i in range(1, spline.NbPoles() + 1))])
    numbers = range(1, spline.NbKnots() + 1)
    knots = np.repeat([spline.Knot(i) for i in numbers], [spline.Multiplicity(i) for i in numbers]).astype(np.float64)
    poles = np.column_stack([points * weights[:, None], weights])
    if edge.Orientation() == TopAbs_REVERSED:
        poles, knots = poles[::-1].copy(), -knots[::-1]
    return CadCurve(spline.Degree(), poles, knots)


def _section(shape: Any, faces: Sequence[Any], origin: Array, normal: Array, left_out: list[str]) -> tuple[list[CadCurve | None], float]:
    """The section of a shape by a plane, exact where faces are planes, cylinders and cones, and how far the rest leaves its faces."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Section
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS_Face

    _refuse_plane_in_face(faces, origin, normal)
    cut = BRepAlgoAPI_Section(shape, gp_Pln(gp_Pnt(*origin.tolist()), gp_Dir(*normal.tolist())), False)
    cut.Approximation(False)
    cut.Build()
    if not cut.IsDone():
        raise CadError("Open CASCADE cannot cut it there; move the section a little, or export the part again")
    made: list[CadCurve | None] = []
    residual = 0.0
    for edge in _parts(cut.Shape(), TopAbs_EDGE):
        curve = _spline(edge, left_out)
        face = TopoDS_Face()
        if curve is not None and _is_sampled(edge) and cut.HasAncestorFaceOn1(edge, face):
            curve, far = _on_face(curve, face, origin, normal)
            residual = max(residual, far)
        made.append(curve)
    if not made:
        low, high = _reach(shape, normal)
        raise CadError(
            f"the section at {origin @ normal:.6g} mm along the normal ({', '.join(f'{value:.4g}' for value in normal)}) does not meet "
            f"the part, which reaches from {low:.6g} to {high:.6g} mm there; expected a section of the part"
        )
    return made, residual


def _refuse_plane_in_face(faces: Iterable[Any], origin: Array, normal: Array) -> None:
    """Where the plane lies in a face there is no section, but an area."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_Plane

    for face in faces:
        surface = BRepAdaptor_Surface(_cast(face, "Face"))
        if surface.GetType() != GeomAbs_Plane:
            continue
        axis, place = surface.Plane().Axis().Direction(), surface.Plane().Location()
        own = np.array([axis.X(), axis.Y(), axis.Z()])
        apart = abs((np.array([place.X(), place.Y(), place.Z()]) - origin) @ normal)
        if np.linalg.norm(np.cross(own, normal)) < _PARALLEL and apart < _IN_THE_PLANE:
            raise CadError("the plane of the section lies in a face of the part; move it by 0.01 mm")


def _reach(shape: Any, normal: Array) -> tuple[float, float]:
    """The heights between which a box about the shape lies."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box)
    low, high = ([corner.X(), corner.Y(), corner.Z()] for corner in (box.CornerMin(), box.CornerMax()))
    heights = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T @ normal
    return float(heights.min()), float(heights.max())


def _is_sampled(edge: Any) -> bool:
    """Whether a curve of a section is a spline through points, and not a line or a conic in closed form."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GeomAbs import GeomAbs_BezierCurve, GeomAbs_BSplineCurve

    return BRepAdaptor_Curve(_cast(edge, "Edge")).GetType() in (GeomAbs_BezierCurve, GeomAbs_BSplineCurve)


def _on_face(rough: CadCurve, face: Any, origin: Array, normal: Array) -> tuple[CadCurve, float]:
    """A section through a free-form face anew: points on face and plane by Newton's method, a quintic through them.

    It begins and ends in the direction of the section, so that it goes on smoothly on the next face. Points are added where it leaves
    the face between them. Returns also how far it does so in the end, at most.
    """
    from scipy.interpolate import BSpline, make_interp_spline

    surface = _OnBoth(face, origin, normal)
    along = BSpline(rough.knots, rough.poles, rough.degree)
    at = np.linspace(rough.knots[0], rough.knots[-1], 8 * len(rough.poles))
    drawn = along(at)
    points = drawn[:, :3] / drawn[:, 3:]
    station = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    wanted = np.linspace(0.0, station[-1], _FIRST_POINTS)
    points = surface.feet(np.column_stack([np.interp(wanted, station, points[:, i]) for i in range(3)]))
    for _ in range(_ROUNDS):
        station = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        spline = make_interp_spline(station, points, k=_DEGREE)
        ends = [(spline(u, 1), spline(u, 2)) for u in station[[0, -1]]]
        held: Any = [[(1, surface.along(point, first)), (2, second)] for point, (first, second) in zip(points[[0, -1]], ends, strict=True)]
        spline = make_interp_spline(station, points, k=_DEGREE, bc_type=(held[0], held[1]))
        between = np.asarray(spline((station[1:] + station[:-1]) / 2))
        feet = surface.feet(between)
        apart = np.linalg.norm(feet - between, axis=1)
        bad = apart > _GOOD_MM
        if not bad.any() or len(points) > _MOST_POINTS:
            break
        points = np.insert(points, np.flatnonzero(bad) + 1, feet[bad], axis=0)
    poles = np.column_stack([spline.c, np.ones(len(spline.c))])
    return CadCurve(_DEGREE, poles, np.asarray(spline.t)), float(apart.max())


class _OnBoth:
    """Brings points onto a face and a plane at once, along the section."""

    def __init__(self, face: Any, origin: Array, normal: Array) -> None:
        from OCP.BRep import BRep_Tool
        from OCP.gp import gp_Pnt, gp_Vec
        from OCP.ShapeAnalysis import ShapeAnalysis_Surface

        self._surface = BRep_Tool.Surface_s(_cast(face, "Face"))
        self._analysis = ShapeAnalysis_Surface(self._surface)
        self._origin, self._normal = origin, normal
        self._point, self._by_u, self._by_v = gp_Pnt(), gp_Vec(), gp_Vec()

    def feet(self, points: Array) -> Array:
        """The points (m, 3) of face and plane that are nearest to some points (m, 3) near both."""
        return np.array([self._foot(point) for point in points])

    def along(self, point: Array, first: Array) -> Array:
        """A derivative (3,) at a point of both, as long as `first` and along the section, where the face shows its direction."""
        _, by_u, by_v = self._tangents(self._parameters(point))
        along = np.cross(self._normal, np.cross(by_u, by_v))
        size = float(np.linalg.norm(along))
        if size < _PARALLEL * float(np.linalg.norm(by_u) * np.linalg.norm(by_v)):
            return first
        return np.asarray(along / size * np.linalg.norm(first) * (1.0 if along @ first > 0 else -1.0))

    def _parameters(self, near: Array) -> Array:
        from OCP.gp import gp_Pnt

        found = self._analysis.ValueOfUV(gp_Pnt(*near.tolist()), 1e-9)
        return np.array([found.X(), found.Y()])

    def _foot(self, near: Array) -> Array:
        parameter = self._parameters(near)
        for _ in range(_NEWTON_STEPS):
            at, by_u, by_v = self._tangents(parameter)
            along = np.cross(self._normal, np.cross(by_u, by_v))
            rows = np.stack([self._normal, along / (np.linalg.norm(along) or 1.0)])
            gap = np.array([(at - self._origin) @ rows[0], (at - near) @ rows[1]])
            step = np.linalg.lstsq(rows @ np.column_stack([by_u, by_v]), -gap, rcond=None)[0]
            parameter = parameter + step
            if np.abs(gap).max() < 1e-12:
                break
        return self._tangents(parameter)[0]

    def _tangents(self, parameter: Array) -> tuple[Array, Array, Array]:
        self._surface.D1(float(parameter[0]), float(parameter[1]), self._point, self._by_u, self._by_v)
        point, by_u, by_v = (np.array([v.X(), v.Y(), v.Z()]) for v in (self._point, self._by_u, self._by_v))
        return point, by_u, by_v
