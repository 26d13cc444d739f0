"""The pages after the first one: the characteristics, the stretches out of tolerance with their cut-outs, and the conditions."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from reportlab.platypus import Flowable, Spacer

from cmmlink.plan import Plan
from cmmlink.report.first_page import fit_words, moment_words
from cmmlink.report.page_parts import (
    BODY,
    BODY_BOLD,
    LONGEST_NAME,
    NUMBER,
    NUMBER_BOLD,
    SMALL,
    TITLE,
    SignAndWord,
    ToleranceBar,
    grid,
    headed,
    text,
)
from cmmlink.report.pdf_figure import DrawnFigure
from cmmlink.report.picture_content import PictureContent
from cmmlink.report.profile_drawing import draw_cut_out, prepare_axes
from cmmlink.report.report_input import ReportInput
from cmmlink.report.speech import Speech
from cmmlink.words import VERDICT_WORDS, Shape, VerdictName
from inspection import Verdict

SHAPES: Mapping[VerdictName, Shape] = {"conform": "conform", "uncertain": "not-proven", "nonconform": "not-conform"}
WORDS: Mapping[VerdictName, str] = {"conform": "CONFORM", "uncertain": "NOT PROVEN", "nonconform": "NOT CONFORM"}
_MOST_CUT_OUTS, _ACROSS = 6, 3
_CUT_OUT_PT = 150.0
_MOST_STRETCHES = 60
_BAR_PT = 40.0


def characteristics_part(report: ReportInput, say: Speech, width: float) -> list[Flowable]:
    """The table of all characteristics, each with how its value was found."""
    found = report.document["characteristics"]
    if not found:
        return []
    names = ("Characteristic", "Unit", "Actual", "Nominal", "Deviation", "Lower limit", "Upper limit", "Out by", "", "Verdict")
    numbers, unit, verdict = 45.0, 27.0, 74.0
    widths = [width - 6 * numbers - unit - _BAR_PT - 5 - verdict, unit, *[numbers] * 6, _BAR_PT + 5, verdict]
    rows = [headed([say(name) if name else "" for name in names], range(2, 8))]
    lines = []
    for one in found:
        rows.append(_row(one, say))
        lines.append(len(rows))
        rows.append([text("; ".join(told.removesuffix(".") for told in how_found(one, say) if told), SMALL), *[""] * (len(names) - 1)])
    return [text(say("Characteristics"), TITLE), grid(rows, widths, lines=lines), Spacer(1, 6)]


def _row(one: Mapping[str, Any], say: Speech) -> list[Any]:
    values = [
        (one["value"], ".4f"),
        (one["nominal"], ".4f"),
        (one["deviation"], "+.4f"),
        (one["lower"], "+.4g"),
        (one["upper"], "+.4g"),
    ]
    out = out_by(one)
    shape: Shape = SHAPES[one["verdict"]]
    return [
        text(one["name"], BODY_BOLD, LONGEST_NAME),
        text("" if one["unit"] == "1" else one["unit"], SMALL),
        *(text(say.number(value, form), NUMBER) for value, form in values),
        text(say.number(out) if out > 0 else "", NUMBER_BOLD),
        bar_of(one),
        SignAndWord(shape, say.sentence(WORDS[one["verdict"]])),
    ]


def out_by(one: Mapping[str, Any]) -> float:
    """By how much the deviation of a characteristic exceeds a limit; 0 where it does not."""
    deviation = one["deviation"]
    if deviation is None:
        return 0.0
    beyond = [low - deviation for low in [one["lower"]] if low is not None] + [
        deviation - high for high in [one["upper"]] if high is not None
    ]
    return max(0.0, *beyond) if beyond else 0.0


def bar_of(one: Mapping[str, Any]) -> Flowable | str:
    """The bar of a characteristic that is limited on both sides; nothing for others."""
    lower, upper, deviation = one["lower"], one["upper"], one["deviation"]
    if None in (lower, upper, deviation) or upper <= lower:
        return ""
    return ToleranceBar((deviation - lower) / (upper - lower), SHAPES[one["verdict"]], _BAR_PT)


def how_found(one: Mapping[str, Any], say: Speech) -> Iterator[str]:
    """Lines on how a value was found: its method, region, zone, fit, filter, uncertainty, and where it is worst."""
    yield say.sentence(one["type"]) + (f" ({one['method']})" if one["method"] else "")
    if one["type"] == "line-profile":
        told = [say.sentence(one["region_words"]), say("zone {zone}", zone=one["zone"]) if one["zone"] else ""]
        yield "; ".join(part for part in told if part)
    parts = {"fit {words}": one["fit"], "weights {words}": one["weights"], "filter {words}": one["filter"]}
    yield "; ".join(say(form, words=say.sentence(words)) for form, words in parts.items() if words not in ("none", None, ""))
    yield say.sentence(one["rule"]) if one["rule"] else ""
    worst = one["worst"]
    if worst is not None and one["type"] == "line-profile":
        yield say("worst at station {station} mm", station=say.number(worst["station_mm"], ".2f"))
    if one["verdict"] != "conform":
        yield from (say.sentence(reason["words"]) for reason in one["reasons"][:2])
    yield from one["notes"]


def stretches_part(report: ReportInput, content: PictureContent | None, say: Speech, width: float) -> list[Flowable]:
    """The stretches out of tolerance, the worst of them drawn large."""
    stretches, zone = report.document["stretches"], report.document["tolerance"]
    if not stretches or content is None:
        return []
    middle = (zone["lower_mm"] + zone["upper_mm"]) / 2
    worst_first = sorted(stretches, key=lambda stretch: -abs(stretch["worst_mm"] - middle))
    length = content.length_mm
    names = ("No.", "From station (mm)", "To station (mm)", "Length (mm)", "Worst (mm)", "Out by (mm)")
    head = headed([say(name) for name in names], range(1, 6))
    rows = []
    for number, stretch in enumerate(worst_first[:_MOST_STRETCHES], start=1):
        start, end, worst = stretch["from_mm"], stretch["to_mm"], stretch["worst_mm"]
        over_seam = (end - start) % length
        out = max(zone["lower_mm"] - worst, worst - zone["upper_mm"])
        told = [say.number(start, ".2f"), say.number(end, ".2f"), say.number(over_seam, ".2f"), say.number(worst, "+.4f"), say.number(out)]
        rows.append([text(number), *(text(value, NUMBER) for value in told)])
    parts: list[Flowable] = [text(say("Stretches out of tolerance, the worst first"), TITLE)]
    parts += [grid([head, *rows], [40, *[(width - 40) / 5] * 5])]
    if len(stretches) > len(rows):
        parts.append(text(say("{count} more stretches, none of them worse", count=len(stretches) - len(rows)), SMALL))
    return [*parts, Spacer(1, 6), cut_outs(content, worst_first[:_MOST_CUT_OUTS], say, width)]


def cut_outs(content: PictureContent, stretches: Sequence[Mapping[str, float]], say: Speech, width: float) -> DrawnFigure:
    """Drawings of single stretches, three in a row."""
    down = math.ceil(len(stretches) / _ACROSS)
    figure = Figure(figsize=(width / 72, down * _CUT_OUT_PT / 72), dpi=72)
    for number, stretch in enumerate(stretches):
        row, column = divmod(number, _ACROSS)
        left, bottom = (column + 0.13) / _ACROSS, 1 - (row + 0.9) / down
        axes = figure.add_axes((left, bottom, 0.82 / _ACROSS, 0.74 / down))
        prepare_axes(axes, say)
        draw_cut_out(axes, content, (stretch["from_mm"], stretch["to_mm"]))
        told = say("No. {number}: worst {worst} mm", number=number + 1, worst=say.number(stretch["worst_mm"], "+.4f"))
        axes.set_title(told, fontsize=7, y=1.0, pad=3)
    return DrawnFigure(figure)


def conditions_part(report: ReportInput, say: Speech, width: float) -> list[Flowable]:
    """Everything that the verdict rests on: reasons, assumptions, pose, what was rejected, uncertainty, software and hashes."""
    document = report.document
    parts: list[Flowable] = [text(say("Conditions"), TITLE)]
    rows = [(name, told) for name, told in _conditions(report, say) if told]
    parts.append(grid([[text(name, SMALL), text(told)] for name, told in rows], [110, width - 110], head=0))
    budget = (document.get("uncertainty") or {}).get("budget")
    if budget:
        parts += [text(say("Uncertainty budget"), TITLE), _budget(document["uncertainty"], say, width)]
    return parts


def _conditions(report: ReportInput, say: Speech) -> Iterator[tuple[str, str]]:
    document, plan = report.document, report.plan
    for reason in document["reasons"]:
        yield say("Reason"), say.sentence(reason["words"])
    yield say("Message"), report.message
    for note in document.get("notes", ()):
        yield say("Assumed"), note
    if isinstance(plan, Plan):
        yield say("Probe"), say("tip radius {radius} mm", radius=say.number(plan.probe.tip_radius_mm, "g"))
    if document["rule"] is not None:
        yield say("Fit"), fit_words(document, say)
        yield say("Pose, nominal from section"), _pose_words(document["registration"], say)
        for other in document["registration"]["other_poses"]:
            yield say("The part fits as well"), _pose_words(other, say)
        if gap := document["largest_gap"]:
            yield say("Largest gap"), say("a flat of up to {hidden} mm could hide there", hidden=say.number(gap["could_hide_mm"], ".3g"))
    for found in document["characteristics"]:
        if found["certificate"] is not None:
            for number, line in enumerate(found["certificate"]["words"].splitlines()):
                yield "" if number else say("Certificate of {name}", name=found["name"]), line
    yield from evidence_facts(document, say)


def evidence_facts(document: Mapping[str, Any], say: Speech) -> Iterator[tuple[str, str]]:
    """What was rejected, and what ties the result to its record and to the program."""
    for reason, count in document["rejected_by_reason"].items():
        yield say("Rejected"), f"{count}: {say.sentence(reason)}"
    yield say("Measured at"), moment_words(document.get("measured_at")) or ""
    yield say("Qualification"), qualification_words(document, say)
    yield say("Software"), ", ".join(f"{name} {version}" for name, version in sorted((document.get("software") or {}).items()) if version)
    for name, key in (("Record (SHA-256)", "chain_sha256"), ("Plan (SHA-256)", "plan_sha256"), ("Nominal (SHA-256)", "nominal_sha256")):
        yield say(name), document.get(key) or ""
    yield from signature_words(document, say)
    if say.language != "en":
        yield say("Language"), say("Sentences of the inspection that are not translated stand as the record has them.")


def qualification_words(document: Mapping[str, Any], say: Speech) -> str:
    """The last qualification of the installation when the part was measured, and the certificate that tells more."""
    named = document.get("qualification")
    if named is None:
        return say("none was made") if "qualification" in document else ""
    words = say.sentence(named["words"])
    return say("{words}; certificate {sha256}", words=words, sha256=named["certificate_sha256"])


def signature_words(document: Mapping[str, Any], say: Speech) -> Iterator[tuple[str, str]]:
    """Who signed the record, and which places outside were told of it."""
    if not document.get("chain_sha256") or "signature" not in document:  # not recorded, or judged again
        return
    signature = document["signature"]
    if signature is None:
        yield say("Signed"), say("not signed")
    else:
        yield say("Signed"), say("with the key {key}, public key {public}", key=signature["key_id"], public=signature["public_key"])
        yield say("Signature (Ed25519)"), signature["signature"]
    if (answer := document.get("answer")) is not None:
        yield say("Answer to the machine"), _answer_words(answer, say)
    for told in document.get("anchors", ()):
        yield say("Anchored"), say("not told to {place} yet", place=told["place"]) if told["problem"] else told["place"]


def _answer_words(answer: Mapping[str, Any], say: Speech) -> str:
    """What a machine was told, with the moment in UTC, or why it was not."""
    if not answer["sent"]:
        return say("not sent: {problem}", problem=answer["problem"])
    verdict = say(VERDICT_WORDS[Verdict[answer["verdict"].upper()]]) if answer["verdict"] else ""
    return say("{verdict} for request {request}, sent {at}", verdict=verdict, request=answer["request"], at=answer["at"])


def _pose_words(pose: Mapping[str, Any], say: Speech) -> str:
    x, y = pose["translation_mm"]
    told = say("turned {angle} deg, moved ({x}, {y}) mm", angle=say.number(pose["rotation_deg"]), x=say.number(x), y=say.number(y))
    return told + ("" if pose.get("converged", True) else "; " + say("the fit did not settle"))


def _budget(uncertainty: Mapping[str, Any], say: Speech, width: float) -> Flowable:
    """The budget by the GUM at the place where U is largest."""
    names = ("Contribution", "Value", "Distribution", "Type", "u(x)", "Sensitivity", "u (mm)", "Share of u\u00b2")
    rows = [
        [
            text(line["name"], BODY),
            text(f"{say.number(line['value'], '.4g')} {line['unit']}", NUMBER),
            text(line["distribution"]),
            text(line["evaluated"]),
            text(say.number(line["standard"], ".4g"), NUMBER),
            text(say.number(line["sensitivity"], ".4g"), NUMBER),
            text(say.number(line["contributed_mm"], ".5f"), NUMBER),
            text(say.number(line["share"], ".1%"), NUMBER),
        ]
        for line in uncertainty["budget"]
    ]
    told = say(
        "{basis}: U = {largest} mm at most, at station {station} mm, k = {k}",
        basis=uncertainty["basis"],
        largest=say.number(uncertainty["largest_mm"], ".5f"),
        station=say.number(uncertainty["station_mm"], ".2f"),
        k=say.number(uncertainty["coverage_factor"], "g"),
    )
    widths = [90, 66, 66, 32, *[(width - 254) / 4] * 4]
    rows.append([text(told, SMALL), *[""] * (len(names) - 1)])
    return grid([headed([say(name) for name in names], (1, 4, 5, 6, 7)), *rows], widths, lines=[len(rows)])
