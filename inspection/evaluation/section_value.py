"""Numbers of an airfoil section: measured on the actual section by the method that gave the nominal one, and held against limits.

A value stands on places of the section. Where one of them was not measured, or the stretch that the method looks at has a gap longer
than is allowed, neither side is proven, however the spline bridges it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import cast, get_args

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.actual import ActualSection, draw_actual_section
from inspection.characteristics.camber import maximum_camber
from inspection.characteristics.characteristic import (
    CharacteristicResult,
    SectionCharacteristic,
    SectionKind,
    consumption_of,
)
from inspection.characteristics.chord import ChordAngleMethod, ChordMethod, chord, chord_angle
from inspection.characteristics.edge_radius import EdgeRadiusMethod, edge_radius
from inspection.characteristics.error_fields import MovedOutlines
from inspection.characteristics.inscribed import CamberLine, find_camber_line
from inspection.characteristics.outline import AirfoilSection
from inspection.characteristics.placement import displacement, twist_by_fit
from inspection.characteristics.section_value import SectionValue, angle_within_half_a_turn, no_places
from inspection.characteristics.thickness import EdgeThicknessMethod, ThicknessMethod, edge_thickness, maximum_thickness
from inspection.conclusion import Reason
from inspection.datum import FoundDatum
from inspection.errors import InspectionError
from inspection.evaluation.basis import Basis, filter_deviations
from inspection.evaluation.datum import UNSTATED, datum_of, fixed_place
from inspection.evaluation.region import features_of, region_around
from inspection.evaluation.value_uncertainty import LINEARISED, OF_POSE, uncertainty_of_placing, uncertainty_of_value
from inspection.evaluation.value_verdict import judge_deviation
from inspection.filters import ProfileFilter
from inspection.first_use import OnFirstUse
from inspection.freedoms import Freedoms
from inspection.gaps import Measured
from inspection.limited_fit import register_within
from inspection.profile_uncertainty import pose_uncertainty
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.signed_deviations import deviations
from inspection.tolerance import decision_words
from inspection.verdict import Rejection, Verdict

Array = NDArray[np.float64]

METHODS_OF_SECTIONS: Mapping[SectionKind, tuple[str, ...]] = {
    "chord": get_args(ChordMethod),
    "chord-angle": get_args(ChordAngleMethod),
    "thickness": get_args(ThicknessMethod),
    "edge-thickness": get_args(EdgeThicknessMethod),
    "edge-radius": get_args(EdgeRadiusMethod),
    "camber": ("inscribed",),
    "twist": ("best-fit", *get_args(ChordAngleMethod)),
    "displacement": ("best-fit",),
}
PLACED: tuple[SectionKind, ...] = ("chord-angle", "twist", "displacement")  # kinds that are counted from a datum

_NO_DATUM = "It is counted from a datum (registration.datum): a fit of all freedoms leaves nothing of it."
_FEWEST_POINTS = 4  # of a fit: one more than there are freedoms
_TIP_KNOTS = 3.0  # knots of the actual section to either side of a tip, on which its curvature depends
_ON_ARC = 2.0  # times as far from the tip as an arc of the radius would have turned so far, or this part of it, ends an edge's window
_OF_DRAWING = 2.0  # times the difference between both ways of drawing edges: what a value is doubted by
_AXES = {"x": 0, "y": 1, "total": 2}


class Outline:
    """A section, nominal or actual, with the camber line that several of its values share; it is found when it is first asked for."""

    def __init__(self, section: AirfoilSection) -> None:
        self.section = section
        self.moved = OnFirstUse(lambda: MovedOutlines(section, Outline))
        self._camber: CamberLine | None = None

    @property
    def camber(self) -> CamberLine:
        """The camber line."""
        if self._camber is None:
            self._camber = find_camber_line(self.section)
        return self._camber


_MEASURES: Mapping[str, Callable[[Outline, SectionCharacteristic], SectionValue]] = {
    "chord": lambda of, asked: chord(of.section, of.camber, cast(ChordMethod, asked.method)),
    "chord-angle": lambda of, asked: chord_angle(of.section, of.camber, cast(ChordAngleMethod, asked.method)),
    "thickness": lambda of, asked: maximum_thickness(of.section, of.camber, cast(ThicknessMethod, asked.method)),
    "edge-thickness": lambda of, asked: edge_thickness(
        of.section, of.camber, asked.edge, asked.offset_mm, cast(EdgeThicknessMethod, asked.method)
    ),
    "edge-radius": lambda of, asked: edge_radius(of.section, asked.edge, cast(EdgeRadiusMethod, asked.method), asked.window_deg),
    "camber": lambda of, asked: maximum_camber(of.section, of.camber),
}


def with_nominal(asked: SectionCharacteristic, nominal: Callable[[], Outline]) -> SectionCharacteristic:
    """The characteristic with the value of the nominal section. Raises InspectionError where the section has none by that method.

    nominal : gives the nominal section; it is not asked for what the best fit tells, which needs no airfoil
    """
    if asked.method not in METHODS_OF_SECTIONS[asked.type]:
        raise ValueError(f"the method of {asked.type} is {' or '.join(METHODS_OF_SECTIONS[asked.type])}, not {asked.method!r}")
    if asked.type == "displacement" or (asked.type == "twist" and asked.method == "best-fit"):
        section = None
        found = SectionValue(asked.type, asked.method, 0.0, "deg" if asked.type == "twist" else "mm", no_places(), ())
    elif asked.type == "twist":
        section = nominal().section
        found = chord_angle(section, nominal().camber, cast(ChordAngleMethod, asked.method))
    else:
        section = nominal().section
        found = _MEASURES[asked.type](nominal(), asked)
        _refuse_wide_window(asked, found)
    drawn = 0.0 if asked.type == "twist" else found.value
    value = drawn if math.isnan(asked.nominal_value) else asked.nominal_value
    asked = replace(asked, section=section, nominal=found, nominal_value=value)
    measure = _measure_of(asked)
    return replace(asked, sensitivities=OnFirstUse(lambda: nominal().moved.value.sensitivities(measure)) if measure is not None else None)


def _refuse_wide_window(asked: SectionCharacteristic, found: SectionValue) -> None:
    """Raise InspectionError where the window of an edge's circle runs on into the sides: a circle through these is no radius of the edge.

    The window of an arc ends where the arc has turned so far: as far from the tip as the radius says.
    """
    if (asked.type, asked.method) != ("edge-radius", "circle"):
        return
    tip, _, *ends = found.places_mm
    by_radius = 2 * found.value * math.sin(math.radians(asked.window_deg) / 2)
    away = [float(np.hypot(*(end - tip))) for end in ends]
    if max(away) > _ON_ARC * by_radius or min(away) < by_radius / _ON_ARC:
        raise InspectionError(
            f"a window of {asked.window_deg:g} degrees reaches {max(away):.4g} mm from the tip of the {asked.edge} edge, into its sides: "
            f"the circle through it has a radius of {found.value:.4g} mm, which is none of the edge; choose a smaller window_deg"
        )


def _measure_of(asked: SectionCharacteristic) -> Callable[[Outline], float] | None:
    """How the number is measured on an outline; None where it is not."""
    if asked.type == "twist" and asked.method != "best-fit":
        return lambda of: chord_angle(of.section, of.camber, cast(ChordAngleMethod, asked.method)).value
    return (lambda of: _MEASURES[asked.type](of, asked).value) if asked.type in _MEASURES else None


class ActualOutlines:
    """The actual section of a run, drawn once for every filter asked for and either way of edges, and the best fit of its points."""

    def __init__(self, basis: Basis) -> None:
        self._basis = basis
        self._drawn: dict[tuple[ProfileFilter | None, bool], tuple[ActualSection, Outline]] = {}
        self._fit: Registration | None = None

    def drawn(self, asked: SectionCharacteristic, edges_as_wholes: bool = False) -> tuple[ActualSection, Outline]:
        """The actual section as a characteristic wants it. Raises InspectionError where too few points lie on it."""
        assert asked.section is not None
        key = asked.filter, edges_as_wholes
        if key not in self._drawn:
            rows = np.concatenate([self._basis.drawn(self._basis.rows(None)), self._beyond_ends()])
            pose, gap = self._drawn_at(), self._basis.result.gap_max_mm
            d = self._basis.deviations_at(rows, pose)
            filtered = None if asked.filter is None else filter_deviations(d, self._basis.nominal, asked.filter).waviness_mm.copy()
            actual = draw_actual_section(asked.section, d, filtered, asked.filter, gap_max_mm=gap, edges_as_wholes=edges_as_wholes)
            actual = actual.moved(self._basis.pose.after(pose.inverse()))
            self._drawn[key] = actual, Outline(actual.section)
        return self._drawn[key]

    def _drawn_at(self) -> RigidTransform:
        """The pose at which the section is drawn: the best fit, wherever the run judged its points.

        The deviations of a part that lies off its datum turn with the normal, within less than a knot around an edge: a spline over the
        station loses that, and a perfect part would have another radius and chord than its nominal.
        """
        if self._basis.result.fit == "best-fit" and self._basis.terms.known_pose is None:
            return self._basis.pose
        fit = self.best_fit()
        return fit.nominal_from_section if fit.converged else self._basis.pose

    def _beyond_ends(self) -> NDArray[np.int64]:
        """Rows (k,) of the points beyond an open end, in an order of their own: they have no verdict, but tell where the part ends."""
        rows = np.flatnonzero(self._basis.result.rejection == Rejection.BEYOND_END)
        points = self._basis.result.section_at(rows)
        return rows[np.lexsort((points[:, 1], points[:, 0]))]

    def best_fit(self) -> Registration:
        """The best fit of all points, from the pose of the run on."""
        if self._fit is None:
            basis, terms = self._basis, self._basis.terms
            points = basis.result.section_at(basis.drawn(basis.rows(None)))
            if len(points) < _FEWEST_POINTS:
                raise InspectionError(f"{len(points)} points are too few for a best fit")
            free = Freedoms.about(basis.pose.apply(points).mean(axis=0))
            settings = (terms.method, terms.tip_radius_mm, terms.target_mm, terms.weights)
            self._fit = register_within(points, basis.nominal, basis.pose, free, *settings).registration
        return self._fit


def judge_value(asked: SectionCharacteristic, basis: Basis, outlines: ActualOutlines) -> CharacteristicResult:
    """A number of the section with its limits, its deviation and its verdict."""
    nominal = asked.nominal
    assert nominal is not None
    by_budget = basis.terms.uncertainty is not None and not asked.uncertainty
    measured_datum: FoundDatum | None = None
    try:
        if asked.features is not None:
            measured_datum = datum_of(asked.features, basis)
            asked = replace(asked, datum=measured_datum.pose)
        if asked.type in PLACED and asked.datum is None:
            raise InspectionError(_NO_DATUM)
        value, actual = _find(asked, basis, outlines)
        by_datum = _uncertainty_of_datum(asked, basis, measured_datum) if by_budget and measured_datum is not None else 0.0
        asked = replace(asked, uncertainty=_uncertainty(asked, basis, outlines, value, actual) + by_datum)
    except InspectionError as error:
        conclusion = basis.conclude(Verdict.UNCERTAIN, Reason("no-value", _sentence(str(error))), basis.measured(None), basis.result.judged)
        return replace(_bare(asked, nominal, basis), verdict=conclusion.verdict, reasons=conclusion.reasons)
    how = (LINEARISED if actual is not None else OF_POSE,) if by_budget else ()
    if measured_datum is not None and not asked.uncertainty:
        how = (*how, UNSTATED)
    deviation = value.value - asked.nominal_value
    deviation = angle_within_half_a_turn(deviation) if nominal.unit == "deg" else deviation
    measured = _measured(asked, basis, value, actual)
    drawing = 0.0 if actual is None else _doubt_of_drawing(asked, basis, outlines, value)
    points, why = judge_deviation(asked, value, deviation, drawing, measured, basis, actual)
    conclusion = basis.conclude(points, why, measured, basis.result.judged)
    places = tuple((name, float(x), float(y)) for name, (x, y) in zip(value.place_names, value.places_mm.tolist(), strict=True))
    return replace(
        _bare(asked, nominal, basis),
        method=_method_words(value),
        value=value.value,
        deviation=deviation,
        consumption=consumption_of(deviation, asked.lower, asked.upper),
        verdict=conclusion.verdict,
        reasons=conclusion.reasons,
        pose=basis.pose,
        coverage=measured.coverage,
        gap_mm=measured.gap.length_mm,
        datum=measured_datum,
        drawing=drawing,
        places_mm=places,
        notes=(*value.notes, *(actual.notes[:1] if actual is not None else ()), *_words_of_drawing(drawing, nominal.unit), *how),
    )


def _bare(asked: SectionCharacteristic, nominal: SectionValue, basis: Basis) -> CharacteristicResult:
    """What is known of a characteristic before anything is measured."""
    placed = asked.type in PLACED
    return CharacteristicResult(
        name=asked.name,
        type=asked.type,
        method=_method_words(nominal),
        value=math.nan,
        nominal=asked.nominal_value,
        unit=nominal.unit,
        lower=asked.lower,
        upper=asked.upper,
        deviation=math.nan,
        consumption=math.nan,
        uncertainty=asked.uncertainty,
        rule=decision_words(basis.terms.zone.rule, asked.uncertainty, asked.upper - asked.lower, nominal.unit),
        verdict=Verdict.UNCERTAIN,
        reasons=(),
        fit="none" if not placed else "datum" if asked.features is None else f"datum: {asked.features.words}",
        filter=asked.filter.words if asked.filter else "none",
        region_words=f"{asked.edge} edge" if asked.type in ("edge-radius", "edge-thickness") else "whole profile",
    )


def _doubt_of_drawing(asked: SectionCharacteristic, basis: Basis, outlines: ActualOutlines, value: SectionValue) -> float:
    """How far the drawn section may mislead about a value, in its unit; infinite where it has none if its edges move as wholes.

    A spline cannot follow an edge whose radius is below its knots: of a part that is too long by 0.2 mm it shows 0.16. Where edges may
    move as wholes it comes within a fifth of that error, so that twice the difference between both is more than the error.
    """
    try:
        other, _ = _find(asked, basis, outlines, edges_as_wholes=True)
    except InspectionError:
        return math.inf
    pairs = [(value.value, other.value), (value.other, other.other)]
    if value.value * other.value < 0 and math.isfinite(value.other):  # of two sides that are nearly as large, either may be the larger
        pairs = [(value.value, other.other), (value.other, other.value)]
    off = [there - here for here, there in pairs if not math.isnan(here)]
    return _OF_DRAWING * max(abs(angle_within_half_a_turn(one) if value.unit == "deg" else one) for one in off)


def _words_of_drawing(doubt: float, unit: str) -> tuple[str, ...]:
    """How well a value is drawn, in words."""
    return (f"the drawn section may mislead by {doubt:.2g} {'' if unit == '1' else unit}".rstrip(),) if 0.0 < doubt < math.inf else ()


def _find(
    asked: SectionCharacteristic, basis: Basis, outlines: ActualOutlines, edges_as_wholes: bool = False
) -> tuple[SectionValue, ActualSection | None]:
    """The actual value, and the drawn section that it was found on; a place or an angle as the datum sees it."""
    if asked.datum is not None and (asked.type == "displacement" or (asked.type == "twist" and asked.method == "best-fit")):
        fit = outlines.best_fit()
        seen = replace(fit, nominal_from_section=fit.nominal_from_section.after(asked.datum.inverse()))
        return (twist_by_fit(seen) if asked.type == "twist" else displacement(seen, asked.place_mm)[_AXES[asked.axis]]), None
    actual, outline = outlines.drawn(asked, edges_as_wholes)
    if asked.type not in PLACED:
        return _MEASURES[asked.type](outline, asked), actual
    assert asked.datum is not None
    angle = chord_angle(outline.section, outline.camber, cast(ChordAngleMethod, asked.method))
    turned = angle_within_half_a_turn(angle.value + math.degrees(asked.datum.rotation_rad - basis.pose.rotation_rad))
    if asked.type == "chord-angle":
        return replace(angle, value=turned), actual
    assert asked.nominal is not None
    return replace(angle, name="twist", value=angle_within_half_a_turn(turned - asked.nominal.value)), actual


def _uncertainty(
    asked: SectionCharacteristic, basis: Basis, outlines: ActualOutlines, value: SectionValue, actual: ActualSection | None
) -> float:
    """U of a value: its own where the characteristic states one, else that of the budget of the run."""
    if basis.terms.uncertainty is None or asked.uncertainty:
        return asked.uncertainty
    stated = basis.terms.uncertainty.stated
    if actual is None or asked.sensitivities is None:
        moved = value.places_mm[1] - value.places_mm[0] if len(value.places_mm) else np.zeros(2)
        along = np.eye(2)[_AXES[asked.axis]] if asked.axis != "total" else moved
        return uncertainty_of_placing(asked, basis, outlines.best_fit().nominal_from_section, along, stated)
    is_known = asked.type in PLACED or basis.terms.known_pose is not None
    return uncertainty_of_value(asked.sensitivities.value, is_known, basis, actual, stated)


def _uncertainty_of_datum(asked: SectionCharacteristic, basis: Basis, datum: FoundDatum) -> float:
    """What a measured datum adds to U of an angle or a place, by the budget of the run."""
    assert basis.terms.uncertainty is not None
    stated = basis.terms.uncertainty.stated
    covariance, left = pose_uncertainty(datum, stated, asked.place_mm, fixed_place(stated, datum))
    if asked.type != "displacement":
        return math.degrees(stated.coverage_factor * math.sqrt(covariance[2, 2]) + abs(float(left[2])))
    axis = _AXES[asked.axis]
    variance = float(np.linalg.eigvalsh(covariance[:2, :2]).max()) if asked.axis == "total" else float(covariance[axis, axis])
    return stated.coverage_factor * math.sqrt(max(variance, 0.0)) + float(np.hypot(*left[:2]))


def _measured(asked: SectionCharacteristic, basis: Basis, value: SectionValue, actual: ActualSection | None) -> Measured:
    """How much was measured of what the value depends on: of an edge the stretch around it, else the whole profile."""
    if actual is None or asked.type not in ("edge-radius", "edge-thickness"):
        return basis.measured(None)
    where = (
        value.places_mm[:2] if asked.type == "edge-thickness" else value.places_mm[2:] if len(value.places_mm) > 2 else value.places_mm[:1]
    )
    stations = deviations(where, basis.nominal).station_mm
    regions = region_around(features_of(basis.nominal, asked.section), asked.edge, stations, _TIP_KNOTS * actual.knots_mm)
    found = [basis.measured(region) for region in regions]
    return Measured(min(one.coverage for one in found), max((one.gap for one in found), key=lambda gap: gap.length_mm))


def _method_words(value: SectionValue) -> str:
    """The method of a value with its window, such as "circle, window 30 deg"."""
    window = (f"{name.rpartition('_')[0].replace('_', ' ')} {number:g} {name.rpartition('_')[2]}" for name, number in value.window)
    return ", ".join([value.method, *window])


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:].removesuffix(".") + "."
