"""What is known of a run before it begins, for whoever shows it: its number or title, its plan, and what the points are judged by."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from cmmlink.characteristics import base_row
from cmmlink.events import Counts
from cmmlink.from_plan import zone_of
from cmmlink.plan import Plan, SurfacePlan
from cmmlink.run_state import RunKind
from cmmlink.shown_section import ShownSection
from inspection import NominalProfile, ToleranceZone

if TYPE_CHECKING:  # who shows sections alone loads nothing of surfaces
    from cmmlink.nominal_files.surface_file import SurfaceFile
    from cmmlink.shown_surface import ShownSurface
    from inspection.surface import NominalSurface, SurfaceResult


@dataclass(frozen=True, slots=True, eq=False)
class RunContext:
    """What is known of a run before it begins: its number or title, its plan, and what the points are judged by.

    nominal : a section or a whole surface
    base : the place of the characteristic that fails wherever a point is proven to be out of the zone; None where none need fail
    answers : a machine waits for the verdict
    gap_max_mm  : of a whole surface the diameter of the widest place without a point that counts as measured
    document_of : says what is told of the result of a whole surface
    """

    number: str
    plan: str
    nominal: "NominalProfile | NominalSurface"
    zone: ToleranceZone
    coverage_min: float
    buffer_points: int
    began: datetime
    kind: RunKind = "run"
    base: int | None = 0
    answers: bool = False
    gap_max_mm: float = math.nan
    document_of: "Callable[[SurfaceResult | None, Counts], Mapping[str, Any]] | None" = None

    @classmethod
    def of(cls, plan: Plan, profile: NominalProfile, began: datetime, number: str, plan_name: str, kind: RunKind = "run") -> "RunContext":
        """What a plan says of a run that begins, or began, at a time of day."""
        zone, coverage_min = zone_of(plan, profile), plan.registration.coverage_min
        answers = plan.answer is not None and kind == "run"
        return cls(number, plan_name, profile, zone, coverage_min, plan.buffer_points, began, kind, base_row(plan), answers)

    @classmethod
    def of_surface(
        cls,
        plan: SurfacePlan,
        file: "SurfaceFile",
        document_of: "Callable[[SurfaceResult | None, Counts], Mapping[str, Any]]",
        began: datetime,
        number: str,
        plan_name: str,
        kind: RunKind = "run",
    ) -> "RunContext":
        """What the plan of a whole surface says of a run; `document_of` says what is told of its result."""
        from cmmlink.from_surface_plan import held_against, terms_of  # noqa: PLC0415 - who shows sections alone loads nothing of surfaces

        nominal, terms = held_against(plan, file), terms_of(plan)
        return cls(
            number,
            plan_name,
            nominal,
            terms.zone_on(nominal),
            plan.registration.coverage_min,
            plan.buffer_points,
            began,
            kind,
            gap_max_mm=terms.limits_on(nominal).gap_max_mm,
            document_of=document_of,
        )

    @property
    def length_mm(self) -> float:
        """The length of the section; 0 of a whole surface, which has none."""
        return self.nominal.length_mm if isinstance(self.nominal, NominalProfile) else 0.0

    def shown(self) -> "ShownSection | ShownSurface":
        """What is shown of its points, before there are any."""
        if isinstance(self.nominal, NominalProfile):
            return ShownSection(self.nominal, self.zone)
        from cmmlink.shown_surface import ShownSurface  # noqa: PLC0415 - who shows sections alone loads nothing of surfaces

        return ShownSurface(self.nominal, self.zone, self.gap_max_mm)
