"""What a study of the measuring system shows, as lines of text and as JSON."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.plant import StudiedCharacteristic, Study, StudyFinding, StudyFindings
from cmmlink.version import RESULT_SCHEMA

_UNIT_KEYS = {"mm": "uncertainty_mm", "deg": "uncertainty_deg"}
_TELLING = 0.001  # of u^2: smaller shares stand in the report of the study alone
_MOST = 3  # stretches along the profile that are named in text


def study_document(study: Study, found: StudyFindings) -> dict[str, Any]:
    """A study as `--json` prints it."""
    ends = [study.runs[at].measured_at for at in (0, -1)]
    return {
        "schema": RESULT_SCHEMA,
        "study": study.name,
        "kind": study.kind,
        "measured_from": ends[0],
        "measured_to": ends[1],
        "runs": [{"run": run.run, "chain_sha256": run.chain_sha256, "part": run.part, "operator": run.operator} for run in study.runs],
        "parts": list(found.parts),
        "operators": list(found.operators),
        "repeats": found.repeats,
        "characteristics": [_characteristic(study, one) for one in found.findings],
        "along_the_profile": _along(study, found),
        "notes": list(found.notes),
    }


def _characteristic(study: Study, one: StudyFinding) -> dict[str, Any]:
    asked = one.characteristic
    told: dict[str, Any] = {"name": asked.name, "type": asked.type, "unit": asked.unit, "lower": asked.lower, "upper": asked.upper}
    if one.type_one is not None:
        told["type_one"] = asdict(one.type_one)
    if one.crossed is not None:
        told["crossed"] = asdict(one.crossed)
    return told | {"budget": asdict(one.budget), "plan": plan_words(study, one), "notes": list(one.notes)}


def plan_key(asked: StudiedCharacteristic) -> str:
    """The key of a characteristic in a plan that takes its U."""
    return _UNIT_KEYS.get(asked.unit, "uncertainty")


def _along(study: Study, found: StudyFindings) -> dict[str, Any]:
    along = found.along
    columns = {name: [_or_null(value) for value in getattr(along, name)] for name in ("repeatability", "reproducibility", "gauge", "part")}
    return {"station_mm": middles_mm(study, len(along.gauge)).tolist(), **{f"{name}_mm": values for name, values in columns.items()}}


def _or_null(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def middles_mm(study: Study, count: int) -> NDArray[np.float64]:
    """The middles (count,) of the even parts of the profile."""
    return np.asarray((np.arange(count) + 0.5) * (study.length_mm / count), dtype=np.float64)


# --- text ------------------------------------------------------------------------------------------------------------


def study_lines(study: Study, found: StudyFindings) -> Iterator[str]:
    """A study in lines of text."""
    yield f"{study.name}: {kind_words(study, found)}"
    for one in found.findings:
        yield ""
        yield f"{one.characteristic.name} ({one.characteristic.type}), {limits_words(one.characteristic)}"
        yield from (f"  {line}" for line in figures(one))
        unit, budget = one.characteristic.unit, one.budget
        yield f"  {'source of uncertainty':<66}{'type':>5}{f'u ({unit})':>12}{'df':>7}{'of u^2':>8}"
        for line in budget.sources:
            freedom = "inf" if line.freedom is None else str(line.freedom)
            yield f"  {line.source:<66}{line.evaluated:>5}{line.standard:>12.6f}{freedom:>7}{line.share:>8.1%}"
        yield f"  {result_words(one)}"
        yield f"  in a plan: {plan_words(study, one)}"
        yield from (f"  note: {note}" for note in one.notes)
    yield ""
    yield from along_words(study, found)
    yield from (f"note: {note}" for note in found.notes)


def kind_words(study: Study, found: StudyFindings) -> str:
    """What kind of study it is, and of how many measurements."""
    if study.kind == "type-1":
        return f"type-1 study of part {found.parts[0]}, {found.repeats} measurements"
    size = f"{len(found.parts)} parts, {len(found.operators)} operators ({', '.join(found.operators)}), {found.repeats} repeats"
    return f"crossed study (gauge R&R by analysis of variance): {size}"


def limits_words(asked: StudiedCharacteristic) -> str:
    """The limits of a characteristic."""
    lower, upper = ("none" if limit is None else f"{limit:g}" for limit in (asked.lower, asked.upper))
    return f"limits {lower} .. {upper} {asked.unit}"


def figures(one: StudyFinding) -> Iterator[str]:
    """The figures by which a gauge is called capable, in lines."""
    unit = one.characteristic.unit
    if (first := one.type_one) is not None:
        capable = f"not stated: {first.reason}" if first.cg is None or first.cgk is None else f"Cg = {first.cg:.2f}, Cgk = {first.cgk:.2f}"
        yield f"{capable} (1.33 is usually asked for)" if first.cg is not None else capable
        level = "" if first.level is None else f", level of the test that there is none {first.level:.3f}"
        yield f"mean {first.mean:.6f} {unit}, s = {first.sigma:.6f} {unit}, bias {first.bias:+.6f} {unit}{level}"
    if (crossed := one.crossed) is not None:
        gauge = crossed.line("gauge R&R")
        of_tolerance = "" if gauge.to_tolerance is None else f", {gauge.to_tolerance:.1%} of the tolerance"
        yield f"%GRR {gauge.to_total:.1%} of the total variation{of_tolerance}; ndc {crossed.categories}"
        yield "by AIAG below 10 % is good and above 30 % is not, and ndc is to be 5 or more"
        for name in ("repeatability", "reproducibility", "gauge R&R", "part"):
            line = crossed.line(name)
            yield f"{name:<16} s = {line.sigma:.6f} {unit}, {line.contribution:.1%} of the variance"


def result_words(one: StudyFinding) -> str:
    """U with its factor."""
    budget, asked = one.budget, one.characteristic
    freedom = "many" if budget.freedom is None else f"{budget.freedom:.0f} effective"
    return (
        f"u = {budget.standard:.6f} {asked.unit}, k = {budget.factor:.2f} ({freedom} degrees of freedom), "
        f"U = {budget.expanded:.6f} {asked.unit}"
    )


def plan_words(study: Study, one: StudyFinding) -> str:
    """The keys that a plan states U by with this characteristic, and where it comes from: its results tell the whole budget then."""
    asked, day = one.characteristic, max(run.measured_at for run in study.runs)[:10]
    sources = ", ".join(f"{line.source.partition(',')[0]} {line.standard:.2g}" for line in one.budget.sources if line.share >= _TELLING)
    told = f"the study {study.name} of {day} ({len(study.runs)} runs): u by {sources} {asked.unit}; k = {one.budget.factor:.2f}"
    return f"{plan_key(asked)}: {rounded_up(one.budget.expanded):g}, uncertainty_from: {json.dumps(told, ensure_ascii=False)}"


def rounded_up(value: float) -> float:
    """A number with two significant digits, no smaller than it was."""
    if not value > 0:
        return 0.0
    step = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(round(np.ceil(value / step - 1e-9) * step, 12))


def along_words(study: Study, found: StudyFindings) -> Iterator[str]:
    """Where along the profile the gauge spreads most."""
    gauge = found.along.gauge
    known = np.isfinite(gauge)
    if not known.any():
        yield "along the profile nothing can be said: no part of it was seen by every run"
        return
    where = middles_mm(study, len(gauge))
    worst = np.argsort(np.where(known, -gauge, np.inf), kind="stable")[: min(_MOST, int(known.sum()))]
    told = ", ".join(f"{gauge[k]:.6f} mm at {where[k]:.1f} mm" for k in worst)
    yield f"along the profile the gauge spreads by s = {np.median(gauge[known]):.6f} mm (median of {known.sum()} parts); most: {told}"
    if not known.all():
        yield f"{int((~known).sum())} of {len(gauge)} parts of the profile were not seen by every run"
