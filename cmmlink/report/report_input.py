"""Everything that a report is made of: the result as JSON holds it, the judged points, and how the report is to look."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, get_args

from cmmlink.plan import CtPlan, Plan, ReportSettings, SurfacePlan
from cmmlink.report.picture_content import NamedRegion, PictureContent
from cmmlink.words import Headline, headline_of
from inspection import DecisionRule, ToleranceZone, Verdict

if TYPE_CHECKING:  # a process that only draws loads nothing of what judges
    from cmmlink.run import FinishedRun
    from cmmlink.run_trends import RunTrend
    from cmmlink.surface_run import FinishedSurface

_VERDICTS = {verdict.word: verdict for verdict in Verdict}


@dataclass(frozen=True, slots=True, eq=False)
class ReportInput:
    """What a report is made of; the same for a run that has just ended and for the same run on record.

    document : the result with the keys of result.json
    message  : what ended the run early, or why it has no result; empty where there is nothing to say
    content  : what its drawings show; None where no point was judged
    trends   : the trends that the run ends, each with a page of its own
    """

    document: Mapping[str, Any]
    plan: Plan | CtPlan | SurfacePlan
    message: str = ""
    content: PictureContent | None = None
    trends: "tuple[RunTrend, ...]" = ()

    @property
    def settings(self) -> ReportSettings:
        """How the report is to look."""
        return self.plan.report

    @property
    def headline(self) -> Headline:
        """The verdict on the part, or how early the run ended."""
        document = self.document
        ending, verdict = document.get("ending", "complete"), _VERDICTS[document["verdict"]]
        return headline_of(verdict if document["rule"] is not None else None, ending, document["coverage"])

    @property
    def nominal_name(self) -> str:
        """The name of the nominal's file."""
        plan = self.plan
        return (plan.surface if isinstance(plan, SurfacePlan) else plan.nominal).file.name

    @property
    def title(self) -> str:
        """The part and its serial number."""
        return " ".join(filter(None, [self.document.get("part"), self.document.get("serial_number")]))


def input_of(run: "FinishedRun") -> ReportInput:
    """What the report of a run that has just ended is made of, without what its drawings show."""
    outcome = run.outcome
    return ReportInput(run.result_json(), run.plan, str(outcome.failure or outcome.refusal or ""))


def input_of_surface(run: "FinishedSurface") -> ReportInput:
    """What the report of a run of a whole surface that has just ended is made of."""
    outcome = run.outcome
    return ReportInput(run.result_json(), run.plan, str(outcome.failure or outcome.refusal or ""))


def with_settings(report: ReportInput, settings: Mapping[str, Any]) -> ReportInput:
    """Give the same with some settings of its look replaced."""
    look = report.plan.report.model_copy(update=dict(settings))
    return replace(report, plan=report.plan.model_copy(update={"report": look}))


def places_in(document: Mapping[str, Any]) -> list[tuple[float, float]]:
    """The places in a result that values of its characteristics were found at."""
    return [(place["x_mm"], place["y_mm"]) for one in document.get("characteristics", ()) for place in one["places"]]


def regions_in(document: Mapping[str, Any]) -> tuple[NamedRegion, ...]:
    """The named regions of the characteristics of a result."""
    found = [(one["name"], one["region"]) for one in document.get("characteristics", ()) if one["region"] is not None]
    return tuple(NamedRegion(name, region["from_mm"], region["to_mm"]) for name, region in found)


def zone_in(tolerance: Mapping[str, Any]) -> ToleranceZone:
    """The zone of a result, whose decision rule JSON holds in words."""
    limits = tolerance["lower_mm"], tolerance["upper_mm"], tolerance["uncertainty_mm"]
    zones = [ToleranceZone(*limits, rule, provable=False) for rule in get_args(DecisionRule)]
    return next((zone for zone in zones if zone.decision_rule == tolerance["decision_rule"]), zones[0])
