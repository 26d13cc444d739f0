"""The first page of a report: verdict, identity, the worst point, both reporting rules, what the verdict rests on, and the drawings."""

from collections.abc import Iterator, Mapping
from typing import Any

from matplotlib.figure import Figure
from reportlab.graphics.barcode.qr import QrCode
from reportlab.platypus import Flowable, Spacer, Table, TableStyle

from cmmlink.report.page_parts import BODY_BOLD, COLOURS, LONGEST_NAME, NUMBER, NUMBER_BOLD, SMALL, Sign, grid, headed, text
from cmmlink.report.pdf_figure import DrawnFigure
from cmmlink.report.picture_content import PictureContent
from cmmlink.report.profile_drawing import draw_contour, draw_strip, prepare_axes
from cmmlink.report.report_input import ReportInput
from cmmlink.report.speech import Speech

_MOST_REASONS = 3
_LEAST_DRAWING_PT, _MOST_DRAWING_PT = 250.0, 470.0
_LEFT_PT, _RIGHT_PT, _BELOW_PT, _ABOVE_PT = 45.0, 50.0, 28.0, 14.0  # around the frames of a drawing
_CONTOUR_SHARE = 0.58
_QR_PT = 64.0


def verdict_block(report: ReportInput, say: Speech, width: float) -> Table:
    """The verdict in sign and word, and why it is that one."""
    headline, document = report.headline, report.document
    reasons = [reason["words"] for reason in document["reasons"]]
    if not reasons and document["rule"] is None:
        reasons = [report.message or "No point was judged."]
    shown = [say.sentence(told) for told in reasons[:_MOST_REASONS]]
    if len(reasons) > _MOST_REASONS:
        shown.append(say("{count} more reasons stand under Conditions.", count=len(reasons) - _MOST_REASONS))
    word = text(say.sentence(headline.words), BODY_BOLD.clone("verdict", fontSize=19, leading=23, textColor=COLOURS[headline.shape]))
    simulated = [text(say("SIMULATED: no real part was measured"), BODY_BOLD)] if document.get("simulated") else []
    rows = [[Sign(headline.shape, 34), [word, *(text(told, longest=2 * LONGEST_NAME) for told in shown), *simulated]]]
    style = TableStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0), ("BOTTOMPADDING", (0, 0), (-1, -1), 3)])
    return Table(rows, colWidths=[44, width - 44], style=style, hAlign="LEFT")


def identity_block(report: ReportInput, say: Speech, width: float) -> Table:
    """What was measured, by whom, with what and when, and what ties the report to its record."""
    document = report.document
    left = [
        (say("Part"), document.get("part")),
        (say("Serial number"), document.get("serial_number")),
        (say("Nominal"), report.nominal_name),
        (say("Device"), document.get("device")),
    ]
    run = document.get("run") or document.get("replay_of")
    right = [
        (say("Measured at"), moment_words(document.get("measured_at"))),
        (say("Operator"), document.get("operator")),
        (say("Run"), (say("{run}, judged again", run=run) if document.get("replay_of") else run) or say("not recorded")),
        (say("Software"), software_words(document.get("software"))),
    ]
    code = code_of(document)
    label, room = 62.0, width - (_QR_PT + 6 if code else 0)
    pairs = [
        [text(a, SMALL), text(b or "\u2013", longest=LONGEST_NAME), text(c, SMALL), text(d or "\u2013", longest=LONGEST_NAME)]
        for (a, b), (c, d) in zip(left, right, strict=True)
    ]
    value = (room - 2 * label) / 2
    table = grid(pairs, [label, value, label, value], head=0)
    if code is None:
        return table
    style = TableStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0), ("RIGHTPADDING", (0, 0), (-1, -1), 0)])
    return Table(
        [[table, QrCode(code, width=_QR_PT, height=_QR_PT, qrBorder=2, qrLevel="M")]],
        colWidths=[room, _QR_PT + 6],
        style=style,
        hAlign="LEFT",
    )


def code_of(document: Mapping[str, Any]) -> str | None:
    """What the QR code says: the run, the hash of its record, its key and the hash of its plan; None where nothing was recorded."""
    if not document.get("chain_sha256"):
        return None
    named = {
        "run": document.get("run") or document.get("replay_of"),
        "record": document["chain_sha256"],
        "key": (document.get("signature") or {}).get("key_id"),
        "plan": document.get("plan_sha256"),
    }
    return "\n".join(["cmmlink", *(f"{name} {value}" for name, value in named.items() if value)])


def moment_words(told: str | None) -> str | None:
    """A moment in UTC as JSON has it, to the second, for people."""
    return f"{told[:10]} {told[11:19]} UTC" if told else None


def software_words(software: Mapping[str, str] | None) -> str:
    """The version of the program, and where it ran."""
    if not software:
        return ""
    return ", ".join(f"{name} {software[name]}" for name in ("cmmlink", "python") if software.get(name))


def rules_table(report: ReportInput, say: Speech, width: float) -> Table:
    """The worst point, and the result by both rules that drawings are read by."""
    document, zone = report.document, report.document["tolerance"]
    lower, upper = zone["lower_mm"], zone["upper_mm"]
    names = [say(name) for name in ("Reporting rule", "Quantity", "Actual (mm)", "Limit (mm)", "Out by (mm)")]
    head = headed(names, range(2, 5))
    largest, smallest, error = document["max_deviation_mm"], document["min_deviation_mm"], document["zone_error_mm"]
    one, two = say("one value (ISO 1101, ASME Y14.5.1-2019)"), say("two values (ASME Y14.5.1-1994)")
    lines = [
        (one, say("zone error: 2 x the largest distance from the zone's middle"), error, upper - lower, error - (upper - lower), ".4f"),
        (two, say("largest deviation"), largest, upper, largest - upper, "+.4f"),
        ("", say("smallest deviation"), smallest, lower, lower - smallest, "+.4f"),
    ]
    rows = [
        [text(rule), text(what), *(text(say.number(value, form), NUMBER) for value in (actual, limit)), text(_out(out, say), NUMBER_BOLD)]
        for rule, what, actual, limit, out, form in lines
    ]
    numbers = 62.0
    named = 190.0
    return grid([head, *rows], [named, width - named - 3 * numbers, numbers, numbers, numbers])


def _out(out_mm: float, say: Speech) -> str:
    """By how much a limit is exceeded; nothing where it is not."""
    return say.number(out_mm) if out_mm > 0 else ""


def facts_table(report: ReportInput, say: Speech, width: float) -> Table:
    """The worst point and what the verdict rests on, a line each."""
    label = 92.0
    return grid([[text(name, SMALL), text(told)] for name, told in facts(report, say)], [label, width - label], head=0)


def facts(report: ReportInput, say: Speech) -> Iterator[tuple[str, str]]:
    """Names and words of what the verdict rests on."""
    document = report.document
    if document["rule"] is not None:
        yield from _facts_of_result(document, say)
    yield points_fact(document, say)


def points_fact(document: Mapping[str, Any], say: Speech) -> tuple[str, str]:
    """What came of the points that were sent."""
    told = say(
        "received {received} = judged {judged} + rejected {rejected}; lost {lost}; damaged bytes {damaged}",
        **{name: document[name] for name in ("received", "judged", "rejected", "lost")},
        damaged=document["damaged_bytes"],
    )
    return say("Points"), told


def _facts_of_result(document: Mapping[str, Any], say: Speech) -> Iterator[tuple[str, str]]:
    worst, gap, n = document["worst"], document["largest_gap"], say.number
    if worst is not None:
        place = say(
            "{deviation} mm at station {station} mm (x {x}, y {y} mm)",
            deviation=n(worst["deviation_mm"], "+.4f"),
            station=n(worst["station_mm"], ".2f"),
            x=n(worst["x_mm"], ".3f"),
            y=n(worst["y_mm"], ".3f"),
        )
        out = say(
            "{count} points out of tolerance, in {stretches} stretches",
            count=document["out_of_tolerance"],
            stretches=len(document["stretches"]),
        )
        yield say("Worst point"), f"{place}; {out}"
    yield (
        say("Profile error"),
        say("{error} mm (2 x the largest |deviation|); rms {rms} mm", error=n(document["profile_error_mm"]), rms=n(document["rms_mm"])),
    )
    yield say("Decision rule and U"), say.sentence(document["tolerance"]["decision_rule"])
    yield say("Fit"), fit_words(document, say)
    if gap is None:  # earlier versions looked for none
        yield say("Coverage"), say("{coverage} of the profile", coverage=n(document["coverage"], ".1%"))
        return
    yield (
        say("Coverage"),
        say(
            "{coverage} of the profile; largest gap {gap} mm at station {start} .. {end} mm, {allowed} mm count as measured",
            coverage=n(document["coverage"], ".1%"),
            gap=n(document["largest_gap_mm"], ".3f"),
            start=n(gap["from_mm"], ".2f"),
            end=n(gap["to_mm"], ".2f"),
            allowed=n(gap["allowed_mm"], ".3f"),
        ),
    )


def fit_words(document: Mapping[str, Any], say: Speech) -> str:
    """How the pose of the run was found and what decided; its deviations are raw, and filters stand with their characteristics."""
    return say(
        "{fit}, rule {rule}, target {target} mm, weights {weights}; method {method}; raw deviations",
        fit=say.sentence(document["fit"]),
        rule=say.sentence(document["rule"]),
        target=say.number(document["target_mm"], "g"),
        weights=say.sentence(document["weights"]),
        method=document["method"],
    )


def first_page(report: ReportInput, content: PictureContent | None, say: Speech, width: float, height: float) -> list[Flowable]:
    """Everything of the first page; the drawings take the room that is left on it."""
    parts: list[Flowable] = [verdict_block(report, say, width), Spacer(1, 2), identity_block(report, say, width), Spacer(1, 5)]
    if report.document["rule"] is not None and report.document["judged"]:
        parts += [rules_table(report, say, width), Spacer(1, 5)]
    parts.append(facts_table(report, say, width))
    if content is None:
        return parts
    used = sum(part.wrap(width, height)[1] for part in parts)
    room = height - used - 4
    drawing = min(room, _MOST_DRAWING_PT) if room >= _LEAST_DRAWING_PT else _MOST_DRAWING_PT
    return [*parts, *drawings(content, say, width, drawing)]


def drawings(content: PictureContent, say: Speech, width: float, height: float) -> list[Flowable]:
    """The contour and the deviation against station, together as high as that."""
    contour, strip = _CONTOUR_SHARE * height, (1 - _CONTOUR_SHARE) * height - 2
    return [drawn(content, say, width, contour, draw_contour), drawn(content, say, width, strip, draw_strip)]


def drawn(content: PictureContent, say: Speech, width: float, height: float, draw: Any) -> DrawnFigure:
    """A drawing on axes of its own, whose frame fills the room that its labels leave."""
    figure = Figure(figsize=(width / 72, height / 72), dpi=72)
    frame = (_LEFT_PT / width, _BELOW_PT / height, 1 - (_LEFT_PT + _RIGHT_PT) / width, 1 - (_BELOW_PT + _ABOVE_PT) / height)
    axes = figure.add_axes(frame)
    prepare_axes(axes, say)
    if draw is draw_strip:
        draw_strip(axes, content, say, basis=False)
    else:
        draw(axes, content, say)
    return DrawnFigure(figure)
