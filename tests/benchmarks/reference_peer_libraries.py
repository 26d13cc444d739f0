"""How other libraries find deviations, fits and minimum zones of the reference set: each by its own means, at its best.

Open CASCADE takes the STEP file, scipy the knots, engeom and Open3D samples of the curve, as many as are stated. What a library has no
way to find it is not asked for.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.optimize import least_squares, minimize
from scipy.spatial import KDTree

from cmmlink.reference import KnownPose, ReferenceCase
from inspection import NurbsCurve, RigidTransform, deviations, discretize

Array = NDArray[np.float64]
Distances = Callable[[Array], Array]

SAMPLES = 20_000
TURNED_RAD, SHIFTED = np.radians(1.0), 0.01


@dataclass(frozen=True)
class Given:
    """A case in mm, as every library gets it."""

    case: ReferenceCase
    folder: Path

    @property
    def scale(self) -> float:
        return self.case.mm_per_unit

    @property
    def points_mm(self) -> Array:
        return self.case.points * self.scale

    @property
    def radius_mm(self) -> float:
        return self.case.tip_radius * self.scale

    @property
    def middle_mm(self) -> float:
        return sum(self.case.limits_mm) / 2

    @property
    def curve(self) -> "RationalSpline":
        nominal = self.case.nominal
        weights = np.ones(len(nominal.control_points)) if nominal.weights is None else nominal.weights
        return RationalSpline(nominal.degree, nominal.knots, nominal.control_points * self.scale, weights)

    @property
    def left_is_material(self) -> bool:
        return self.case.nominal.material == "left"

    def pose(self, known: KnownPose) -> RigidTransform:
        return RigidTransform(np.radians(known.rotation_deg), np.array(known.translation) * self.scale)

    def start(self) -> RigidTransform:
        """The known pose, disturbed: turned about the middle of the points, and shifted."""
        assert self.case.truth.pose is not None
        known = self.pose(self.case.truth.pose)
        placed = known.apply(self.points_mm)
        middle, size = placed.mean(axis=0), float(np.ptp(placed, axis=0).max())
        turn = RigidTransform(TURNED_RAD, np.zeros(2))
        return RigidTransform(TURNED_RAD, middle - turn.apply(middle[None])[0] + SHIFTED * size * np.array([0.6, -0.8])).after(known)


class RationalSpline:
    """The curve by scipy's B-splines of homogeneous coordinates."""

    def __init__(self, degree: int, knots: Array, control_mm: Array, weights: Array) -> None:
        rows = np.column_stack([control_mm * weights[:, None], weights])
        self._spline, self._degree = BSpline(knots, rows, degree), degree
        self.low, self.high = float(knots[degree]), float(knots[-degree - 1])
        self.breaks = np.unique(knots[(knots >= self.low) & (knots <= self.high)])

    def at(self, u: Array) -> tuple[Array, Array, Array]:
        """Points and two derivatives (m, 2)."""
        a, b, c = (self._spline(u, k) if k <= self._degree else np.zeros((len(u), 3)) for k in range(3))
        w = a[:, 2:]
        point = a[:, :2] / w
        first = (b[:, :2] - b[:, 2:] * point) / w
        return point, first, (c[:, :2] - 2 * b[:, 2:] * first - c[:, 2:] * point) / w

    def samples(self) -> tuple[Array, Array]:
        """Parameters and points, every break among them: corners are vertices."""
        u = np.union1d(np.linspace(self.low, self.high, SAMPLES), self.breaks)
        return u, self.at(u)[0]


def signed(off: Array, tangent: Array, given: Given) -> Array:
    """Distances (m,), positive out of material, of points that lie `off` their feet (m, 2)."""
    left = tangent[:, 0] * off[:, 1] - tangent[:, 1] * off[:, 0] > 0
    return np.asarray(np.hypot(*off.T) * np.where(left == given.left_is_material, -1.0, 1.0))


# --- distances -------------------------------------------------------------------------------------------------------------


def ours_distances(given: Given) -> Distances:
    nominal = given.case.nominal
    weights = None if nominal.weights is None else nominal.weights.copy()
    curve = NurbsCurve(nominal.degree, nominal.control_points * given.scale, nominal.knots.copy(), weights, closed=nominal.closed)
    profile = discretize(curve, material=nominal.material)
    return lambda points: deviations(points, profile).deviation_mm


def scipy_distances(given: Given) -> Distances:
    """KD-tree of the samples, then Newton's method on the curve, from the nearest sample and its neighbours, kept between these."""
    curve = given.curve
    u, samples = curve.samples()
    tree = KDTree(samples)

    def distances(points: Array) -> Array:
        near = tree.query(points)[1]
        best, found = np.full(len(points), np.inf), np.zeros(len(points))
        for low, high in ((near - 1, near), (near, near + 1)):
            inside = (low >= 0) & (high < len(u))
            lower, upper = u[np.clip(low, 0, None)], u[np.clip(high, None, len(u) - 1)]
            at = u[near].copy()
            for _ in range(6):
                place, first, second = curve.at(at)
                off = place - points
                slope = (first * first).sum(axis=1) + (off * second).sum(axis=1)
                at = np.clip(at - (off * first).sum(axis=1) / np.where(slope > 0, slope, np.inf), lower, upper)
            away = np.hypot(*(curve.at(at)[0] - points).T)
            better = inside & (away < best)
            best, found = np.where(better, away, best), np.where(better, at, found)
        place, first, _ = curve.at(found)
        return signed(points - place, first, given)

    return distances


def occt_distances(given: Given) -> Distances:
    """Its exact projection on the curves of the STEP file, and their breaks, where a corner may be the nearest place."""
    module: dict[str, Any] = {
        name: importlib.import_module(f"OCP.{name}") for name in ("STEPControl", "TopExp", "TopAbs", "TopoDS", "BRep", "GeomAPI", "gp")
    }
    reader = module["STEPControl"].STEPControl_Reader()
    reader.ReadFile(str(given.folder / "nominal.step"))
    reader.TransferRoots()
    explorer = module["TopExp"].TopExp_Explorer(reader.OneShape(), module["TopAbs"].TopAbs_ShapeEnum.TopAbs_EDGE)
    edges = getattr(module["TopoDS"], "TopoDS", module["TopoDS"])
    edge = getattr(edges, "Edge_s", None) or edges.Edge  # as it is called in versions before OCCT 8, and since
    curve = module["BRep"].BRep_Tool.Curve_s(edge(explorer.Current()), 0.0, 0.0)
    gp = module["gp"]

    def at(u: float) -> tuple[Array, Array]:
        point, first = gp.gp_Pnt(), gp.gp_Vec()
        curve.D1(u, point, first)
        return np.array([point.X(), point.Y()]), np.array([first.X(), first.Y()])

    breaks = [float(u) for u in given.curve.breaks]

    def distances(points: Array) -> Array:
        feet = []
        for x, y in points.tolist():
            projected = module["GeomAPI"].GeomAPI_ProjectPointOnCurve(gp.gp_Pnt(x, y, 0.0), curve)
            candidates = breaks + ([projected.LowerDistanceParameter()] if projected.NbPoints() else [])
            feet.append(min((at(u) for u in candidates), key=lambda foot: float(np.hypot(*(foot[0] - (x, y))))))
        return signed(points - np.array([foot for foot, _ in feet]), np.array([first for _, first in feet]), given)

    return distances


def engeom_distances(given: Given) -> Distances:
    geom2 = importlib.import_module("engeom.geom2")
    polygon = engeom_polygon(given)

    def distances(points: Array) -> Array:
        stations = [polygon.at_closest_to_point(geom2.Point2(x, y)) for x, y in points.tolist()]
        feet = np.array([(one.point.x, one.point.y) for one in stations])
        tangent = np.array([(one.direction.x, one.direction.y) for one in stations])
        return signed(points - feet, tangent, given)

    return distances


def engeom_polygon(given: Given) -> Any:
    samples = given.curve.samples()[1]
    closed = given.case.nominal.closed
    distinct = np.concatenate([[True], np.hypot(*np.diff(samples, axis=0).T) > 0])
    return importlib.import_module("engeom.geom2").Curve2(samples[distinct], tol=1e-12, force_closed=closed)


def open3d_distances(given: Given) -> Distances:
    """Closest points of its ray-casting scene, which counts in 32 bits, on a wall over the polygon; the side by the wall's normals."""
    o3d = importlib.import_module("open3d")
    samples = given.curve.samples()[1]
    middle, half = (samples.min(axis=0) + samples.max(axis=0)) / 2, float(np.ptp(samples, axis=0).max()) / 100
    n = len(samples)
    corners = np.vstack([np.column_stack([samples - middle, np.full(n, z)]) for z in (-half, half)]).astype(np.float32)
    i = np.arange(n - 1)
    triangles = np.vstack([np.column_stack([i, i + 1, i + n]), np.column_stack([i + 1, i + 1 + n, i + n])]).astype(np.uint32)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(corners), o3d.core.Tensor(triangles))

    def distances(points: Array) -> Array:
        asked = np.column_stack([points - middle, np.zeros(len(points))])
        answer = scene.compute_closest_points(o3d.core.Tensor(asked.astype(np.float32)))
        feet = answer["points"].numpy().astype(float)[:, :2]
        normal = answer["primitive_normals"].numpy().astype(float)[:, :2]  # to the right of the curve, as the triangles turn
        return signed(points - middle - feet, np.column_stack([-normal[:, 1], normal[:, 0]]), given)

    return distances


# --- fits ------------------------------------------------------------------------------------------------------------------


def moved(start: RigidTransform, middle: Array, x: Array) -> RigidTransform:
    turn = RigidTransform(float(x[2]), np.zeros(2))
    return RigidTransform(float(x[2]), middle - turn.apply(middle[None])[0] + x[:2]).after(start)


def scipy_errors(
    given: Given, distances: Distances, start: RigidTransform
) -> tuple[Callable[[Array], Array], Callable[[Array], RigidTransform]]:
    """Deviations from the zone's middle after a small motion x of the points, and the pose that it makes."""
    middle = start.apply(given.points_mm).mean(axis=0)
    size = float(np.ptp(given.points_mm, axis=0).max())
    scale = np.array([1.0, 1.0, 1.0 / size])

    def pose(x: Array) -> RigidTransform:
        return moved(start, middle, x * scale)

    return lambda x: distances(pose(x).apply(given.points_mm)) - given.radius_mm - given.middle_mm, pose


def scipy_fit(given: Given, distances: Distances) -> RigidTransform:
    errors, pose = scipy_errors(given, distances, given.start())
    found = least_squares(errors, np.zeros(3), method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15, diff_step=np.full(3, 1e-7))
    return pose(found.x)


def scipy_largest(given: Given, distances: Distances) -> float:
    """The smallest largest |deviation - middle| over placements, by sequential quadratic programming from the best fit."""
    errors, _ = scipy_errors(given, distances, scipy_fit(given, distances))
    unit = float(np.abs(errors(np.zeros(3))).max())
    limits: list[Any] = [{"type": "ineq", "fun": lambda x, side=side: x[3] - side * errors(x[:3] * unit) / unit} for side in (1.0, -1.0)]
    begin, options, least = np.array([0.0, 0.0, 0.0, 1.0]), {"ftol": 1e-14, "maxiter": 200}, cast(Any, minimize)
    found = least(lambda x: float(x[3]), begin, method="SLSQP", constraints=limits, options=options)
    return float(np.abs(errors(found.x[:3] * unit)).max())


def engeom_fit(given: Given, _: Distances) -> RigidTransform:
    align2, geom2 = importlib.import_module("engeom.align2"), importlib.import_module("engeom.geom2")
    start = given.start()
    placed = start.apply(given.points_mm)
    params = align2.AlignParams2(center=geom2.Point2(*placed.mean(axis=0).tolist()))
    found = align2.points_to_curve(placed, engeom_polygon(given), params, ignore_off_target=True, refinement_steps=0)
    return planar(found.alignment.full_transform.as_numpy()).after(start)


def open3d_fit(given: Given, _: Distances) -> RigidTransform:
    """Its ICP from point to plane, onto the samples with the normals of the curve."""
    o3d = importlib.import_module("open3d")
    u, samples = given.curve.samples()
    tangent = given.curve.at(u)[1]
    normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.hypot(*tangent.T)[:, None]
    start = given.start()
    middle = start.apply(given.points_mm).mean(axis=0)
    source, target = o3d.geometry.PointCloud(), o3d.geometry.PointCloud()
    source.points = o3d.utility.Vector3dVector(np.column_stack([start.apply(given.points_mm) - middle, np.zeros(len(given.points_mm))]))
    target.points = o3d.utility.Vector3dVector(np.column_stack([samples - middle, np.zeros(len(samples))]))
    target.normals = o3d.utility.Vector3dVector(np.column_stack([normal, np.zeros(len(samples))]))
    registration = o3d.pipelines.registration
    found = registration.registration_icp(
        source,
        target,
        float(np.ptp(samples, axis=0).max()) / 10,
        np.eye(4),
        registration.TransformationEstimationPointToPlane(),
        registration.ICPConvergenceCriteria(1e-16, 1e-16, 500),
    )
    turned = planar(found.transformation[np.ix_([0, 1, 3], [0, 1, 3])])
    shift = middle + turned.translation_mm - RigidTransform(turned.rotation_rad, np.zeros(2)).apply(middle[None])[0]
    return RigidTransform(turned.rotation_rad, shift).after(start)


def planar(matrix: Array) -> RigidTransform:
    return RigidTransform(float(np.arctan2(matrix[1, 0], matrix[0, 0])), np.array(matrix[:2, 2], dtype=np.float64))


@dataclass(frozen=True)
class Library:
    """What a library can: the ways to find distances and a fit, and the smallest largest deviation, None where there is none.

    offset : whether its fit takes the radius of a ball and the middle of a zone into account
    """

    package: str
    how: str
    distances: Callable[[Given], Distances]
    fit: Callable[[Given, Distances], RigidTransform] | None = None
    largest: Callable[[Given, Distances], float] | None = None
    offset: bool = False


LIBRARIES: Mapping[str, Library] = {
    "scipy": Library(
        "scipy",
        f"BSpline of homogeneous coordinates; KD-tree of {SAMPLES:,} samples and Newton's method on the curve; least_squares; SLSQP",
        scipy_distances,
        scipy_fit,
        scipy_largest,
        offset=True,
    ),
    "Open CASCADE": Library(
        "cadquery-ocp-novtk", "the STEP file; GeomAPI_ProjectPointOnCurve, and the ends of the curve's spans beside it", occt_distances
    ),
    "engeom": Library("engeom", f"Curve2 of {SAMPLES:,} samples; points_to_curve without robust rounds", engeom_distances, engeom_fit),
    "Open3D": Library(
        "open3d-cpu",
        f"a wall over the polygon of {SAMPLES:,} samples, RaycastingScene (32 bits); registration_icp from point to plane",
        open3d_distances,
        open3d_fit,
    ),
}
