"""What a script or a notebook calls: from points to a result in one call, and a recorded run by its name.

Nothing is recorded here, printed or written. The verdict is that of `cmmlink inspect` on the same points with the same settings.
"""

import threading
import time
from collections.abc import Collection, Iterable, Mapping
from datetime import datetime
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from cmmlink.characteristics import notes_on_characteristics
from cmmlink.devices import words_of
from cmmlink.errors import PlanError, RunError
from cmmlink.exports import document_on_record, judged_rows, sound_run
from cmmlink.from_plan import (
    discretize_file,
    inspection_of,
    load_from,
    notes_on_datum,
    notes_on_nominal,
    notes_on_temperature,
    profile_of,
    run_started,
    with_section,
)
from cmmlink.inspected import Inspected, inspected_on_record, inspected_run
from cmmlink.inspected_surface import InspectedSurface, surface_from_record
from cmmlink.nominal_files import NominalFile, nominal_of_curve, nominal_of_points
from cmmlink.pipeline import run_inspection
from cmmlink.plan import Discretisation, FileDevice, Plan, plan_given_by
from cmmlink.plan import Nominal as NominalOfPlan
from cmmlink.record import default_folder, end_missing, find_run, open_to_read, recorded_plan, recorded_profile
from cmmlink.run import FinishedRun
from drivers import AxisName, PointArraySource, UnitName, points_in, read_points
from inspection import Material, NominalProfile, NurbsCurve

AnyPath = str | PathLike[str]
Nominal = AnyPath | Mapping[str, Any] | NurbsCurve | NominalProfile | ArrayLike
"""A file, what a plan says of one, a curve, a discretised profile, or points (k, 2) that the curve goes through."""

_NOMINAL, _POINTS = Path("nominal"), Path("array of points")  # stand for files where there are none
_NAME_OF = {
    "nominal.file": "nominal",
    "nominal.scale": "scale",
    "nominal.closed": "closed",
    "nominal.material": "material",
    "device.file.unit": "unit",
    "device.file.columns": "columns",
    "device.file.invalid": "invalid",
    "device": "points",
}


def inspect(
    points: AnyPath | ArrayLike,
    *,
    nominal: Nominal | None = None,
    tolerance: Iterable[float] | Mapping[str, Any] | None = None,
    plan: Plan | None = None,
    scale: float = 1.0,
    closed: bool | None = None,
    material: Material | None = None,
    unit: UnitName | None = None,
    columns: Mapping[AxisName, int] | None = None,
    invalid: Collection[float] = (),
    part: str | None = None,
    **plan_keys: Any,
) -> Inspected:
    """Inspect points against a nominal: one call from files or arrays to a verdict.

        found = cmmlink.inspect("cam-points.csv", nominal="cam.yaml", tolerance=(-0.05, 0.05))
        found.verdict, found.points.deviation_mm, found.plot()

    points    : a file of points, or an array (m, 2) in the section or (m, 3) in machine coordinates, in mm
    nominal   : a file; a mapping like the `nominal` of a plan; a curve; a discretised profile; or points (k, 2) to go through
    tolerance : (lower, upper) deviation in mm, positive out of material; or a mapping like the `tolerance` of a plan
    plan      : in place of all but the points, a plan as `load_plan` gives it; its device and its folders are not used
    scale     : how many mm a unit of the nominal file is, such as the chord of an airfoil
    closed    : whether the nominal is closed; None: as its file or its points show
    material  : the side of the material along the nominal, "left" or "right"; None: inside a closed one
    unit, columns, invalid : of the points, as the `device` of a plan with a file has them
    part      : what the part is called; None: by the name of its file
    plan_keys : every other key of a plan by its name, such as `gap_max_mm=2.0`, `registration={"fit": "none"}`, `characteristics=[...]`
                or `probe={"tip_radius_mm": 1.5}`; `cmmlink plan keys` lists them

    Raises PlanError, PointFileError or NominalError for what cannot be used, and RegistrationError or NotMeasured where the points
    cannot be brought onto the nominal.
    """
    file = _path_in(points)
    device = {"type": "file", "file": file or _POINTS, "unit": unit, "columns": columns, "invalid": tuple(invalid)}
    curve: NominalFile | NominalProfile | None = None
    if plan is not None:
        given = {"nominal": nominal, "tolerance": tolerance, "closed": closed, "material": material, "part": part, **plan_keys}
        beside = [name for name, value in given.items() if value is not None] + (["scale"] if scale != 1.0 else [])
        if beside:
            raise PlanError(f"{beside[0]} stands beside a plan, which says it all itself; expected either of them")
        plan = plan.model_copy(update={"device": plan_given_by(FileDevice, device, {})})
    else:
        if nominal is None:
            raise PlanError("nominal is missing; expected a file, a curve, or points (k, 2) that it goes through")
        curve, of_file = _nominal_in(nominal, closed, {"scale": scale, "closed": closed, "material": material})
        name = part or (file.stem.strip() if file is not None else "") or "part"
        settings = {"part": {"name": name}, "nominal": of_file, "device": device, **plan_keys}
        plan = plan_given_by(Plan, settings | tolerance_in(tolerance), _NAME_OF)
    if file is None:
        read, place = points_in(points, unit=unit, columns=columns, invalid=invalid), f"{_POINTS}: "
    else:
        read, place = read_points(file, unit=unit, columns=columns, invalid=invalid), f"{file.name}: "
    return inspected_run(_judge(plan, curve, PointArraySource(_words(plan), read), tuple(place + note for note in read.notes)))


def open_run(name: str = "last", *, records: AnyPath | None = None) -> Inspected | InspectedSurface:
    """Open a recorded run with its result, of a section or of a whole surface: every point, and everything that result.json says of it.

    name    : an id or the beginning of one, a counter, a serial number, "last", or "last~1" for the one before it
    records : the folder of the records; None: the user's own

    Raises RunError where there is no such run, or it has no result; StoreError where its record was altered or cannot be read.
    """
    folder = default_folder() if records is None else Path(fspath(records))
    with open_to_read(folder, lambda: datetime.now().astimezone()) as store:
        run = find_run(store, name)
        recorded = sound_run(store, run)
        if recorded.result is None:
            end = recorded.end or end_missing(store, run)
            told = f": {end['message']}" if end["message"] else ""
            raise RunError(f"run {run} has no result ({end['state']}{told}); `cmmlink export {run} --out DIR` writes what is on record")
        if recorded.is_of_surface:
            named = " ".join(filter(None, [recorded.header["part"], recorded.header["serial_number"], f"(run {run})"]))
            return surface_from_record(named, store, recorded)
        profile = recorded_profile(recorded_plan(recorded), recorded)
        document = document_on_record(store, recorded, profile)
        title = " ".join(filter(None, [document["part"], document["serial_number"], f"(run {run})"]))
        return inspected_on_record(title, document, profile, judged_rows(store, run))


def nominal_profile(
    nominal: Nominal, *, scale: float = 1.0, closed: bool | None = None, material: Material | None = None
) -> NominalProfile:
    """The discretised profile of a nominal, for the functions of `inspection`: of a file, a curve, or points (k, 2).

    The arguments are those of `inspect`. Raises PlanError or NominalError for what cannot be used.
    """
    curve, of_file = _nominal_in(nominal, closed, {"scale": scale, "closed": closed, "material": material})
    if isinstance(curve, NominalProfile):
        return curve
    asked = plan_given_by(NominalOfPlan, of_file, {"file": "nominal"})
    return discretize_file(curve or load_from(asked, asked.file), asked.file, asked, Discretisation())


def _judge(plan: Plan, curve: NominalFile | NominalProfile | None, source: PointArraySource, notes: tuple[str, ...]) -> FinishedRun:
    """Send points through the pipeline as `cmmlink inspect` does; `curve` is a nominal that was handed over in place of a file."""
    profile: NominalProfile
    assumed: tuple[str, ...]
    if isinstance(curve, NominalProfile):
        profile, assumed = curve, ("the nominal was handed over as a profile: what was assumed when it was made is not told here",)
    elif curve is not None:
        profile, assumed = discretize_file(curve, _NOMINAL, plan.nominal, plan.discretisation), curve.notes
    else:
        profile, assumed, plan = profile_of(plan), notes_on_nominal(plan), with_section(plan)
    assumed = (*assumed, *notes_on_datum(plan), *notes_on_temperature(plan), *notes_on_characteristics(plan), *notes)
    try:
        live = inspection_of(plan, profile, provisional=False)
    except ValueError as error:
        raise error if isinstance(error, PlanError) else PlanError(f"probe.tip_radius_mm: {error}") from None
    began = datetime.now().astimezone()
    started = run_started(plan, _words(plan), simulated=False, notes=assumed)
    buffered = plan.buffer_points
    outcome = run_inspection(source, live, (), started, buffer_points=buffered, clock=time.monotonic, stop=threading.Event())
    return FinishedRun(plan, profile, started, outcome, None, began)


def _words(plan: Plan) -> str:
    device = plan.device
    return str(_POINTS) if isinstance(device, FileDevice) and device.file == _POINTS else words_of(device)


def _path_in(points: object) -> Path | None:
    return Path(fspath(points)) if isinstance(points, str | PathLike) else None


def _nominal_in(
    nominal: Nominal, closed: bool | None, asked: Mapping[str, Any]
) -> tuple[NominalFile | NominalProfile | None, dict[str, Any]]:
    """The nominal where it was handed over, None where it is in a file; and what a plan says of it."""
    if isinstance(nominal, Mapping):
        given = {key: value for key, value in asked.items() if value is not None and (key, value) != ("scale", 1.0)}
        if twice := next((key for key in given if key in nominal), None):
            raise PlanError(f"{twice} is given beside the nominal and in it; expected it once")
        return None, given | dict(nominal)
    if isinstance(nominal, str | PathLike):
        return None, {"file": Path(fspath(nominal)), **asked}
    if asked["scale"] != 1.0:
        raise PlanError(f"scale is {asked['scale']:g}: it is for a file; expected a nominal in mm where a curve or points are handed over")
    material = {"file": _NOMINAL, "material": asked["material"]}
    if isinstance(nominal, NominalProfile):
        if closed is not None or asked["material"] is not None:
            raise PlanError("closed and material are settled in a discretised profile; expected neither of them beside it")
        return nominal, material
    if isinstance(nominal, NurbsCurve):
        if closed is not None:
            raise PlanError("closed is settled in a curve; expected none beside it")
        return nominal_of_curve(nominal), material
    return nominal_of_points(nominal, closed), material


def tolerance_in(tolerance: Iterable[float] | Mapping[str, Any] | None) -> dict[str, Any]:
    """What a plan says of a tolerance that was handed over as two limits, or as a plan has it. Raises PlanError for one that is neither."""
    if tolerance is None:
        return {}
    if isinstance(tolerance, Mapping):
        return {"tolerance": dict(tolerance)}
    try:
        lower, upper = map(float, tolerance)
    except (TypeError, ValueError):
        raise PlanError(f"tolerance is {tolerance!r}; expected the lower and the upper deviation in mm, like (-0.05, 0.05)") from None
    return {"tolerance": {"lower_mm": lower, "upper_mm": upper}}
