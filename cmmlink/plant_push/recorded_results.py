"""What the record of a station says of a run, as the results database stores it."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.errors import StoreError
from cmmlink.plan import Plan
from cmmlink.plant import ProfileStrip, StoredEvent, StoredRun, StoredValue, strip_of
from cmmlink.record import (
    Nominals,
    Record,
    RecordedRun,
    Store,
    derived_of,
    origin_of,
    recorded_plan,
    recorded_run,
    run_header,
    station_name,
    unpack_judged,
)
from inspection import NOT_JUDGED

JUDGED_AGAIN = "judged again"
_WORST_LAST = ("conform", "uncertain", "nonconform")
_DIGITS = 9  # mm and degrees: what the same record gives on every processor
_COUNTS = ("received", "judged", "rejected", "lost", "damaged_bytes")


def stored_run(store: Store, run: str, nominals: Nominals) -> StoredRun:
    """A run that has ended, with its values and its strip. Raises StoreError where its record cannot be read."""
    recorded = recorded_run(store, run)
    header, end, result = recorded.header, recorded.end, recorded.result
    if end is None:
        raise StoreError(f"{store.path}: run {run} has no end yet")
    plan = None if recorded.is_of_surface else recorded_plan(recorded)
    origin = origin_of(store, run)
    section = _section_of(header)
    counts = {"received": end["received"]} | {name: (result or {}).get(name) for name in _COUNTS if result}
    return StoredRun(
        station=_clean(header.get("station") or station_name(None)),
        run=run,
        part=part_of(recorded),
        section=section,
        serial_number=_clean(header["serial_number"]),
        operator=_clean(header["operator"]),
        started=datetime.fromisoformat(header["started"]),
        state=end["state"],
        verdict=end["verdict"],
        software=f"cmmlink {header['software'].get('cmmlink')}",
        chain_sha256=recorded.chain_sha256 if origin is None else origin.chain_sha256,
        plan_sha256=header["plan_sha256"],
        nominal_sha256=header["nominal_sha256"],
        **{name: counts.get(name) for name in _COUNTS},
        simulated=header["simulated"],
        values=tuple(_values(plan, result or {}, section)),
        strip=None if plan is None or result is None else _strip(store, recorded, plan, result, nominals),
    )


def stack_ended_by(store: Store, run: str) -> str | None:
    """The id of the stack that a run is the last section of; None for other runs, and where the stack is not whole or asks for nothing.

    Raises StoreError where a record cannot be read.
    """
    place = run_header(store, run).get("stack")
    if not place or place["section"] != place["sections"]:
        return None
    from cmmlink.stack_again import whole_stack  # noqa: PLC0415 - few runs are sections, and this loads what judges

    found = whole_stack(store, recorded_run(store, run))
    return None if found is None else found[0]


def stored_stack(store: Store, last: str, nominals: Nominals) -> StoredRun:
    """A stack of sections as a run of its own, from the last of its sections.

    Its hash is that of the end of this section, which stands on all before it. Raises StoreError where a record cannot be read, and where a
    section does not come out as it is on record: then nothing is said of the stack.
    """
    from cmmlink.stack_again import judge_stack_again, whole_stack  # noqa: PLC0415 - likewise

    found = whole_stack(store, recorded_run(store, last))
    assert found is not None
    stack, sections = found
    again = judge_stack_again(store, sections, nominals)
    if again.lost:
        told = f"judged again by this version, {len(again.lost)} sections are not what is on record, the first of them run {again.lost[0]}"
        raise StoreError(f"{store.path}: stack {stack}: {told}")
    runs = [stored_run(store, one.run, nominals) for one in sections]
    counts: dict[str, Any] = {name: _sum([getattr(run, name) for run in runs]) for name in _COUNTS}
    words = [one["verdict"] for one in again.characteristics] + [run.verdict or "uncertain" for run in runs]
    return replace(
        runs[-1],
        run=stack,
        section="",
        started=runs[0].started,
        state=next((run.state for run in runs if run.state != "complete"), "complete"),
        verdict=max(words, key=_WORST_LAST.index),
        nominal_sha256=runs[0].nominal_sha256,
        plan_sha256=hashlib.sha256(sections[0].header["stack"]["plan"].encode()).hexdigest(),
        values=tuple(_to_last_digit(one) for one in _values(None, {"characteristics": again.characteristics}, "")),
        strip=None,
        **counts,
    )


def _to_last_digit(one: StoredValue) -> StoredValue:
    """A value that was worked out again, without its last bits: they are another processor's own."""
    return replace(one, value=None if one.value is None else round(one.value, _DIGITS))


def _sum(counts: Sequence[int | None]) -> int | None:
    """The sum; None where one of them is not known."""
    known = [count for count in counts if count is not None]
    return sum(known) if len(known) == len(counts) else None


def characteristics_of(recorded: RecordedRun) -> list[str]:
    """The names of the characteristics of a run, as the database has them."""
    return [_named(one, _section_of(recorded.header)) for one in (recorded.result or {}).get("characteristics", ())]


def part_of(recorded: RecordedRun) -> str:
    """The name of the part of a run, as the database has it."""
    return _clean(recorded.header["part"])


def station_of(store: Store, run: str) -> str:
    """The name of the station that measured a run, as the database has it. Raises StoreError where its record cannot be read."""
    return _clean(run_header(store, run).get("station") or station_name(None))


def judged_again(store: Store, record: Record) -> StoredEvent:
    """A judgement of a run that was made later, as an event, from the record that keeps it. Raises StoreError where it cannot be read."""
    station = station_of(store, record.run)
    told = next((one for one in derived_of(store, record.run) if one["chain_sha256"] == record.sha256.hex()), None)
    if told is None:
        raise StoreError(f"{store.path}: record {record.number} is no judgement of run {record.run}")
    changes = ", ".join(f"{one['key']} {one['recorded']} -> {one['replayed']}" for one in told["changed"])
    return StoredEvent(
        key=f"{station} {record.run} {hashlib.sha256(record.body).hexdigest()}",
        at=datetime.fromisoformat(told["when"]),
        kind=JUDGED_AGAIN,
        words=_clean(f"{told['verdict']}: {changes}; {told['why']}"),
        station=station,
        part=_clean(run_header(store, record.run)["part"]),
        run=record.run,
        who=_clean(told["who"]),
    )


def _values(plan: Plan | None, result: Mapping[str, Any], section: str) -> Iterator[StoredValue]:
    """The characteristics of a result, with limits of the value itself."""
    asked = () if plan is None else plan.characteristics
    varying = {one.name for one in asked if one.type == "line-profile" and one.zone.stations_mm is not None}
    for one in result.get("characteristics", ()):
        value, lower, upper, unit = _with_limits(one, one["name"] in varying)
        uncertainty = one["uncertainty"] if unit == one["unit"] else None
        yield StoredValue(_named(one, section), one["type"], unit, value, lower, upper, uncertainty, one["verdict"])


def _section_of(header: Mapping[str, Any]) -> str:
    """Of a section of a surface its height; empty for every other run."""
    place = header.get("stack")
    return f"{place['height_mm']:.3f}" if place else ""


def _named(one: Mapping[str, Any], section: str) -> str:
    """The name of a characteristic, of a section of a surface with its height."""
    return _clean(one["name"]) + (f" at {section}" if section else "")


def _with_limits(one: Mapping[str, Any], varying: bool) -> tuple[float | None, float | None, float | None, str]:
    """Value, limits and unit: of a profile the width that is used, of a zone that varies the share of it, else the number itself."""
    lower, upper, nominal = one["lower"], one["upper"], one.get("nominal")
    if varying:
        return one["consumption"], None, 1.0, "1"
    if one["type"] == "line-profile":
        return one["value"], None, None if lower is None or upper is None else upper - lower, one["unit"]
    lower, upper = (None if nominal is None or limit is None else nominal + limit for limit in (lower, upper))
    return one["value"], lower, upper, one["unit"]


def _strip(store: Store, recorded: RecordedRun, plan: Plan, result: Mapping[str, Any], nominals: Nominals) -> ProfileStrip | None:
    """The deviations along the profile; None where nothing was judged."""
    if not result["judged"]:
        return None
    zone = result.get("tolerance") or {}
    length_mm = nominals.of(plan, recorded).length_mm
    return strip_of(_judged(store, recorded.run), length_mm, zone.get("lower_mm"), zone.get("upper_mm"))


def _judged(store: Store, run: str) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Stations and deviations of the points that have a verdict, some thousands at a time."""
    for record in store.records(run, "deviations"):
        rows = unpack_judged(record.body)
        judged = rows.verdicts != NOT_JUDGED
        yield rows.station_mm[judged], rows.deviation_mm[judged]


def _clean(text: str) -> str:
    """The text without what a database cannot hold: a zero byte, and halves of signs."""
    return text.replace("\x00", "\\x00").encode("utf-8", "backslashreplace").decode()
