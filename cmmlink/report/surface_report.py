"""What the picture and the report of a whole surface are made of, of a run that has just ended as of one on record: document and rows."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cmmlink.report.heading import heading_of
from cmmlink.report.report_input import ReportInput, zone_in
from cmmlink.report.speech import Speech
from cmmlink.report.surface_content import PLACES, JudgedSurface, Region, SurfaceContent, surface_content
from cmmlink.surface_rows import SurfaceRows, joined_surface_rows
from inspection import NOT_JUDGED

if TYPE_CHECKING:
    from inspection.surface import NominalSurface


def content_of_surface(report: ReportInput, nominal: "NominalSurface", blocks: Iterator[SurfaceRows]) -> SurfaceContent:
    """What the picture of a judged surface shows, in the language of its report. Its rows come piece by piece."""
    document, say = report.document, Speech(report.settings.language)
    scan = _judged(document, nominal, joined_surface_rows(blocks))
    run, measured_at = document.get("run") or document.get("replay_of"), document.get("measured_at")
    foot = "   ".join(filter(None, [run and say("run {run}", run=run), measured_at]))
    basis = "\n".join(
        [
            say("coverage {share}   fit {fit}", share=say.number(document["coverage"], ".1%"), fit=say.sentence(document["fit"])),
            say("out of tolerance: {count} points", count=document["out_of_tolerance"]),
        ]
    )
    return surface_content(scan, heading_of(report.title, say.sentence(report.headline.words)), basis, foot)


def _judged(document: Mapping[str, Any], nominal: "NominalSurface", rows: SurfaceRows) -> JudgedSurface:
    places, normals = nominal.sample(PLACES)
    zone = zone_in(document["tolerance"])
    judged = np.flatnonzero(rows.verdicts != NOT_JUDGED)
    away = np.abs(rows.deviation_mm[judged] - zone.middle_mm)
    return JudgedSurface(
        places,
        normals,
        rows.foot_mm,
        rows.normal.astype(np.float64),
        rows.deviation_mm,
        rows.verdicts,
        zone,
        document["nominal"]["area_mm2"],
        document["gap_max_mm"] / 2,
        tuple(Region(one["area_mm2"], one["worst_mm"], tuple(one["worst_at_mm"])) for one in document["regions"]),
        int(judged[away.argmax()]) if len(judged) else None,
    )
