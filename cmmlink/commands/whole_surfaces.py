"""The command `surface`: a scan of a whole surface against CAD, a mesh or a cloud of points."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.options import (
    Invalid,
    Json,
    NoRecord,
    Out,
    Records,
    RejectOutliers,
    Uncertainty,
    Unit,
    columns_from,
    records_folder,
    section_in,
)
from cmmlink.commands.output import Output, now, report_outcome, stop_on_ctrl_c
from cmmlink.commands.progress import progress
from cmmlink.commands.pushed import pushing_after
from cmmlink.commands.surface_outcome import report_surface
from cmmlink.errors import PlanError
from cmmlink.plan import SurfaceFit
from cmmlink.words import printable
from drivers import UnitName

if TYPE_CHECKING:
    from cmmlink.plan import SurfacePlan
    from cmmlink.surface_run import FinishedSurface

_OPTION_OF = {
    "device.file.columns": "--columns",
    "device": "SCAN",
    "surface.file": "--nominal",
    "surface.scale": "--scale",
    "surface.unit": "--nominal-unit",
    "surface.chord_mm": "--chord",
    "tolerance.uncertainty_mm": "--uncertainty",
    "tolerance": "--tolerance",
    "probe.tip_radius_mm": "--tip-radius",
    "registration.start": "--start",
    "registration.locked": "--locked",
    "registration.coverage_min": "--coverage-min",
    "registration.gross_mm": "--gross",
    "registration.reject_outliers": "--reject-outliers",
    "gap_max_mm": "--gap-max",
    "edge_allowance_mm": "--edge-allowance",
    "allow.unseen_mm": "--allow-unseen",
}


def surface(
    scan: Annotated[
        Path, typer.Argument(metavar="SCAN", help="Measured points in space: csv, txt, asc, xyz, npy or PLY; or a mesh: STL, PLY, OBJ.")
    ],
    nominal: Annotated[Path, typer.Option(metavar="FILE", help="The nominal: STEP, IGES, STL, PLY, OBJ, or a cloud of points.")],
    tolerance: Annotated[tuple[float, float], typer.Option(metavar="LO HI", help="Deviations allowed, mm, positive out of material.")],
    uncertainty: Uncertainty = 0.0,
    fit: Annotated[SurfaceFit, typer.Option(help="How points come onto the nominal.")] = "best-fit",
    start: Annotated[
        Path | None,
        typer.Option(
            metavar="POSE.json", help="Pose to begin with: rotation (3 x 3) and translation_mm, or a result.json.", show_default="sought"
        ),
    ] = None,
    locked: Annotated[
        str | None, typer.Option(metavar="z,rx", help="Shifts and turns (x, y, z, rx, ry, rz) that stay as --start has them.")
    ] = None,
    scale: Annotated[float, typer.Option(metavar="S", help="Units of a nominal mesh or cloud to mm.")] = 1.0,
    nominal_unit: Annotated[UnitName | None, typer.Option("--nominal-unit", help="Unit of the nominal file, in place of --scale.")] = None,
    chord: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="MM",
            help="Of a mesh: the chord tolerance with which it was exported from CAD. Of CAD: that of triangles on trimmed faces.",
            show_default="0 of a mesh, 0.001 of CAD",
        ),
    ] = None,
    tip_radius: Annotated[float, typer.Option(metavar="R", help="The points are centres of a ball of this radius, mm.")] = 0.0,
    unit: Unit = None,
    columns: Annotated[str | None, typer.Option("--columns", metavar="x=2,y=3,z=4", help="Columns of x, y and z, from 1.")] = None,
    invalid: Invalid = None,
    coverage_min: Annotated[
        float, typer.Option(min=0, max=1, metavar="SHARE", help="Share of the area to be measured before conform is proven.")
    ] = 0.95,
    gap_max: Annotated[
        float | None,
        typer.Option(
            min=0, metavar="MM", help="Widest place without a point that counts as measured.", show_default="1/25 of the nominal's size"
        ),
    ] = None,
    gross: Annotated[
        float | None,
        typer.Option(min=0, metavar="MM", help="Points farther off are no part of the surface.", show_default="1/50 of the nominal's size"),
    ] = None,
    edge_allowance: Annotated[
        float | None,
        typer.Option(min=0, metavar="MM", help="How far points may lie beyond an open border.", show_default="half the zone"),
    ] = None,
    allow_unseen: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="MM",
            help="Widest place that may be unseen where points were lost, damaged or rejected.",
            show_default="none may be",
        ),
    ] = None,
    reject_outliers: RejectOutliers = False,
    section: Annotated[
        tuple[float, float, float, float, float, float] | None,
        typer.Option(
            "--section", metavar="X Y Z I J K", help="Inspect the section through a place of the nominal with a normal, as `inspect` does."
        ),
    ] = None,
    slab: Annotated[
        float | None,
        typer.Option(min=0, metavar="MM", help="How far from the section points are taken.", show_default="1/200 of the nominal's size"),
    ] = None,
    out: Out = None,
    records: Records = None,
    no_record: NoRecord = False,
    as_json: Json = False,
) -> int:
    """Inspect a scan of a whole surface, and record it as a run.

    The nominal is CAD, a mesh or a cloud of points. Its own error counts against the verdict like the uncertainty of the measurement.
    """
    from cmmlink.plan import SurfacePlan, plan_given_by

    if not scan.is_file():
        raise PlanError(f"{scan}: no such file; expected measured points in space")
    settings: dict[str, Any] = {
        "part": {"name": printable((scan.stem.strip() or scan.name).replace("\n", " "))},
        "surface": {"file": nominal, "scale": scale, "unit": nominal_unit, "chord_mm": chord},
        "tolerance": {"lower_mm": tolerance[0], "upper_mm": tolerance[1], "uncertainty_mm": uncertainty},
        "device": {"type": "file", "file": scan, "unit": unit, "columns": columns_from(columns), "invalid": invalid or ()},
        "probe": {"tip_radius_mm": tip_radius},
        "registration": {
            "fit": fit,
            "start": None if start is None else _pose_in(start),
            "locked": [name.strip() for name in locked.split(",")] if locked else (),
            "coverage_min": coverage_min,
            "gross_mm": gross,
            "reject_outliers": reject_outliers,
        },
        "gap_max_mm": gap_max,
        "edge_allowance_mm": edge_allowance,
        "allow": {"unseen_mm": allow_unseen},
        "out": None,
    }
    plan = plan_given_by(SurfacePlan, settings, _OPTION_OF)
    folder = None if no_record else records_folder(records)
    if section is not None:
        return _inspect_section(plan, section, slab, out, folder, as_json=as_json)
    if slab is not None:
        raise PlanError("--slab is for a section; expected --section beside it")
    with pushing_after(folder) as recorded:
        finished = _inspect(plan, out, folder)
        recorded.append(finished.evidence)
        return report_surface(finished, out, as_json=as_json)


def _inspect(plan: "SurfacePlan", out: Path | None, records: Path | None) -> "FinishedSurface":
    from cmmlink.devices import connect
    from cmmlink.from_surface_plan import surface_of, terms_of
    from cmmlink.report import prepare
    from cmmlink.scratch import scratch_in
    from cmmlink.surface_run import carry_out_surface

    terms_of(plan)
    with progress(f"reading {plan.surface.file.name}"):
        file = surface_of(plan)
    with progress(f"inspecting {plan.part.name}"), stop_on_ctrl_c() as stop, connect(plan, scratch_in(records)) as source:
        prepare(out)
        return carry_out_surface(plan, file, source, records=records, clock=time.monotonic, now=now, stop=stop)


def _inspect_section(
    plan: "SurfacePlan", numbers: tuple[float, ...], slab_mm: float | None, out: Path | None, records: Path | None, *, as_json: bool
) -> int:
    """Inspect a plane section of a scan against that of its nominal, and report it as `inspect` does."""
    from cmmlink.from_plan import profile_of
    from cmmlink.plan import Section
    from cmmlink.report import prepare
    from cmmlink.run import carry_out
    from cmmlink.surface_section import section_of_scan

    plane = Section.model_validate(section_in("xy", numbers))
    with pushing_after(records) as recorded, stop_on_ctrl_c() as stop:
        with progress(f"inspecting {plan.part.name}"), section_of_scan(plan, plane, slab_mm) as cut:
            prepare(out)
            profile = profile_of(cut.plan)
            finished = carry_out(cut.plan, profile, cut.device, records=records, clock=time.monotonic, now=now, stop=stop)
        recorded.append(finished.evidence)
        return report_outcome(finished, Output(headless=True, as_json=as_json, out=out))


def _pose_in(path: Path) -> dict[str, Any]:
    """The pose in a file: of its own, or that of the result of an earlier run. Raises PlanError."""
    expected = "expected JSON with rotation (three rows of three numbers) and translation_mm (three numbers), or a result.json"
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise PlanError(f"--start {path}: cannot be read ({error.strerror}); {expected}") from None
    except (ValueError, RecursionError):
        raise PlanError(f"--start {path}: this is no JSON; {expected}") from None
    pose = document.get("registration", document) if isinstance(document, dict) else None
    if not isinstance(pose, dict) or not {"rotation", "translation_mm"} <= set(pose):
        raise PlanError(f"--start {path}: there is no pose in it; {expected}")
    return {key: pose[key] for key in ("rotation", "translation_mm")}
