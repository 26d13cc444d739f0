"""One common fit of the sections of a stack: where all of them lie together, after each was measured on its own.

A blade is one body: sections that are each fitted on its own hide how they lie to one another. By a common fit one motion places them
all, and each is judged where that leaves it, as at a known pose.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from cmmlink.pipeline import RunOutcome
from cmmlink.plan import CtPlan, Datum
from drivers.surface import SurfaceSection
from inspection import NOT_JUDGED, NominalProfile, Reason, RigidTransform, SectionToFit, fit_together


class FittedSection(Protocol):
    """A section that was measured on its own."""

    @property
    def slice(self) -> SurfaceSection:
        """Where it was cut."""

    @property
    def profile(self) -> NominalProfile:
        """Its nominal."""

    @property
    def run(self) -> RunOutcome:
        """What was found of it."""


class Common(NamedTuple):
    """A plan with the common pose as its datum, what it says of how that was found, and why nothing is proven there, if so."""

    plan: CtPlan
    words: str
    doubt: Reason | None


def placed_at(plan: CtPlan, pose: RigidTransform) -> CtPlan:
    """The plan with a pose as its datum."""
    x, y = (float(value) for value in pose.translation_mm)
    datum = Datum(rotation_deg=math.degrees(pose.rotation_rad), translation_mm=(x, y))
    return plan.model_copy(update={"registration": plan.registration.model_copy(update={"datum": datum, "fit": "none"})})


def fit_sections(plan: CtPlan, sections: Sequence[FittedSection], asked: int) -> Common:
    """The common fit of sections, each at its own best fit, of so many asked for. Raises RegistrationError where none has a result."""
    told, parts = list[str](), list[SectionToFit]()
    if len(sections) < asked:
        told.append(f"only {len(sections)} of {asked} sections were measured")
    for section in sections:
        result, height = section.run.result, f"{section.slice.height_mm:g} mm"
        if result is None:
            told.append(f"the section at {height} has no result")
            continue
        points = result.section_at(np.flatnonzero(result.verdicts != NOT_JUDGED))
        parts.append(SectionToFit(points, section.profile, result.registration.nominal_from_section))
        if section.run.ending != "complete":
            told.append(f"the section at {height} was not inspected to its end")
        if result.gap.length_mm > result.gap_max_mm * (1 + 1e-9):
            told.append(f"of the section at {height} {result.gap.length_mm:.4g} mm in a row were not measured")
        if result.registration.rivals:
            told.append(f"the section at {height} fits its nominal in another pose as well")
    if not parts and sections[0].run.refusal is not None:
        raise sections[0].run.refusal
    fit = fit_together(parts, plan.zone.middle_mm, plan.weights, plan.registration.method)
    if not fit.converged:
        told.append("it did not settle")
    (x, y), turned = fit.nominal_from_section.translation_mm.tolist(), math.degrees(fit.nominal_from_section.rotation_rad)
    words = (
        f"all sections are placed by one motion, the best fit of {len(parts)} of them together (weights {plan.weights}): turned "
        f"{turned:.6f} deg, moved ({x:.6f}, {y:.6f}) mm, rms {fit.rms_mm:.6f} mm; what another motion would give is not proven"
    )
    doubt = f"The common fit of the sections is not sure, for {told[0]}{f', and {len(told) - 1} more' if told[1:] else ''}." if told else ""
    return Common(placed_at(plan, fit.nominal_from_section), words, Reason("outline", doubt) if doubt else None)
