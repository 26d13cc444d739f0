"""What Open CASCADE finds closest on faces, in a process of its own: `python -m tests.inspection.surface.occt_surfaces FILE` prints JSON.

In: an .npz of `degree`, `knots_u`, `knots_v`, `control_points`, `weights`, `points`. Out: the distance of each point from the inside of the
face, by its extrema, and from the whole face with its border (of the first `whole` points).
"""

import json
import sys
from itertools import groupby
from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.Extrema import Extrema_ExtAlgo
from OCP.Geom import Geom_BSplineSurface
from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
from OCP.gp import gp_Pnt

try:
    from OCP.collections import Array1_double, Array1_int, Array2_double, Array2_gp_Pnt
except ImportError:  # as they were called before OCCT 8
    from OCP.TColgp import TColgp_Array2OfPnt as Array2_gp_Pnt
    from OCP.TColStd import TColStd_Array1OfInteger as Array1_int
    from OCP.TColStd import TColStd_Array1OfReal as Array1_double
    from OCP.TColStd import TColStd_Array2OfReal as Array2_double


def _knots(knots: Any) -> tuple[Any, Any]:
    grouped = [(value, len(list(same))) for value, same in groupby(knots.tolist())]
    values, counts = Array1_double(1, len(grouped)), Array1_int(1, len(grouped))
    for place, (value, count) in enumerate(grouped, 1):
        values.SetValue(place, value)
        counts.SetValue(place, count)
    return values, counts


def surface_of(face: Any) -> Any:
    points, weights = face["control_points"], face["weights"]
    poles, given = Array2_gp_Pnt(1, len(points), 1, len(points[0])), Array2_double(1, len(points), 1, len(points[0]))
    for i, row in enumerate(points):
        for j, point in enumerate(row):
            poles.SetValue(i + 1, j + 1, gp_Pnt(*point.tolist()))
            given.SetValue(i + 1, j + 1, float(weights[i, j]))
    (knots_u, counts_u), (knots_v, counts_v) = _knots(face["knots_u"]), _knots(face["knots_v"])
    degree = face["degree"].tolist()
    return Geom_BSplineSurface(poles, given, knots_u, knots_v, counts_u, counts_v, degree[0], degree[1])


def found(face: Any) -> dict[str, list[float]]:
    surface = surface_of(face)
    inside = GeomAPI_ProjectPointOnSurf()
    inside.Init(surface, *surface.Bounds(), Extrema_ExtAlgo.Extrema_ExtAlgo_Tree)
    inner = []
    for point in face["points"]:
        inside.Perform(gp_Pnt(*point.tolist()))
        inner.append(inside.LowerDistance() if inside.NbPoints() else float("inf"))
    shape = BRepBuilderAPI_MakeFace(surface, 1e-7).Face()
    whole = []
    for point in face["points"][: int(face["whole"])]:
        to = BRepExtrema_DistShapeShape(BRepBuilderAPI_MakeVertex(gp_Pnt(*point.tolist())).Vertex(), shape)
        whole.append(to.Value())
    return {"inside": inner, "whole": whole}


if __name__ == "__main__":
    print(json.dumps([found(np.load(path)) for path in sys.argv[1:]]))
