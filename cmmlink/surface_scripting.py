"""What a script or a notebook calls for a whole surface: from points in space to a result in one call.

Nothing is recorded here, printed or written. The verdict is that of `cmmlink surface` on the same points with the same settings.
"""

import threading
import time
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from cmmlink.devices import Connected, connect
from cmmlink.errors import PlanError
from cmmlink.from_surface_plan import surface_of, terms_of
from cmmlink.inspected_surface import InspectedSurface, inspected_surface
from cmmlink.nominal_files.surface_file import SurfaceFile
from cmmlink.plan import FileDevice, SurfacePlan, plan_given_by
from cmmlink.scripting import tolerance_in
from cmmlink.surface_run import carry_out_surface
from drivers import AxisName, PointArraySource, PointFileError, UnitName, points_in

if TYPE_CHECKING:
    from inspection.surface import NominalSurface

_NOMINAL, _POINTS = Path("nominal"), Path("array of points")  # stand for files where there are none
_HANDED_OVER = "the nominal was handed over as a surface: what was assumed when it was made is not told here"
_NAME_OF = {
    "surface.file": "nominal",
    "device.file.unit": "unit",
    "device.file.columns": "columns",
    "device.file.invalid": "invalid",
    "device": "points",
}


def inspect_surface(
    points: str | PathLike[str] | ArrayLike,
    *,
    nominal: "str | PathLike[str] | Mapping[str, Any] | NominalSurface | None" = None,
    tolerance: Iterable[float] | Mapping[str, Any] | None = None,
    plan: SurfacePlan | None = None,
    normals: ArrayLike | None = None,
    unit: UnitName | None = None,
    columns: Mapping[AxisName, int] | None = None,
    invalid: Collection[float] = (),
    part: str | None = None,
    **plan_keys: Any,
) -> InspectedSurface:
    """Inspect points in space against a whole surface: one call from files or arrays to a verdict.

        found = cmmlink.inspect_surface("scan.csv", nominal="part.stp", tolerance=(-0.05, 0.05))
        found.verdict, found.points.deviation_mm, found.document["regions"], found.plot()

    points    : a file of points, or an array (m, 3), in mm
    nominal   : a file; a mapping like the `surface` of a plan; or a surface of `inspection.surface`
    tolerance : (lower, upper) deviation in mm, positive out of material; or a mapping like the `tolerance` of a plan
    plan      : in place of all but the points, a plan as `load_surface_plan` gives it; its device and its folders are not used
    normals   : (m, 3) outward directions of the measured surface, beside an array of points
    unit, columns, invalid : of a file of points, as the `device` of a plan has them
    part      : what the part is called; None: by the name of its file
    plan_keys : every other key of a plan by its name, such as `gap_max_mm=2.0` or `registration={"fit": "none"}`

    Raises PlanError, PointFileError or NominalError for what cannot be used, and RegistrationError or NotMeasured where the points
    cannot be brought onto the nominal.
    """
    file = Path(fspath(points)) if isinstance(points, str | PathLike) else None
    device = {"type": "file", "file": file or _POINTS, "unit": unit, "columns": columns, "invalid": tuple(invalid)}
    if plan is not None:
        given = {"nominal": nominal, "tolerance": tolerance, "part": part, **plan_keys}
        if beside := [name for name, value in given.items() if value is not None]:
            raise PlanError(f"{beside[0]} stands beside a plan, which says it all itself; expected either of them")
        plan, handed_over = plan.model_copy(update={"device": plan_given_by(FileDevice, device, {})}), None
    else:
        handed_over, of_file = _nominal_in(nominal)
        name = part or (file.stem.strip() if file is not None else "") or "part"
        settings = {"part": {"name": name}, "surface": of_file, "device": device, **plan_keys}
        plan = plan_given_by(SurfacePlan, settings | tolerance_in(tolerance), _NAME_OF)
    terms_of(plan)
    of_plan = surface_of(plan) if handed_over is None else SurfaceFile(handed_over, "surface", 0, (_HANDED_OVER, *handed_over.notes))
    with _scan(plan, None if isinstance(points, str | PathLike) else points, normals) as source:
        now, stop = (lambda: datetime.now().astimezone()), threading.Event()
        return inspected_surface(carry_out_surface(plan, of_plan, source, records=None, clock=time.monotonic, now=now, stop=stop))


@contextmanager
def _scan(plan: SurfacePlan, array: ArrayLike | None, normals: ArrayLike | None) -> Iterator[Connected]:
    """The points, of the plan's file or as they were handed over."""
    if array is None:
        if normals is not None:
            raise PlanError("normals stand beside a file of points, which holds them itself; expected them beside an array")
        with connect(plan) as device:
            yield device
        return
    if np.ndim(array) == 2 and np.shape(array)[1] == 2:
        raise PointFileError("the points have x and y alone, and points in space need x, y and z; expected an array (m, 3)")
    asked = plan.device
    assert isinstance(asked, FileDevice)
    read = points_in(array, unit=asked.unit, columns=asked.columns, invalid=asked.invalid)
    seen = None if normals is None else np.array(normals, dtype=np.float64)
    if seen is not None and seen.shape != read.points_mm.shape:
        raise PlanError(f"normals have shape {seen.shape}; expected that of the points, {read.points_mm.shape}")
    notes = tuple(f"{_POINTS}: {note}" for note in read.notes)
    yield Connected(PointArraySource(str(_POINTS), replace(read, normals=seen)), str(_POINTS), False, notes)


def _nominal_in(
    nominal: "str | PathLike[str] | Mapping[str, Any] | NominalSurface | None",
) -> "tuple[NominalSurface | None, dict[str, Any]]":
    """The nominal where it was handed over, None where it is in a file; and what a plan says of it."""
    if nominal is None:
        raise PlanError("nominal is missing; expected a file, or a surface of inspection.surface")
    if isinstance(nominal, str | PathLike):
        return None, {"file": Path(fspath(nominal))}
    return (None, dict(nominal)) if isinstance(nominal, Mapping) else (nominal, {"file": _NOMINAL})
