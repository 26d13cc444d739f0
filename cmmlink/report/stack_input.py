"""What the report and the map of a stack are made of; the same for one that was just inspected and for one whose sections are on record."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.plan import CtPlan
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture_content import PictureContent, content_of
from cmmlink.report.report_input import ReportInput, places_in, regions_in
from cmmlink.stack import SectionOutcome, StackOutcome
from cmmlink.stack_characteristics import stack_characteristic_json
from inspection import ToleranceZone

Array = NDArray[np.float64]

MAP_COLUMNS = 600  # of the map


@dataclass(frozen=True, slots=True, eq=False)
class MapRow:
    """A section on the map.

    deviation_mm : (c,) farthest from the middle of the zone in each column; NaN where nothing was judged
    out          : shares of the length at which stretches out of tolerance have their middles, and whether they lie above the zone
    """

    height_mm: float
    length_mm: float
    deviation_mm: Array
    out: tuple[tuple[float, bool], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class SectionSheet:
    """A section of a stack as its report takes it.

    number   : its place in the stack, from 1
    document : the keys of result.json, with height_mm, run and the notes on the section alone
    message  : why it has no result; empty where there is nothing to say
    draw     : gives what its drawings show; None where nothing was judged
    """

    number: int
    document: Mapping[str, Any]
    message: str
    row: MapRow
    draw: Callable[[], PictureContent | None]

    @property
    def badness(self) -> float:
        """How bad it is, so that the worst of many can be chosen; one without a result is worst of all."""
        found = self.document["zone_error_mm"]
        return math.inf if found is None else float(found)


@dataclass(frozen=True, slots=True, eq=False)
class StackInput:
    """What the report of a stack is made of. `asked` is how many sections the plan asks for; `notes` apply to all of them.

    document : verdict, ending and measured_at of the whole, its software, and which runs its sections are
    characteristics : those of the stack, as `ct --json` has them
    """

    plan: CtPlan
    document: Mapping[str, Any]
    sections: tuple[SectionSheet, ...]
    asked: int
    notes: tuple[str, ...]
    characteristics: tuple[Mapping[str, Any], ...] = ()

    @property
    def zone(self) -> ToleranceZone:
        """The zone that the map is coloured by."""
        return self.plan.zone

    def with_settings(self, settings: Mapping[str, Any]) -> "StackInput":
        """Give the same with some settings of the look of its report replaced."""
        look = self.plan.report.model_copy(update=dict(settings))
        return replace(self, plan=self.plan.model_copy(update={"report": look}))

    def whole(self) -> ReportInput:
        """The stack as the head of its report takes it."""
        part = {"part": self.plan.part.name, "serial_number": self.plan.part.serial_number, "device": self.plan.mesh.file.name}
        reasons = [{"words": f"{one['name']}: {reason['words']}"} for one in self.characteristics for reason in one["reasons"]]
        out = sum(section.document["verdict"] != "conform" for section in self.sections)
        if out:
            reasons.insert(0, {"words": f"{out} of {self.asked} sections do not conform or are not proven."})
        if len(self.sections) < self.asked:
            reasons.append({"words": f"Only {len(self.sections)} of {self.asked} sections were inspected."})
        share = len(self.sections) / self.asked
        known = {"coverage": share, "rule": "sections", "reasons": reasons, "characteristics": self.characteristics}
        return ReportInput({**self.document, **part, **known}, self.plan)


def input_of_stack(stack: StackOutcome, plan: CtPlan) -> StackInput:
    """What the report of a stack that was just inspected is made of."""
    found = stack.result_json()
    evidence = [section.evidence for section in stack.sections if section.evidence]
    document = {
        **{name: found[name] for name in ("verdict", "ending", "measured_at", "qualification")},
        "run": runs_words([one.run for one in evidence]),
        "software": dict(evidence[0].software) if evidence else None,
    }
    sections = tuple(_sheet_of(number, section) for number, section in enumerate(stack.sections, start=1))
    of_stack = tuple(stack_characteristic_json(one) for one in stack.characteristics)
    return StackInput(plan, document, sections, stack.asked, stack.notes, of_stack)


def runs_words(runs: list[str]) -> str | None:
    """The first and the last run of a stack; None where none was recorded."""
    return " .. ".join(dict.fromkeys([runs[0], runs[-1]])) if runs else None


def _sheet_of(number: int, section: SectionOutcome) -> SectionSheet:
    result = section.run.result
    document = section.result_json() | {"notes": list(section.warnings)}

    def draw() -> PictureContent | None:
        if result is None or not result.judged:
            return None
        regions, places = regions_in(document), places_in(document)
        return content_of(scan_of(result), section.profile, "", section.run.ending, regions=regions, places_mm=places)

    return SectionSheet(number, document, str(section.run.refusal or ""), map_row_of(section), draw)


def map_row_of(section: SectionOutcome) -> MapRow:
    """A section that was just inspected on the map."""
    result, height_mm, length_mm = section.run.result, section.slice.height_mm, section.profile.length_mm
    if result is None:
        return MapRow(height_mm, length_mm, np.full(MAP_COLUMNS, np.nan))
    stretches = ((stretch.from_mm, stretch.to_mm, stretch.worst_mm) for stretch in result.stretches)
    return map_row(height_mm, length_mm, result.station_mm, result.deviation_mm, stretches, result.zone.middle_mm)


def map_row(
    height_mm: float,
    length_mm: float,
    station_mm: Array,
    deviation_mm: Array,
    stretches: Iterable[tuple[float, float, float]],
    middle_mm: float,
) -> MapRow:
    """A section on the map: its points (m,), NaN where not judged, and its stretches out of tolerance as (from, to, worst) in mm."""
    row = np.full(MAP_COLUMNS, np.nan)
    judged = np.flatnonzero(np.isfinite(deviation_mm))
    judged = judged[np.argsort(np.abs(deviation_mm[judged] - middle_mm))]
    column = np.clip((station_mm[judged] / length_mm * MAP_COLUMNS).astype(int), 0, MAP_COLUMNS - 1)
    row[column] = deviation_mm[judged]  # where several share a column, the last one is kept, which is the farthest
    middles = (((start + (end - start) % length_mm / 2) % length_mm / length_mm, worst > middle_mm) for start, end, worst in stretches)
    return MapRow(height_mm, length_mm, row, tuple(middles))
