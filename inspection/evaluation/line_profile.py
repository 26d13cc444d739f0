"""A zone around the profile or a region of it: judged at its pose, point by point, against the limits where the point is.

NONCONFORM is said where it is proven: at a known pose by any point out by more than U; where the pose was fitted, by the proof that
no placement brings all points into the zone, or, by the rule "best-fit", at the pose that the fit gives where enough was measured.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inspection.bands import Band, EvenBand, VaryingBand
from inspection.characteristics.characteristic import CharacteristicResult, LineProfile, WholeProfile, WorstPlace
from inspection.cloud import MANY, row_blocks
from inspection.conclusion import Conclusion, Reason, word_points
from inspection.evaluation.basis import Basis, filter_deviations
from inspection.evaluation.datum import UNSTATED
from inspection.evaluation.placing import Placed, certify_run, consume_least, is_constant, place, place_so_far, shrink_zone
from inspection.evaluation.region_uncertainty import uncertainty_of
from inspection.filters import FilteredProfile
from inspection.gaps import Measured
from inspection.placements import PlacementSearch
from inspection.rigid import RigidTransform
from inspection.tolerance import DecisionRule, ToleranceZone, decision_words
from inspection.verdict import Verdict
from inspection.zone_certificate import ZoneCertificate

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_PLACED = 0.95  # share of the region whose points place it, where the plan asks for no coverage
_MOST_BOXES = 200_000  # of placements, before the search for one that passes is given up
_LESS = 1e-3  # of a zone: by no more than this another placement may consume less than that of a limited fit
_FEWEST_POINTS = 8  # of a region, after whose fit its uncertainty is asked
_ONE_SIDE = "its limits have steps and border_mm is 0: a point beside a step is judged by its own side, as if its station were exact"
_DECIDED = {"none": "at the pose of the run", "datum": "at the datum"}


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """The points of a region at a pose.

    beyond, within : points out by more than U, and points nearer to a limit than U
    worst          : the point that consumes most of its zone, its limits and how much it consumes; None where there is no point
    width_mm       : 2 * max |deviation - middle of the zone|
    judged         : points with a deviation
    beyond_end     : how far points lie beyond an end there, and how many farther than is allowed
    notes          : on the filter
    """

    beyond: int
    within: int
    worst: WorstPlace | None
    limits: tuple[float, float]
    consumption: float
    width_mm: float
    judged: int
    beyond_end: tuple[float, int]
    notes: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """That of the worst point."""
        if self.beyond:
            return Verdict.NONCONFORM
        return Verdict.UNCERTAIN if self.within or not self.judged else Verdict.CONFORM


def judge_whole(asked: WholeProfile, basis: Basis) -> CharacteristicResult:
    """The profile as the run judged it, with the certificate of its minimum zone where that is its fit."""
    result = basis.result
    zone, worst = result.zone, result.worst_row
    place = None
    if worst is not None:
        (x, y), station, off = worst.actual_mm[0].tolist(), float(worst.station_mm[0]), float(worst.deviation_mm[0])
        place = WorstPlace(station, x, y, off)
    deviation = place.deviation_mm if place else math.nan
    certificate = certify_run(basis) if result.fit == "minimum-zone" else None
    return CharacteristicResult(
        name=asked.name,
        type="line-profile",
        method=result.method,
        value=result.zone_error_mm,
        nominal=math.nan,
        unit="mm",
        lower=zone.lower_mm,
        upper=zone.upper_mm,
        deviation=deviation,
        consumption=result.zone_error_mm / (zone.upper_mm - zone.lower_mm),
        uncertainty=zone.uncertainty_mm,
        rule=f"{result.rule}; {zone.decision_rule}",
        verdict=result.verdict,
        reasons=result.reasons,
        worst=place,
        fit=result.fit if basis.terms.known_pose is None else "datum" if basis.terms.datum is not None else "none",
        weights="none" if result.fit == "minimum-zone" else result.weights,
        region_words="whole profile",
        zone_words=zone_words(zone.lower_mm, zone.upper_mm),
        pose=result.registration.nominal_from_section,
        coverage=result.coverage,
        gap_mm=result.gap.length_mm,
        certificate=certificate,
        notes=_notes_on_smaller(certificate, result.zone_error_mm),
    )


def _notes_on_smaller(certificate: ZoneCertificate | None, zone_mm: float) -> tuple[str, ...]:
    """Say where the search of every placement came to a smaller zone than the run's own fit, which looks only around its start."""
    if certificate is None or zone_mm - certificate.zone_mm <= 2 * certificate.gap_mm:
        return ()
    at = "the certificate's placement, where points beyond the ends of an open profile take no part"
    return (f"the zone is {certificate.zone_mm:.6g} mm at {at}; the value is that of the fit which decided",)


def judge_profile(asked: LineProfile, basis: Basis) -> CharacteristicResult:
    """A line profile with what was found of it, and its verdict."""
    rows = basis.rows(asked.region)
    few = basis.few(rows)
    placed = place(asked, basis, rows, few)
    asked = replace(asked, uncertainty_mm=uncertainty_of(asked, basis, few, placed))
    seen = _see(asked, basis, rows, placed.pose)
    placed, seen, points, why = _decide(asked, basis, rows, few, placed, seen)
    measured = basis.measured(asked.region)
    conclusion = basis.conclude(points, why, measured, seen.judged, placed.converged, seen.beyond_end)
    return _result(asked, basis, placed, seen, measured, conclusion)


def judge_profile_so_far(asked: LineProfile, basis: Basis) -> CharacteristicResult:
    """The same of a scan that still runs: NONCONFORM where that is proven whatever comes, else UNCERTAIN, without reasons.

    Proven is what a known pose and raw deviations say of points that stay in the region; every fit, and every filter, can still change.
    """
    rows = basis.rows(asked.region)
    few = basis.few(rows)
    placed = place_so_far(asked, basis, few)
    asked = replace(asked, uncertainty_mm=uncertainty_of(asked, basis, few, placed))
    seen = _see(asked, basis, rows, placed.pose)
    stays = placed.is_known and asked.fit in _DECIDED and (asked.region is None or basis.terms.known_pose is not None)
    proven = seen.beyond > 0 and stays and asked.filter is None and not basis.terms.reject_outliers
    verdict = Verdict.NONCONFORM if proven else Verdict.UNCERTAIN
    if seen.worst is None:
        seen = replace(seen, limits=(float(asked.zone.lower_mm.min()), float(asked.zone.upper_mm.max())), consumption=math.nan)
    return _result(asked, basis, placed, seen, basis.measured(asked.region), Conclusion(verdict, ()))


def _result(
    asked: LineProfile, basis: Basis, placed: Placed, seen: _Seen, measured: Measured, conclusion: Conclusion
) -> CharacteristicResult:
    """A line profile with what was seen of its points at a pose, and what was concluded from it."""
    return CharacteristicResult(
        name=asked.name,
        type="line-profile",
        method=basis.terms.method,
        value=seen.width_mm,
        nominal=math.nan,
        unit="mm",
        lower=seen.limits[0],
        upper=seen.limits[1],
        deviation=seen.worst.deviation_mm if seen.worst else math.nan,
        consumption=seen.consumption,
        uncertainty=_u(asked),
        rule=f"{_rule(asked, placed)}; {decision_words(basis.terms.zone.rule, _u(asked), seen.limits[1] - seen.limits[0])}",
        verdict=conclusion.verdict,
        reasons=conclusion.reasons,
        worst=seen.worst,
        fit=placed.fit,
        filter=asked.filter.words if asked.filter else "none",
        weights=basis.terms.weights if asked.fit == "best-fit" else "none",
        region=asked.region,
        region_words=asked.region_words,
        zone_words=asked.zone_words,
        pose=placed.pose,
        coverage=measured.coverage,
        gap_mm=measured.gap.length_mm,
        certificate=placed.certificate,
        datum=placed.datum,
        notes=(
            *seen.notes,
            *([UNSTATED] if placed.datum is not None and not _u(asked) else []),
            *([_ONE_SIDE] if asked.zone.has_steps and not asked.zone.border_mm else []),
        ),
    )


def _u(asked: LineProfile) -> float:
    """The expanded uncertainty of one deviation."""
    return asked.uncertainty_mm or 0.0


def zone_words(lower_mm: float, upper_mm: float) -> str:
    """A constant zone in both notations of a drawing: ISO 1101 with UZ, and ASME Y14.5 with the circled U, here (U)."""
    width, offset = upper_mm - lower_mm, (upper_mm + lower_mm) / 2
    if abs(offset) <= 1e-9 * width:
        return f"{width:.6g}"
    return f"{width:.6g} UZ {offset:+.6g}; {width:.6g} (U) {upper_mm:.6g}"


def _rule(asked: LineProfile, placed: Placed) -> str:
    """What decided, in words."""
    if asked.fit in _DECIDED:
        return _DECIDED[asked.fit]
    if asked.fit == "best-fit":
        return asked.rule if placed.is_free or placed.fit == "minimum-zone" else "best-fit within its freedoms"
    return asked.fit


def _see(asked: LineProfile, basis: Basis, rows: Rows, pose: RigidTransform) -> _Seen:
    """Judge every point of a region at a pose."""
    if asked.filter is not None:
        return _see_filtered(asked, basis, rows, pose)
    seen = _NOTHING
    for part in row_blocks(len(rows)):
        d = basis.deviations_at(rows[part], pose)
        places = d.foot_mm + d.deviation_mm[:, None] * d.normal
        seen = _joined(seen, _judge(asked, d.deviation_mm, d.station_mm, places, d.beyond_end, basis))
    return seen


def _see_filtered(asked: LineProfile, basis: Basis, rows: Rows, pose: RigidTransform) -> _Seen:
    """The same with filtered deviations. Where the filter gives no value, the gap speaks for itself."""
    assert asked.filter is not None
    if len(rows) > MANY:
        rows = basis.drawn(rows)
    d = basis.deviations_at(rows, pose)
    filtered = filter_deviations(d, basis.nominal, asked.filter)
    notes = () if filtered.settled else ("the robust filter's limit did not settle",)
    notes = (*notes, *_notes_on_raw(_judge(asked, d.deviation_mm, d.station_mm, d.foot_mm, d.beyond_end, basis), filtered))
    places = d.foot_mm + filtered.waviness_mm[:, None] * d.normal
    seen = _judge(asked, filtered.waviness_mm, d.station_mm, places, d.beyond_end, basis)
    return replace(seen, notes=notes)


def _notes_on_raw(raw: _Seen, filtered: FilteredProfile) -> tuple[str, ...]:
    """What a filter has taken away: a defect that is shorter than its cutoff is judged by what is left of it."""
    spikes = int(np.count_nonzero((filtered.weight == 0.0) & np.isfinite(filtered.waviness_mm)))
    told = []
    if filtered.rounds > 1 and spikes:
        told.append(f"the robust filter took {spikes} point{'s' * (spikes > 1)} for spikes, which count for nothing")
    if raw.beyond and raw.worst is not None:
        lies = "s lie" if raw.beyond > 1 else " lies"
        worst = f"{raw.worst.deviation_mm:+.4f} mm at station {raw.worst.station_mm:.2f} mm"
        told.append(f"before the filter {raw.beyond} point{lies} beyond the limits, the worst {worst}")
    return tuple(told)


_NOTHING = _Seen(0, 0, None, (math.nan, math.nan), -1.0, math.nan, 0, (0.0, 0))


def _judge(asked: LineProfile, deviation: Array, station: Array, places: Array, beyond_end: NDArray[np.bool_], basis: Basis) -> _Seen:
    """Judge deviations (k,) at stations (k,); `places` (k, 2) is where they are in the nominal's coordinates."""
    lower, upper, _, _ = asked.zone.limits(station)
    known = np.isfinite(deviation) & ~beyond_end
    out = np.maximum(lower - deviation, deviation - upper)[known]
    u = basis.guard(_u(asked))
    off = np.abs(deviation - (lower + upper) / 2)
    consumed = np.where(known, 2 * off / (upper - lower), -1.0)
    farther = np.where(beyond_end, np.abs(deviation), 0.0)
    ends = float(farther.max(initial=0.0)), int(np.count_nonzero(farther > basis.terms.limits.end_allowance_mm))
    if not known.any():
        return replace(_NOTHING, beyond_end=ends)
    worst = int(consumed.argmax())
    place = WorstPlace(float(station[worst]), float(places[worst, 0]), float(places[worst, 1]), float(deviation[worst]))
    return _Seen(
        beyond=int(np.count_nonzero(out > u)),
        within=int(np.count_nonzero((out > -u) & (out <= u))),
        worst=place,
        limits=(float(lower[worst]), float(upper[worst])),
        consumption=float(consumed[worst]),
        width_mm=2 * float(off[known].max()),
        judged=int(np.count_nonzero(known)),
        beyond_end=ends,
    )


def _joined(one: _Seen, other: _Seen) -> _Seen:
    """What two pieces of a region say together."""
    farther = other if other.consumption > one.consumption else one
    return replace(
        farther,
        beyond=one.beyond + other.beyond,
        within=one.within + other.within,
        width_mm=float(np.fmax(one.width_mm, other.width_mm)),
        judged=one.judged + other.judged,
        beyond_end=max(one.beyond_end, other.beyond_end),
    )


def _decide(
    asked: LineProfile, basis: Basis, rows: Rows, few: Rows, placed: Placed, seen: _Seen
) -> tuple[Placed, _Seen, Verdict, Reason | None]:
    """The pose that decides and what was seen there; the verdict on the points, NONCONFORM only where it is proven, and its reason."""
    why = _why(asked, seen, basis.terms.zone.rule)
    if asked.features is not None:
        return placed, seen, *_judge_at_datum(asked, basis, few, placed, seen, why)
    if placed.doubt is not None:
        return placed, seen, Verdict.UNCERTAIN, placed.doubt
    if seen.verdict is not Verdict.NONCONFORM or (placed.is_known and placed.converged):
        return placed, seen, seen.verdict, why
    if asked.filter is not None or (asked.rule == "best-fit" and asked.fit in ("best-fit", "none")):
        return placed, seen, *_doubt_fit(asked, basis, few, placed, why)
    if asked.fit == "best-fit" and placed.is_free:
        elsewhere = _smallest(asked, basis, few, placed.pose)
        at_elsewhere = _see(asked, basis, rows, elsewhere)
        if at_elsewhere.verdict is not Verdict.NONCONFORM:
            decided = replace(placed, pose=elsewhere, fit="minimum-zone" if is_constant(asked.zone) else "tolerance")
            return decided, at_elsewhere, at_elsewhere.verdict, _why(asked, at_elsewhere, basis.terms.zone.rule)
    return placed, seen, *_ask_every_placement(asked, basis, few, placed, why)


def _judge_at_datum(
    asked: LineProfile, basis: Basis, few: Rows, placed: Placed, seen: _Seen, why: Reason | None
) -> tuple[Verdict, Reason | None]:
    """The verdict of points at a datum that was measured. Without one, they are out where no placement at all brings them in."""
    if placed.doubt is None and seen.verdict is Verdict.CONFORM:
        return seen.verdict, why
    if placed.doubt is None and seen.verdict is Verdict.NONCONFORM and basis.complete:
        return seen.verdict, why
    if asked.filter is None and len(few):
        at_any = replace(asked, uncertainty_mm=basis.result.zone.uncertainty_mm)
        if _ask_every_placement(at_any, basis, few, placed, None)[0] is Verdict.NONCONFORM:
            return Verdict.NONCONFORM, Reason(
                "out-of-tolerance", "No placement of the part brings its points into the zone: it fails at any datum."
            )
    unsettled = Reason("datum", "The scan did not come to its end: the points of the datum may not all be there.")
    return Verdict.UNCERTAIN, placed.doubt or (unsettled if seen.verdict is Verdict.NONCONFORM else why)


def _smallest(asked: LineProfile, basis: Basis, few: Rows, start: RigidTransform) -> RigidTransform:
    """The pose of least consumption near a start: of the smallest zone, where the zone is the same everywhere."""
    points = basis.result.section_at(few)
    if is_constant(asked.zone):
        return shrink_zone(asked, basis, points, start).nominal_from_section.snap_to_grid()
    return consume_least(asked, basis, points, start).nominal_from_section.snap_to_grid()


def _doubt_fit(asked: LineProfile, basis: Basis, few: Rows, placed: Placed, why: Reason | None) -> tuple[Verdict, Reason | None]:
    """The verdict of points that are out at the pose of a fit, by the rule that this pose decides."""
    covered = basis.measured(asked.region).coverage
    if not basis.complete or covered < (basis.terms.coverage_min or _PLACED):
        words = f"Too little was measured ({covered:.1%}) to place the part: in another placement no point may be out."
        return Verdict.UNCERTAIN, Reason("placement", words)
    if not placed.converged:
        return Verdict.UNCERTAIN, Reason("fit", "Points are out at the pose of a fit that did not settle: another one may have none.")
    if basis.result.registration.rivals:
        words = "The part fits the nominal in another pose as well: only a datum can tell whether points are out."
        return Verdict.UNCERTAIN, Reason("placement", words)
    if asked.fit in ("minimum-zone", "tolerance") and not _is_least(asked, basis, few, placed):
        return Verdict.UNCERTAIN, Reason("placement", "It was not proven that no other placement has a smaller zone.")
    return Verdict.NONCONFORM, why


def _is_least(asked: LineProfile, basis: Basis, few: Rows, placed: Placed) -> bool:
    """Whether it is proven that no motion which the fit may make has a smaller zone than its pose, or consumes less."""
    if placed.certificate is not None:
        return placed.certificate.proven
    d = basis.deviations_at(few, placed.pose)
    share = float(np.abs(asked.zone.consumption(d.deviation_mm, d.station_mm)[~d.beyond_end]).max(initial=0.0)) - _LESS
    search = PlacementSearch(basis.nominal, _band(asked, basis, share, 0.0), basis.terms.tip_radius_mm, asked.freedoms)
    return share <= 0 or search.look(basis.result.section_at(few), placed.begin, _MOST_BOXES).outcome == "refuted"


def _band(asked: LineProfile, basis: Basis, share: float, u: float) -> Band:
    """Where deviations lie that consume no more than a share of the zone, wider by U."""
    zone = asked.zone
    if is_constant(zone):
        lower, upper = float(zone.lower_mm[0]), float(zone.upper_mm[0])
        return EvenBand(share * ((upper - lower) / 2 + u), (lower + upper) / 2)
    return VaryingBand(basis.nominal, replace(zone, lower_mm=zone.lower_mm - u, upper_mm=zone.upper_mm + u), share)


def _ask_every_placement(asked: LineProfile, basis: Basis, few: Rows, placed: Placed, why: Reason | None) -> tuple[Verdict, Reason | None]:
    """The verdict of points that are out at a fitted pose: NONCONFORM where no placement that it may have brings them into the zone.

    Where freedoms count from a known pose, only the motions that they allow may place the part; else every placement may.
    """
    band = _band(asked, basis, 1.0, basis.guard(_u(asked)))
    within = asked.freedoms if placed.begin_known else None
    search = PlacementSearch(basis.nominal, band, basis.terms.tip_radius_mm, within)
    proof = search.look(basis.result.section_at(few), placed.pose if within is None else placed.begin, _MOST_BOXES)
    if proof.outcome == "refuted":
        return Verdict.NONCONFORM, why
    words = (
        "Points are out at the pose of the fit, and in another placement none is."
        if proof.outcome == "fits"
        else "No placement of the part was found that passes, and it was not proven that there is none."
    )
    return Verdict.UNCERTAIN, Reason("placement", words)


def _why(asked: LineProfile, seen: _Seen, rule: DecisionRule) -> Reason | None:
    """The reason that the points themselves give."""
    if is_constant(asked.zone):
        zone = ToleranceZone(float(asked.zone.lower_mm[0]), float(asked.zone.upper_mm[0]), _u(asked), rule, provable=False)
        return word_points(zone, seen.beyond, seen.within)
    if (not seen.beyond and not seen.within) or seen.worst is None:
        return None
    kind, what = ("out-of-tolerance", "beyond its limits") if seen.beyond else ("within-uncertainty", "nearer to its limits than U")
    lower, upper = seen.limits
    return Reason(
        "out-of-tolerance" if kind == "out-of-tolerance" else "within-uncertainty",
        f"{seen.beyond or seen.within} point{'s' * ((seen.beyond or seen.within) != 1)} {what}, the worst "
        f"{seen.worst.deviation_mm:+.4f} mm at station {seen.worst.station_mm:.2f} mm, where {lower:g} .. {upper:g} mm are allowed.",
    )
