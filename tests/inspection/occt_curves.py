"""What Open CASCADE finds of curves, in a process of its own: `python -m tests.inspection.occt_curves` reads and writes JSON.

In: a list of {degree, knots, control_points, weights, at}. Out: of each the length, and curvature and length to each parameter.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from OCP.GCPnts import GCPnts_AbscissaPoint
from OCP.Geom import Geom_BSplineCurve
from OCP.GeomAdaptor import GeomAdaptor_Curve
from OCP.GeomLProp import GeomLProp_CLProps
from OCP.gp import gp_Pnt

try:
    from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_int
except ImportError:  # as they were called before OCCT 8
    from OCP.TColgp import TColgp_Array1OfPnt as Array1_gp_Pnt
    from OCP.TColStd import TColStd_Array1OfInteger as Array1_int
    from OCP.TColStd import TColStd_Array1OfReal as Array1_double

TOLERANCE = 1e-11  # of a length, mm; what it takes where none is said differs between its versions
RESOLUTION = 1e-12  # below it a derivative counts as none


def _array(kind: Any, values: Sequence[Any]) -> Any:
    array = kind(1, len(values))
    for place, value in enumerate(values, 1):
        array.SetValue(place, value)
    return array


def found(curve: Mapping[str, Any]) -> dict[str, Any]:
    knots = [(value, len(list(same))) for value, same in groupby(curve["knots"])]
    spline = Geom_BSplineCurve(
        _array(Array1_gp_Pnt, [gp_Pnt(x, y, 0.0) for x, y in curve["control_points"]]),
        _array(Array1_double, curve["weights"]),
        _array(Array1_double, [value for value, _ in knots]),
        _array(Array1_int, [count for _, count in knots]),
        curve["degree"],
    )
    adaptor, first = GeomAdaptor_Curve(spline), spline.FirstParameter()
    return {
        "length": GCPnts_AbscissaPoint.Length_s(adaptor, TOLERANCE),
        "station": [GCPnts_AbscissaPoint.Length_s(adaptor, first, u, TOLERANCE) for u in curve["at"]],
        "curvature": [GeomLProp_CLProps(spline, u, 2, RESOLUTION).Curvature() for u in curve["at"]],
    }


if __name__ == "__main__":
    print(json.dumps([found(curve) for curve in json.load(sys.stdin)]))
