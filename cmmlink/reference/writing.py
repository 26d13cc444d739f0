"""The reference set as a folder: every case as points, as a nominal in four formats, as a plan, and as a file of what is true."""

import hashlib
import json
from collections.abc import Iterable, Iterator
from decimal import Decimal
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.errors import PlanError
from cmmlink.reference.case import KnownHold, KnownPose, ReferenceCase, Truth
from cmmlink.reference.dxf_text import dxf_text
from cmmlink.reference.exact_numbers import as_float, with_fifty_digits
from cmmlink.reference.iges_text import iges_text
from cmmlink.reference.scoring import scoring_sheet
from cmmlink.reference.step_text import step_text

_SHIPPED = ("LICENSE", "README")
SUMS = "SHA256SUMS"
SCORING = "scoring.csv"


def write_reference(folder: Path, cases: Iterable[ReferenceCase]) -> dict[str, str]:
    """Write cases into a new folder. Returns the SHA-256 of every file by its name in the folder, in the order of SHA256SUMS.

    Raises PlanError where something is there already, or the folder cannot be written.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise PlanError(f"{folder}: is there already, and nothing is overwritten; give a new folder")
    sums: dict[str, str] = {}
    try:
        for name, text in texts_of(cases):
            content = text.encode("ascii")
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            sums[name] = hashlib.sha256(content).hexdigest()
        (folder / SUMS).write_bytes(sums_text(sums).encode("ascii"))
    except OSError as error:
        raise PlanError(f"{error.filename or folder}: cannot be written: {error.strerror or error}") from None
    return sums


def sums_text(sums: dict[str, str]) -> str:
    """SHA256SUMS as `sha256sum -c` reads it."""
    return "".join(f"{sums[name]}  {name}\n" for name in sorted(sums))


def texts_of(cases: Iterable[ReferenceCase]) -> Iterator[tuple[str, str]]:
    """Every file of the set: its name in the folder, with slashes, and its text."""
    written = []
    for case in cases:
        written.append(case)
        for name, text in _texts_of_case(case):
            yield f"{case.name}/{name}", text
    yield SCORING, scoring_sheet(written)
    for name in _SHIPPED:
        yield name, resources.files("cmmlink.reference").joinpath("set_files", name).read_text(encoding="ascii")


def _texts_of_case(case: ReferenceCase) -> Iterator[tuple[str, str]]:
    yield "points.csv", f"x_{case.unit},y_{case.unit}\n" + "".join(f"{x!r},{y!r}\n" for x, y in case.points.tolist())
    yield "nominal.yaml", _nominal_yaml(case)
    yield "nominal.dxf", dxf_text(case.nominal, case.unit)
    yield "nominal.igs", iges_text(case.nominal, case.unit, case.name)
    yield "nominal.step", step_text(case.nominal, case.unit, case.name)
    yield "plan.yaml", f"# {case.about}\n" + "".join(f"{key}: {json.dumps(value)}\n" for key, value in plan_of(case).items())
    yield "truth.json", json.dumps(_truth_json(case), indent=1) + "\n"


def plan_of(case: ReferenceCase) -> dict[str, Any]:
    """The plan of a case, seen from its folder; its lengths are in mm."""
    tip, lower, upper = _in_mm(case, np.array([case.tip_radius])), *case.limits_mm
    plan: dict[str, Any] = {
        "part": {"name": case.name},
        "nominal": {"file": "nominal.yaml", "material": case.nominal.material},
        "device": {"type": "file", "file": "points.csv", "unit": case.unit},
        "probe": {"tip_radius_mm": float(tip[0])},
    }
    if "characteristics" not in case.settings:
        plan["tolerance"] = {"lower_mm": lower, "upper_mm": upper}
    return plan | dict(case.settings)


def _in_mm(case: ReferenceCase, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths of a case in mm, rounded to 15 digits as decimal numbers are."""
    if case.unit == "mm":
        return values
    with with_fifty_digits():
        flat = [as_float(Decimal(repr(value)) * Decimal(repr(case.mm_per_unit))) for value in values.ravel().tolist()]
    return np.array(flat).reshape(values.shape)


def _nominal_yaml(case: ReferenceCase) -> str:
    nominal = case.nominal
    content: dict[str, Any] = {
        "degree": nominal.degree,
        "closed": nominal.closed,
        "knots": nominal.knots.tolist(),
        "control_points_mm": _in_mm(case, nominal.control_points).tolist(),
    }
    if nominal.weights is not None:
        content["weights"] = nominal.weights.tolist()
    return "".join(f"{key}: {json.dumps(value)}\n" for key, value in content.items())


def _truth_json(case: ReferenceCase) -> dict[str, Any]:
    truth = case.truth
    facts = {"case": case.name, "kind": case.kind, "about": case.about, "unit": case.unit, "tip_radius": case.tip_radius}
    return {**facts, "limits_mm": list(case.limits_mm), "verdict": truth.verdict, **dict(_known(truth))}


def _known(truth: Truth) -> Iterator[tuple[str, Any]]:
    """What is known, without what a case is not about."""
    if truth.pose is not None:
        yield "pose", _pose_json(truth.pose)
    if truth.equal_poses:
        yield "equal_poses", [_pose_json(pose) for pose in truth.equal_poses]
    if truth.worst is not None:
        worst = truth.worst
        yield "worst", {"row": worst.row, "x": worst.x, "y": worst.y, "deviation": worst.deviation}
    if truth.rms is not None:
        yield "rms", truth.rms
    for name, hold in (("zone", truth.zone), ("consumption", truth.consumption)):
        if hold is not None:
            yield name, _hold_json(hold)
    if truth.values:
        yield "values", [{"name": each.name, "unit": each.unit, "value": each.value} for each in truth.values]
    if truth.outliers:
        yield "outliers", list(truth.outliers)
    if truth.deviation is not None:
        yield "deviation", _list(truth.deviation)
    if truth.filtered:
        yield "filtered", [{"name": each.name, "cutoff": each.cutoff, "deviation": _list(each.deviation)} for each in truth.filtered]


def _pose_json(pose: KnownPose) -> dict[str, Any]:
    return {"rotation_deg": pose.rotation_deg, "translation": list(pose.translation)}


def _hold_json(hold: KnownHold) -> dict[str, Any]:
    return {"value": hold.value, "held_by": hold.held_by.tolist(), "multipliers": hold.multipliers.tolist()}


def _list(values: NDArray[np.float64]) -> list[float | None]:
    """Numbers for JSON, which has none that is not finite."""
    return [value if np.isfinite(value) else None for value in values.tolist()]
