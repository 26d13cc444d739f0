"""The command `compare`: two scans of one profile on one drawing, with their difference along the station."""

import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.options import (
    Closed,
    ColumnsText,
    CurveNumber,
    Json,
    Layer,
    NominalScale,
    NominalUnit,
    Plane,
    Records,
    Unit,
    columns_from,
    records_folder,
    section_in,
)
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError, RunError
from cmmlink.words import printable
from inspection import FitName, Material

if TYPE_CHECKING:
    from cmmlink.comparison import ComparedScan, Comparison
    from cmmlink.record import Store
    from cmmlink.surface_comparison import SurfaceComparison

_PICTURES = (".png", ".svg", ".pdf")
_NO_LIMITS = (-1.0, 1.0)  # an inspection needs some: the fit aims at their middle, and nothing that is compared depends on their width
_OPTION_OF = {
    "device.columns": "--columns",
    "device": "A, B",
    "nominal.scale": "--scale",
    "nominal.unit": "--nominal-unit",
    "nominal.layer": "--layer",
    "nominal.curve": "--curve",
    "tolerance": "--tolerance",
    "probe.tip_radius_mm": "--tip-radius",
}


def compare(
    first: Annotated[str, typer.Argument(metavar="A", help="A recorded run (id, its beginning, or last), or a file of points.")],
    second: Annotated[str, typer.Argument(metavar="B", help="The other one, which A is taken from.")],
    nominal: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The nominal of two files; a run brings its own.", show_default=False)
    ] = None,
    tolerance: Annotated[
        tuple[float, float] | None, typer.Option(metavar="LO HI", help="Limits to be drawn.", show_default="those of the run")
    ] = None,
    fit: Annotated[FitName, typer.Option(help="How the points of a file come onto the nominal; a run keeps its pose.")] = "best-fit",
    tip_radius: Annotated[float, typer.Option(metavar="R", help="The points of files are centres of a ball of this radius, mm.")] = 0.0,
    scale: NominalScale = 1.0,
    nominal_unit: NominalUnit = None,
    layer: Layer = None,
    curve: CurveNumber = None,
    closed: Closed = None,
    material: Annotated[Material | None, typer.Option(help="Side of the material, seen along the nominal.")] = None,
    unit: Unit = None,
    columns: ColumnsText = None,
    plane: Plane = "xy",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="The drawing: png, svg or pdf.", show_default=False)
    ] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Compare two scans of one profile: runs, files of points, or a run and the points that another program exported."""
    from cmmlink.comparison import compare_scans

    if out is not None and out.suffix.lower() not in _PICTURES:
        raise PlanError(f"{out}: no drawing is known by the suffix '{out.suffix}'; expected .png, .svg or .pdf")
    files = [Path(name) for name in (first, second) if Path(name).is_file()]
    if nominal is None and not files and (found := _surfaces_compared(first, second, records_folder(records))) is not None:
        return _report_surfaces(found, out, as_json=as_json)
    if nominal is None and len(files) == 2:
        raise PlanError(f"{first} and {second} are files of points: --nominal FILE says what both are compared with")
    if nominal is not None and len(files) < 2:
        for name in (first, second):
            _require_no_missing_file(name)
        raise PlanError(f"--nominal {nominal}: a recorded run brings its own nominal; leave the option out")
    file_settings: dict[str, Any] = {
        "device": {"unit": unit, "columns": columns_from(columns)},
        "section": section_in(plane, None),
        "probe": {"tip_radius_mm": tip_radius},
        "fit": fit,
    }
    if nominal is not None:
        lower, upper = tolerance or _NO_LIMITS
        shape = {"layer": layer, "curve": curve, "scale": scale, "unit": nominal_unit, "closed": closed, "material": material}
        asked = {"nominal": {"file": nominal, **shape}, "tolerance": {"lower_mm": lower, "upper_mm": upper}}
        one, other = (_scan_of_file(path, {**asked, **file_settings}) for path in files)
    else:
        one, other = _scans_with_a_run(first, second, records_folder(records), file_settings)
    with progress("comparing"):
        comparison = compare_scans(one, other, tolerance)
        if out is not None:
            _draw(comparison, out)
    if as_json:
        print_json(comparison.to_json() | {"file": None if out is None else str(out)})
    else:
        _print(comparison, out)
    return 0


def _surfaces_compared(first: str, second: str, records: Path) -> "SurfaceComparison | None":
    """Two runs of whole surfaces compared; None where neither is one. Raises PlanError where one is and the other is not."""
    from cmmlink.record import find_run, open_to_read, recorded_run

    with open_to_read(records, now) as store:
        try:
            runs = [find_run(store, name) for name in (first, second)]
        except RunError:  # what is meant is told by who looks for files as well
            return None
        of_surface = [recorded_run(store, run).is_of_surface for run in runs]
        if not any(of_surface):
            return None
        if not all(of_surface):
            raise PlanError(f"{first} and {second}: one is a run of a whole surface and the other of a section; expected two of a kind")
        from cmmlink.surface_comparison import compare_surfaces

        with progress("comparing"):
            return compare_surfaces(store, runs)


def _report_surfaces(found: "SurfaceComparison", out: Path | None, *, as_json: bool) -> int:
    if out is not None:
        raise PlanError(f"--out {out}: there is no drawing of two surfaces; leave it out")
    told = found.to_json()
    if as_json:
        print_json(told)
        return 0
    for name in ("first", "second"):
        run = told[name]
        who = " ".join(filter(None, [run["part"], run["serial_number"]]))
        _say(f"{name:<6}  run {run['run']}, {who}, measured {run['measured_at']}: {run['judged']} points judged, fit {run['fit']}")
    _say(f"nominal {told['nominal']}, {told['area_mm2']:.6g} mm2, compared over {told['compared']:.1%} of it")
    _say(f"second - first: mean {told['mean_mm']:+.4f} mm, rms {told['rms_mm']:.4f} mm, whatever the density of points")
    _say("\n         x         y         z      face     first    second  difference")
    for place in told["places"]:
        x, y, z = place["place_mm"]
        values = f"{place['first_mm']:+8.4f}  {place['second_mm']:+8.4f}    {place['difference_mm']:+8.4f}"
        _say(f"{x:10.3f}{y:10.3f}{z:10.3f}{place['face']:10d}  {values}")
    for note in told["notes"]:
        _say(f"note: {note}")
    return 0


def _scans_with_a_run(first: str, second: str, records: Path, file_settings: dict[str, Any]) -> "list[ComparedScan]":
    """Two scans of which one at least is a run on record; a file is judged against the nominal of that run, as that run was."""
    from cmmlink.record import open_to_read

    with ExitStack() as opened:
        store = opened.enter_context(open_to_read(records, now))
        runs = {name: _scan_of_run(store, name) for name in (first, second) if not Path(name).is_file()}
    known = next(iter(runs.values()))
    plan, limits = known.plan, known.document["tolerance"]
    asked = {
        "nominal": plan.nominal,
        "tolerance": {"lower_mm": limits["lower_mm"], "upper_mm": limits["upper_mm"]},
        "method": plan.registration.method,
        "weights": plan.weights,
        "gap_max_mm": plan.gap_max_mm,
        **file_settings,
    }
    return [runs[name] if name in runs else _scan_of_file(Path(name), asked, known) for name in (first, second)]


def _scan_of_run(store: "Store", name: str) -> "ComparedScan":
    from cmmlink.comparison import scan_of_run

    try:
        return scan_of_run(store, name)
    except RunError:
        _require_no_missing_file(name)
        raise


def _require_no_missing_file(name: str) -> None:
    """Raise PlanError where a name that is no file was meant as one: it has a suffix or a folder."""
    path = Path(name)
    if not path.is_file() and (path.suffix or path.name != name):
        raise PlanError(f"{name}: no such file, and no such run; `cmmlink runs` lists the runs")


def _scan_of_file(path: Path, asked: dict[str, Any], known: "ComparedScan | None" = None) -> "ComparedScan":
    """The points of a file, judged as it is asked, against the nominal of a scan that is `known`."""
    from cmmlink.comparison import scan_of_file
    from cmmlink.from_plan import profile_of
    from cmmlink.plan import Plan, plan_given_by

    settings = {name: value for name, value in asked.items() if name not in ("fit", "method")}
    settings |= {
        "part": {"name": printable((path.stem.strip() or path.name).replace("\n", " "))},
        "device": {"type": "file", "file": path, **asked["device"]},
        "registration": {"fit": asked["fit"], "method": asked.get("method", "exact")},
        "rule": "best-fit",
        "out": None,
    }
    plan = plan_given_by(Plan, settings, _OPTION_OF)
    return scan_of_file(plan, known.profile if known is not None else profile_of(plan), time.monotonic)


def _draw(comparison: "Comparison", out: Path) -> None:
    from cmmlink.report import write_comparison_picture
    from cmmlink.result_files import new_files

    title = f"{comparison.first.name} and {comparison.second.name}"
    try:
        with new_files(out.parent) as files:
            write_comparison_picture(comparison, title, files(out.name))
    except OSError as error:
        raise PlanError(f"{out}: the drawing cannot be written there ({error.strerror}); choose another file with --out") from None


def _print(comparison: "Comparison", out: Path | None) -> None:
    """Print what was compared, at which poses, the largest difference and where it is, and a table along the profile."""
    from cmmlink.comparison import largest_words

    found = comparison.difference
    for name, scan in (("first ", comparison.first), ("second", comparison.second)):
        _say(f"{name}  {scan.words}{f', measured {scan.measured_at}' if scan.measured_at else ''}: {scan.document['judged']} points judged")
        _say(f"        {scan.pose_words}")
    length, share = comparison.profile.length_mm, found.compared
    _say(f"nominal {comparison.first.plan.nominal.file.name}, {length:.3f} mm long, compared along {share:.1%} of it")
    _say(largest_words(comparison))
    _say(f"second - first: mean {found.mean_mm:+.4f} mm, rms {found.rms_mm:.4f} mm, whatever the density of points")
    _say("\n      station mm      largest at     first    second  difference")
    for row in comparison.stretches():
        head, at = f"{row['from_mm']:8.2f} {row['to_mm']:8.2f}", row["largest"]
        if at is None:
            _say(f"{head}  not measured by both")
            continue
        _say(f"{head}  {at['station_mm']:13.2f}  {at['first_mm']:+8.4f}  {at['second_mm']:+8.4f}    {at['difference_mm']:+8.4f}")
    for note in comparison.notes:
        _say(f"note: {note}")
    if out is not None:
        _say(f"drawing in {out}")


def _say(text: str) -> None:
    """Print what may quote a file or a record; nothing there may steer the terminal."""
    typer.echo("\n".join(printable(line) for line in text.split("\n")))
