"""A NURBS curve spelt out in YAML: degree, knots, control_points_mm, and perhaps weights and closed.

The one format of ours that loses nothing: numbers are written so that they read back to the same bits.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from cmmlink.nominal_files import NominalFile
from cmmlink.plan import read_model
from drivers import UnitName
from inspection import NominalError, NurbsCurve

SUFFIXES = (".yaml", ".yml")

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]  # mm: beyond a kilometre the unit or the scale is wrong

_SAME_END = 1e-9  # of the size: the gap up to which a curve ends where it begins
_OPEN = 0.25  # of the size: a curve with a larger gap between its ends is open
_SHORTEST_SPAN = 1e-12
_RESOLVED = 1e-6  # of the distance from the origin: a smaller curve drowns in round-off


class _Curve(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    degree: int = Field(ge=1, le=15, description="the degree, a whole number like 3")
    knots: list[Annotated[float, Field(ge=-1e9, le=1e9)]] = Field(
        min_length=4, description="the list of knots: one more than control points plus degree"
    )
    control_points_mm: list[tuple[Coordinate, Coordinate]] = Field(min_length=2, description="the list of control points [x, y]")
    weights: list[Annotated[float, Field(ge=1e-6, le=1e6)]] | None = None
    closed: bool | None = None


def read(text: str, scale: float, closed: bool | None, unit: UnitName | None) -> NominalFile:
    """Take the curve as it stands. `closed` None: as the file says, else whether it ends where it begins."""
    given = read_model(text, _Curve)
    points = np.array(given.control_points_mm) * scale
    _require_size(points)
    weights = None if given.weights is None else np.array(given.weights)
    knots = np.array(given.knots)
    _require_spans(knots)
    said = given.closed if closed is None else closed
    curve = NurbsCurve(given.degree, points, knots, weights, closed=bool(said))
    if said is None and _ends_where_it_begins(curve):
        curve = NurbsCurve(given.degree, points, knots, weights, closed=True)
        return NominalFile(curve, "nurbs-yaml", ("closed: the curve ends where it begins",))
    if said is None:
        _ask_about_small_gap(curve)
    if closed is None or given.closed in (None, closed):
        return NominalFile(curve, "nurbs-yaml", ())
    return NominalFile(curve, "nurbs-yaml", (f"{'closed' if closed else 'open'}, as asked, against what the file says",))


def save_nurbs_yaml(curve: NurbsCurve, path: Path) -> None:
    """Write a curve so that `load_nominal` gives the same curve back, bit for bit."""
    weights = curve.weights
    content = {
        "degree": curve.degree,
        "closed": curve.closed,
        "knots": [float(knot) for knot in curve.knots],
        "control_points_mm": [[float(x), float(y)] for x, y in curve.control_points_mm],
        "weights": None if weights is None or np.all(weights == 1.0) else [float(weight) for weight in weights],
    }
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=120), encoding="utf-8", newline="\n")


def _require_size(points: NDArray[np.float64]) -> None:
    size, farthest = float(np.ptp(points, axis=0).max()), float(np.abs(points).max())
    if not (size > 0 and size >= _RESOLVED * farthest and 1e-6 <= farthest <= 1e6):
        found = f"the control points lie within {size:g} mm, up to {farthest:g} mm from the origin"
        raise NominalError(f"{found}; expected a profile in mm: give the scale")


def _require_spans(knots: NDArray[np.float64]) -> None:
    """Refuse knots that differ only by round-off: they were meant to be equal, and the span between them has no real length."""
    spans = np.diff(knots)
    short = (spans > 0) & (spans < _SHORTEST_SPAN * max(1.0, float(np.ptp(knots))))
    if short.any():
        i = int(np.argmax(short))
        raise NominalError(f"knots[{i}] and knots[{i + 1}] differ by {spans[i]:g} only; expected equal knots or a longer span")


def _ask_about_small_gap(curve: NurbsCurve) -> None:
    """Raise NominalError for a curve whose ends lie near each other although nobody said that it is open."""
    first, last = curve.point(np.array(curve.domain))
    gap = float(np.hypot(*(last - first)))
    if gap <= _OPEN * np.ptp(curve.control_points_mm, axis=0).max():
        raise NominalError(
            f"the curve ends {gap:.6g} mm from where it begins: it may be closed or open; expected closed: false to keep it open, "
            "or a curve that ends where it begins"
        )


def _ends_where_it_begins(curve: NurbsCurve) -> bool:
    first, last = curve.point(np.array(curve.domain))
    return bool(np.hypot(*(last - first)) <= _SAME_END * np.ptp(curve.control_points_mm, axis=0).max())
