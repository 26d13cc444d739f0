"""A recorded run as a measurement of a study: its values, its deviations along the profile, and what its plan states of the uncertainty.

What a budget of the plan comes to for each characteristic is found by judging the run again with one source of it at a time: so it holds
for whatever the characteristic is worked out from, by the same propagation as the U of every run.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from cmmlink.errors import PlanError, RunError
from cmmlink.exports import document_on_record, judged_rows, sound_run
from cmmlink.plan import Plan
from cmmlink.plant import StudiedCharacteristic, Study, StudyRun, strip_of
from cmmlink.record import RecordedRun, Store, recorded_plan, recorded_profile, replay_run
from drivers import Decoder

Decoders = Callable[[Plan], Decoder | None]

_SOURCES = ("device", "calibrated tip radius", "temperature of the part", "coefficient of expansion")
_NOTHING = "1e-12"  # a budget must state something: so small a repeatability counts for nothing


def with_run(study: Study, store: Store, run: str, decoder_of: Decoders, part: str | None, operator: str | None) -> Study:
    """The study with one more run. The first run says which characteristics are studied: those that have a value.

    part, operator : the names that it counts under; None: its serial number, and who measured it

    Raises PlanError where it does not belong to the study, RunError where it has no result.
    """
    recorded = sound_run(store, run)
    profile = recorded_profile(recorded_plan(recorded), recorded)
    document = document_on_record(store, recorded, profile)
    if recorded.result is None or document["ending"] != "complete":
        raise RunError(f"run {run} did not come to its end: a study needs whole measurements; measure that part again")
    if any(one.run == run for one in study.runs):
        raise PlanError(f"run {run} is in the study already")
    found = {one["name"]: one for one in document["characteristics"]}
    if not study.runs:
        stated = _stated(store, recorded, decoder_of, found)
        asked = tuple(_studied(one, stated.get(name, {})) for name, one in found.items() if one["value"] is not None)
        study = replace(study, characteristics=asked, length_mm=profile.length_mm)
        if missing := [name for name in study.references if name not in found]:
            raise PlanError(f"run {run} has no characteristic {missing[0]}, whose reference value is stated; it has {', '.join(found)}")
    _check(study, run, found, profile.length_mm)
    strip = strip_of(((rows.station_mm, rows.deviation_mm) for rows in judged_rows(store, run)), profile.length_mm, None, None)
    one = StudyRun(
        run=run,
        chain_sha256=recorded.chain_sha256,
        measured_at=document["measured_at"],
        part=part or document["serial_number"] or _lacks(run, "part", "serial number"),
        operator=operator or document["operator"] or (_lacks(run, "operator", "operator") if study.kind == "crossed" else ""),
        values={asked.name: found[asked.name]["value"] for asked in study.characteristics},
        strip_mm=tuple(None if math.isnan(value) else round(value, 7) for value in strip.mean_mm.tolist()),
    )
    return replace(study, runs=(*study.runs, one))


def _lacks(run: str, option: str, what: str) -> str:
    raise PlanError(f"run {run} has no {what} on record; expected --{option} NAME, under which it counts in the study")


def _studied(found: Mapping[str, object], stated: Mapping[str, float]) -> StudiedCharacteristic:
    name, kind, unit, lower, upper = (found[key] for key in ("name", "type", "unit", "lower", "upper"))
    low, high = (float(limit) if isinstance(limit, int | float) else None for limit in (lower, upper))
    return StudiedCharacteristic(str(name), str(kind), str(unit), low, high, dict(stated))


def _check(study: Study, run: str, found: Mapping[str, Mapping[str, object]], length_mm: float) -> None:
    """Raise PlanError where a run was judged by something else than those before it."""
    if abs(length_mm - study.length_mm) > 1e-9 * study.length_mm:
        raise PlanError(f"run {run} has another nominal than the study: {length_mm:.6g} mm long, not {study.length_mm:.6g} mm")
    for asked in study.characteristics:
        here = found.get(asked.name)
        if here is None or here["value"] is None:
            raise PlanError(f"run {run} has no value of {asked.name}: repeat that measurement, or begin a study without it")
        if _studied(here, {}).judged_by != asked.judged_by:
            raise PlanError(f"run {run} has other limits of {asked.name} than the study: judge it again by the same plan first")


# --- what the plan states ---------------------------------------------------------------------------------------------


def _stated(
    store: Store, recorded: RecordedRun, decoder_of: Decoders, found: Mapping[str, Mapping[str, object]]
) -> dict[str, dict[str, float]]:
    """Standard uncertainties of each characteristic by their source, as far as its plan states any."""
    plan = recorded_plan(recorded)
    of_itself = {asked.name: _own(asked) for asked in plan.characteristics if _own(asked) > 0}
    stated = {name: {"stated in the plan": own / 2} for name, own in of_itself.items()}
    others = [name for name in found if name not in stated]
    if plan.uncertainty is None:
        plain = {name: _number(found[name]["uncertainty"]) for name in others}
        return stated | {name: {"stated in the plan": value / 2} for name, value in plain.items() if value > 0}
    factor = plan.uncertainty.coverage_factor
    left = _expanded(store, recorded, decoder_of, dict(_without(plan, "")))
    by_source = {source: _expanded(store, recorded, decoder_of, dict(_without(plan, source))) for source in _sources(plan)}
    for name in others:
        sources = {source: max(0.0, found_u[name] - left[name]) / factor for source, found_u in by_source.items()}
        stated[name] = sources | ({"growth that was not compensated": left[name] / 2} if left[name] > 1e-9 else {})
    return stated


def _own(asked: object) -> float:
    """The U that a plan states with a characteristic itself."""
    return max((_number(getattr(asked, key, None)) for key in ("uncertainty_mm", "uncertainty_deg", "uncertainty")), default=0.0)


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else 0.0


def _sources(plan: Plan) -> Sequence[str]:
    """The sources that its budget states something of, but its repeatability, which the study finds itself."""
    stated = plan.uncertainty
    assert stated is not None
    warm = plan.temperature or stated.temperature
    says = (
        stated.mpe is not None,
        stated.tip_radius_mm > 0,
        warm is not None and warm.u_part_k > 0,
        warm is not None and warm.u_cte_per_k > 0,
    )
    return [source for source, is_stated in zip(_SOURCES, says, strict=True) if is_stated]


def _without(plan: Plan, kept: str) -> Iterator[tuple[str, str]]:
    """What to set in a plan so that its budget holds one source alone; none where it is empty."""
    yield "uncertainty.repeatability_mm", _NOTHING
    assert plan.uncertainty is not None
    warm = "temperature" if plan.temperature is not None else "uncertainty.temperature"
    keys = {"device": ("uncertainty.mpe", "null"), "calibrated tip radius": ("uncertainty.tip_radius_mm", "0")}
    if plan.temperature is not None or plan.uncertainty.temperature is not None:
        keys |= {"temperature of the part": (f"{warm}.u_part_k", "0"), "coefficient of expansion": (f"{warm}.u_cte_per_k", "0")}
    for source, setting in keys.items():
        if source != kept:
            yield setting


def _expanded(store: Store, recorded: RecordedRun, decoder_of: Decoders, settings: Mapping[str, str]) -> dict[str, float]:
    """U of every characteristic with another budget."""
    again = replay_run(store, recorded, decoder_of, settings=settings)
    return {one["name"]: _number(one["uncertainty"]) for one in again.result_json["characteristics"]}
