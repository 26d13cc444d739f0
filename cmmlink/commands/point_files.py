"""The command `inspect`: files of points against a nominal."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cmmlink.commands.many_files import inspect_files
from cmmlink.commands.options import (
    AllowUnseen,
    Closed,
    ColumnsText,
    CurveNumber,
    EndAllowance,
    GapMax,
    Invalid,
    Json,
    Layer,
    NominalScale,
    NominalUnit,
    NoRecord,
    Out,
    Plane,
    Records,
    RejectOutliers,
    Rule,
    SectionPlaneNumbers,
    Uncertainty,
    Unit,
    Weights,
    columns_from,
    records_folder,
    section_in,
)
from cmmlink.commands.output import Output, now, report_outcome, stop_on_ctrl_c
from cmmlink.commands.progress import progress
from cmmlink.commands.pushed import pushing_after
from cmmlink.errors import PlanError
from cmmlink.words import printable
from inspection import FitName, Material, Method

if TYPE_CHECKING:
    from cmmlink.run import FinishedRun

_PATIENCE_S = 60.0  # files are inspected side by side, and each waits for its turn to be recorded
_OPTION_OF = {
    "device": "POINTS",
    "nominal.file": "--nominal",
    "nominal.scale": "--scale",
    "nominal.unit": "--nominal-unit",
    "nominal.layer": "--layer",
    "nominal.curve": "--curve",
    "tolerance.uncertainty_mm": "--uncertainty",
    "tolerance": "--tolerance",
    "probe.tip_radius_mm": "--tip-radius",
    "registration.coverage_min": "--coverage-min",
    "gap_max_mm": "--gap-max",
    "end_allowance_mm": "--end-allowance",
    "allow.unseen_mm": "--allow-unseen",
    "registration.reject_outliers": "--reject-outliers",
}


def inspect(
    points: Annotated[list[Path], typer.Argument(metavar="POINTS...", help="Measured points: csv, txt, asc, xyz or npy.")],
    nominal: Annotated[Path, typer.Option(metavar="FILE", help="The nominal profile.")],
    tolerance: Annotated[tuple[float, float], typer.Option(metavar="LO HI", help="Deviations allowed, mm, positive out of material.")],
    method: Annotated[Method, typer.Option(help="How deviations are found.")] = "exact",
    fit: Annotated[FitName, typer.Option(help="How points come onto the nominal.")] = "best-fit",
    tip_radius: Annotated[float, typer.Option(metavar="R", help="The points are centres of a ball of this radius, mm.")] = 0.0,
    uncertainty: Uncertainty = 0.0,
    scale: NominalScale = 1.0,
    nominal_unit: NominalUnit = None,
    layer: Layer = None,
    curve: CurveNumber = None,
    unit: Unit = None,
    columns: ColumnsText = None,
    invalid: Invalid = None,
    plane: Plane = "xy",
    section: SectionPlaneNumbers = None,
    closed: Closed = None,
    material: Annotated[Material | None, typer.Option(help="Side of the material, seen along the nominal.")] = None,
    coverage_min: Annotated[
        float, typer.Option(min=0, max=1, metavar="SHARE", help="Share of the nominal to be measured before conform is proven.")
    ] = 0.95,
    reject_outliers: RejectOutliers = False,
    rule: Rule = "minimum-zone",
    weights: Weights = "arc-length",
    gap_max: GapMax = None,
    end_allowance: EndAllowance = None,
    allow_unseen: AllowUnseen = None,
    out: Out = None,
    records: Records = None,
    no_record: NoRecord = False,
    as_json: Json = False,
) -> int:
    """Inspect files of points, and record each as a run.

    Of several files, each is a part by itself, and one that cannot be used keeps no other from being inspected. A table shows them all. The
    exit status is that of the worst: 5, then 1 where any part is not conform, then 4 or 2, 3, and 0 where all conform.
    """
    from cmmlink.devices import connect
    from cmmlink.from_plan import inspection_of, profile_of
    from cmmlink.other_processes import processes_here
    from cmmlink.plan import Plan, plan_given_by
    from cmmlink.report import Pictures, prepare
    from cmmlink.run import carry_out
    from cmmlink.scratch import scratch_in

    settings = {
        "nominal": {
            "file": nominal,
            "layer": layer,
            "curve": curve,
            "scale": scale,
            "unit": nominal_unit,
            "closed": closed,
            "material": material,
        },
        "tolerance": {"lower_mm": tolerance[0], "upper_mm": tolerance[1], "uncertainty_mm": uncertainty},
        "section": section_in(plane, section),
        "probe": {"tip_radius_mm": tip_radius},
        "registration": {"fit": fit, "method": method, "coverage_min": coverage_min, "reject_outliers": reject_outliers},
        "rule": rule,
        "weights": weights,
        "gap_max_mm": gap_max,
        "end_allowance_mm": end_allowance,
        "allow": {"unseen_mm": allow_unseen},
        "out": None,
    }
    device = {"type": "file", "unit": unit, "columns": columns_from(columns), "invalid": invalid or ()}
    folder = None if no_record else records_folder(records)

    def inspect_one(file: Path, out: Path | None) -> "FinishedRun":
        part = {"name": printable((file.stem.strip() or file.name).replace("\n", " "))}
        plan = plan_given_by(Plan, settings | {"part": part, "device": device | {"file": file}}, _OPTION_OF)
        profile = profile_of(plan)
        with connect(plan, scratch_in(folder)) as source:
            try:
                inspection_of(plan, profile)
            except ValueError as error:
                raise PlanError(f"--tip-radius {tip_radius:g}: {error}") from None
            prepare(out)
            finished = carry_out(plan, profile, source, records=folder, clock=time.monotonic, now=now, stop=stop, patience_s=_PATIENCE_S)
        recorded.append(finished.evidence)
        if finished.refusal is not None:
            raise type(finished.refusal)(f"{file}: {finished.refusal}")
        return finished

    with pushing_after(folder) as recorded, Pictures() as pictures, stop_on_ctrl_c() as stop:
        pictures.start(min(processes_here(), 0 if out is None else 1))  # it loads what it draws with while points are read and judged
        if len(points) > 1:
            return inspect_files(points, inspect_one, out, pictures, stop, as_json=as_json)
        with progress(f"inspecting {points[0].name}"):
            finished = inspect_one(points[0], out)
        return report_outcome(finished, Output(headless=True, as_json=as_json, out=out), pictures)
