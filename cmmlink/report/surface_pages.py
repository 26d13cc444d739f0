"""The pages of the report of a whole surface: what it rests on, its regions, what was not measured, and the conditions."""

from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from typing import Any

from reportlab.platypus import Flowable, Image, PageBreak, Spacer

from cmmlink.report.first_page import identity_block, points_fact, rules_table, verdict_block
from cmmlink.report.further_pages import evidence_facts
from cmmlink.report.page_parts import NUMBER, SMALL, TITLE, grid, headed, text
from cmmlink.report.report_input import ReportInput
from cmmlink.report.speech import Speech
from cmmlink.report.surface_content import SurfaceContent
from cmmlink.report.surface_picture import surface_png

_MOST_LISTED = 60
_LEAST_PICTURE_PT = 330.0
_LABEL_PT = 110.0


def surface_pages(report: ReportInput, content: SurfaceContent | None, say: Speech, width: float, height: float) -> list[Flowable]:
    """Everything that stands on the pages; the picture takes the room that is left on the first one, or a page of its own."""
    document = report.document
    parts: list[Flowable] = [verdict_block(report, say, width), Spacer(1, 2), identity_block(report, say, width), Spacer(1, 5)]
    if document["rule"] is not None and document["judged"]:
        parts += [rules_table(report, say, width), Spacer(1, 5)]
    parts.append(_table(_facts(document, say), width))
    if content is not None:
        room = height - sum(part.wrap(width, height)[1] for part in parts) - 8
        parts += [Spacer(1, 4), _picture(content, say, width, room if room >= _LEAST_PICTURE_PT else height)]
    return [*parts, PageBreak(), *_regions(document, say, width), *_unmeasured(document, say, width), *_conditions(report, say, width)]


def _picture(content: SurfaceContent, say: Speech, width: float, room: float) -> Image:
    picture = Image(BytesIO(surface_png(content, say)))
    share = min(width / picture.drawWidth, room / picture.drawHeight)
    picture.drawWidth, picture.drawHeight = share * picture.drawWidth, share * picture.drawHeight
    return picture


def _table(lines: Iterator[tuple[str, str]], width: float) -> Flowable:
    return grid([[text(name, SMALL), text(told)] for name, told in lines if told], [_LABEL_PT, width - _LABEL_PT], head=0)


def _facts(document: Mapping[str, Any], say: Speech) -> Iterator[tuple[str, str]]:
    """Names and words of what the verdict rests on."""
    if document["rule"] is not None:
        yield from _facts_of_result(document, say)
    yield points_fact(document, say)


def _facts_of_result(document: Mapping[str, Any], say: Speech) -> Iterator[tuple[str, str]]:
    worst, nominal, n = document["worst"], document["nominal"], say.number
    if worst is not None:
        place = _place([worst[key] for key in ("x_mm", "y_mm", "z_mm")], say)
        told = say("{deviation} mm at {place} mm", deviation=n(worst["deviation_mm"], "+.4f"), place=place)
        out = say(
            "{count} points out of tolerance, in {regions} regions", count=document["out_of_tolerance"], regions=len(document["regions"])
        )
        yield say("Worst point"), f"{told}; {out}"
    error, rms = n(document["profile_error_mm"]), n(document["rms_mm"])
    yield say("Surface error"), say("{error} mm (2 x the largest |deviation|); rms {rms} mm", error=error, rms=rms)
    yield say("Decision rule and U"), say.sentence(document["tolerance"]["decision_rule"])
    yield (
        say("Error of the nominal"),
        say("{error} mm, added to U", error=n(nominal["error_mm"], ".2g")) if nominal["error_mm"] else say("none"),
    )
    yield say("Fit"), say("{fit}, rule {rule}", fit=say.sentence(document["fit"]), rule=say.sentence(document["rule"]))
    yield say("Weakest direction"), weakest_words(document["registration"], say)
    yield (
        say("Coverage"),
        say(
            "{coverage} of {area} mm\u00b2; widest place without points {gap} mm, {allowed} mm count as measured",
            coverage=n(document["coverage"], ".1%"),
            area=n(nominal["area_mm2"], ".6g"),
            gap=n(document["widest_gap_mm"], ".3g"),
            allowed=n(document["gap_max_mm"], ".3g"),
        ),
    )


def weakest_words(registration: Mapping[str, Any], say: Speech) -> str:
    """The motion of the part that the points fix the least."""
    direction = registration["weakest_direction"]
    if direction is None:
        return say("the pose was known, nothing was fitted")
    direction = say.sentence(direction)
    if registration["undetermined"]:
        return say("{direction}: the points leave it free", direction=direction)
    return say("{direction}: known to {shift} mm (95 %)", direction=direction, shift=say.number(registration["weakest_95_mm"], ".2g"))


def _place(place: Sequence[float], say: Speech) -> str:
    return "(" + "; ".join(say.number(value, ".3f") for value in place) + ")"


def _regions(document: Mapping[str, Any], say: Speech, width: float) -> list[Flowable]:
    """The regions out of tolerance, with the numbers that they have in the picture."""
    if not (regions := document["regions"]):
        return []
    zone = document["tolerance"]
    names = ("No.", "Worst (mm)", "Out by (mm)", "Area (mm\u00b2)", "Points", "Face", "Worst at x; y; z (mm)")
    rows = []
    for number, one in enumerate(regions[:_MOST_LISTED], start=1):
        out = max(zone["lower_mm"] - one["worst_mm"], one["worst_mm"] - zone["upper_mm"])
        told = [
            say.number(one["worst_mm"], "+.4f"),
            say.number(out),
            say.number(one["area_mm2"], ".3f"),
            str(one["points"]),
            str(one["face"]),
        ]
        rows.append([text(number), *(text(value, NUMBER) for value in told), text(_place(one["worst_at_mm"], say))])
    table = grid([headed([say(name) for name in names], range(1, 6)), *rows], [30, 68, 68, 68, 55, 40, width - 329])
    title = text(say("Regions out of tolerance, the worst first"), TITLE)
    return [title, table, *_more(len(regions) - len(rows), say), Spacer(1, 6)]


def _unmeasured(document: Mapping[str, Any], say: Speech, width: float) -> list[Flowable]:
    """The parts of the surface that were not measured."""
    if not (places := document["unmeasured"]):
        return []
    names = ("No.", "Area (mm\u00b2)", "Width (mm)", "Face", "Around x; y; z (mm)")
    rows = []
    for number, one in enumerate(places[:_MOST_LISTED], start=1):
        told = [say.number(one["area_mm2"], ".2f"), say.number(one["width_mm"], ".3g"), str(one["face"])]
        rows.append([text(number), *(text(value, NUMBER) for value in told), text(_place(one["centre_mm"], say))])
    table = grid([headed([say(name) for name in names], range(1, 4)), *rows], [30, 80, 80, 50, width - 240])
    return [text(say("Not measured, the largest first"), TITLE), table, *_more(len(places) - len(rows), say), Spacer(1, 6)]


def _more(count: int, say: Speech) -> list[Flowable]:
    return [text(say("{count} more stand in result.json", count=count), SMALL)] if count else []


def _conditions(report: ReportInput, say: Speech, width: float) -> list[Flowable]:
    """Everything that the verdict rests on: reasons, assumptions, pose, what was rejected, software and hashes."""
    return [text(say("Conditions"), TITLE), _table(_condition_lines(report, say), width)]


def _condition_lines(report: ReportInput, say: Speech) -> Iterator[tuple[str, str]]:
    document = report.document
    for reason in document["reasons"]:
        yield say("Reason"), say.sentence(reason["words"])
    yield say("Message"), report.message
    for note in document.get("notes", ()):
        yield say("Assumed"), say.sentence(note)
    if document["registration"] is not None:
        yield say("Pose, nominal from scan"), _pose_words(document["registration"], say)
    yield from evidence_facts(document, say)


def _pose_words(pose: Mapping[str, Any], say: Speech) -> str:
    x, y, z = (say.number(value) for value in pose["translation_mm"])
    told = say("turned {angle} deg, moved ({x}; {y}; {z}) mm", angle=say.number(pose["rotation_deg"]), x=x, y=y, z=z)
    rivals = "; " + say("the part fits as well in {count} other poses", count=pose["rivals"]) if pose["rivals"] else ""
    return told + ("" if pose["converged"] else "; " + say("the fit did not settle")) + rivals
