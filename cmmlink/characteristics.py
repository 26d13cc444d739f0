"""The characteristics of a plan as the inspection takes them: regions by stations, zones along the nominal, values beside the nominal's.

A plan without a tolerance has its first line-profile judge the points as they arrive. Where its zone varies, where it is filtered or
where its fit is limited, the points have the envelope of its zone at a free fit while they arrive, and the exact one at the end counts.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cmmlink.plan import PROFILE, AskedCharacteristic, AskedDatum, AskedFilter, AskedProfile, CtPlan, Datum, Place, Plan
from inspection import (
    Characteristic,
    CharacteristicResult,
    DatumFeature,
    DatumFeatures,
    Features,
    FitName,
    FreedomName,
    Freedoms,
    LineProfile,
    NominalProfile,
    Outline,
    ProfileFilter,
    Region,
    RigidTransform,
    RuleName,
    SectionCharacteristic,
    VaryingZone,
    WholeProfile,
    check_datum,
    default_gap_max_mm,
    features_of,
    find_airfoil,
    region_between,
    station_near,
    with_nominal,
    zone_words,
)


class Base(NamedTuple):
    """How the run itself judges its points, before the characteristics: at a datum or by a fit, and by which rule."""

    datum: RigidTransform | None
    fit: FitName
    rule: RuleName


def pose_of(datum: Datum | None) -> RigidTransform | None:
    """The known pose that a plan gives, if it gives one."""
    return None if datum is None else RigidTransform(math.radians(datum.rotation_deg), np.array(datum.translation_mm))


def known_pose(datum: RigidTransform | None, fit: FitName) -> RigidTransform | None:
    """Where the points lie if that is known beforehand: by the datum, or because none is to be fitted."""
    return RigidTransform.identity() if datum is None and fit == "none" else datum


def base_of(plan: Plan | CtPlan) -> Base:
    """How the run of a plan judges its points as they arrive."""
    registration = plan.registration
    datum = pose_of(registration.datum)
    if plan.tolerance is not None:
        return Base(datum, registration.fit, plan.rule)
    first = plan.first_profile
    if first.fit in ("none", "datum"):
        return Base(datum, registration.fit, first.rule or plan.rule)
    return Base(None, "minimum-zone" if first.fit == "minimum-zone" else "best-fit", first.rule or plan.rule)


def base_row(plan: Plan | CtPlan) -> int | None:
    """The place of the characteristic that fails wherever a point is out of the run's own zone; None where that proves nothing of any."""
    if plan.registration.reject_outliers:
        return None
    if plan.tolerance is not None:
        return 0
    first, registration = plan.first_profile, plan.registration
    elsewhere = first.datum is not None and known_pose(pose_of(registration.datum), registration.fit) is not None
    return None if first.filter is not None or elsewhere else plan.characteristics.index(first)


def notes_on_characteristics(plan: Plan | CtPlan) -> tuple[str, ...]:
    """What the reader has to know: where a U comes from, and by which zone or pose points are judged as they arrive, if it is another."""
    sources = tuple(f"U of {asked.name} is from {asked.uncertainty_from}" for asked in plan.characteristics if asked.uncertainty_from)
    if plan.tolerance is not None or _is_run_itself(plan.first_profile, plan):
        return sources
    name = plan.first_profile.name
    return (*sources, f"the points are shown against the envelope of {name} at a free fit; for the verdict {name} itself counts")


def is_short_form(found: Sequence[CharacteristicResult]) -> bool:
    """Whether a result has no more than the profile that a tolerance stands for, of which everything else tells already."""
    return [one.name for one in found] == [PROFILE] and found[0].certificate is None


class Builder:
    """Builds the characteristics of a plan for one nominal; what several share of it is found once."""

    def __init__(self, plan: Plan | CtPlan, profile: NominalProfile) -> None:
        self._plan, self._profile = plan, profile
        self._features: Features | None = None
        self._outline: Outline | None = None

    @property
    def short_form(self) -> tuple[Characteristic, ...]:
        """The characteristic that the tolerance stands for."""
        return (WholeProfile(PROFILE),) if self._plan.tolerance is not None else ()

    def build(self, number: int) -> Characteristic:
        """One of the characteristics, numbered from 0. Raises ValueError for what the nominal does not have."""
        asked = self._plan.characteristics[number]
        if not isinstance(asked, AskedProfile):
            return self._value(asked)
        if asked.fit == "datum" and self._known_pose is None and asked.datum is None:
            raise ValueError("fit datum needs a known pose or features: give registration.datum, or a datum of its own")
        if self._plan.tolerance is None and asked is self._plan.first_profile and _is_run_itself(asked, self._plan):
            return WholeProfile(asked.name)
        return self._line_profile(asked)

    @property
    def _known_pose(self) -> RigidTransform | None:
        return known_pose(pose_of(self._plan.registration.datum), self._plan.registration.fit)

    def _line_profile(self, asked: AskedProfile) -> LineProfile:
        profile, zone = self._profile, asked.zone
        lower, upper = zone.limits
        uncertainty = asked.uncertainty_mm
        if uncertainty is not None and 2 * uncertainty >= min(high - low for low, high in zip(lower, upper, strict=True)):
            raise ValueError(f"an uncertainty of {uncertainty:g} mm leaves nothing provable of its zone")
        whole = profile.length_mm, profile.curve.closed
        stations = zone.stations_mm
        limits = (
            VaryingZone.constant(lower[0], upper[0], *whole)
            if stations is None
            else VaryingZone(np.array(stations), np.array(lower), np.array(upper), *whole, zone.between, zone.border_mm)
        )
        region, words = self._region(asked)
        return LineProfile(
            name=asked.name,
            zone=limits,
            uncertainty_mm=uncertainty,
            region=region,
            fit=asked.fit,
            freedoms=None if asked.is_all_free else _freedoms(asked),
            datum=self._known_pose,
            features=self._datum(asked.datum),
            filter=_filter(asked.filter),
            rule=asked.rule or self._plan.rule,
            region_words=words,
            zone_words=zone_words(lower[0], upper[0]) if stations is None else f"along {len(stations)} stations, {zone.between}",
        )

    def _region(self, asked: AskedProfile) -> tuple[Region | None, str]:
        """The stations of a region, and its words."""
        if asked.region in ("UPPER", "LOWER"):
            return self._found_features.side("UPPER" if asked.region == "UPPER" else "LOWER"), asked.region
        if asked.region is not None:
            assert asked.within_mm is not None
            edge = self._found_features.edge("LE" if asked.region == "LE" else "TE", asked.within_mm)
            return edge, f"{asked.region} within {asked.within_mm:g} mm"
        if asked.from_ is None or asked.to is None:
            return None, "whole profile"
        region = region_between(self._profile, self._station(asked.from_, at_end=False), self._station(asked.to, at_end=True))
        return region, f"station {region.from_mm:.4g} .. {region.to_mm:.4g} mm"

    def _datum(self, asked: AskedDatum | None) -> DatumFeatures | None:
        """The features that place the part, which fix it as the nominal shows."""
        if asked is None:
            return None
        share, found = asked.within_mm or default_gap_max_mm(self._profile), list[DatumFeature]()
        if asked.line is not None:
            first, last = self._station(asked.line.from_, at_end=False), self._station(asked.line.to, at_end=True)
            region = region_between(self._profile, first, last)
            words = f"line station {region.from_mm:.4g} .. {region.to_mm:.4g} mm"
            found.append(DatumFeature("line", region.from_mm, region.to_mm, words))
        if asked.edge is not None:
            within = asked.within_mm or 3 * share
            edge = self._found_features.edge(asked.edge, within)
            found.append(DatumFeature("edge", edge.from_mm, edge.to_mm, f"edge {asked.edge} within {within:.3g} mm"))
        found += [self._point_of_datum(place, share) for place in asked.points]
        features = DatumFeatures(tuple(found))
        check_datum(self._profile, features)
        return features

    def _point_of_datum(self, place: Place, within_mm: float) -> DatumFeature:
        """A point of a datum, and how far around it points count."""
        station, length = self._station(place, at_end=False), self._profile.length_mm
        words = f"point at station {station:.4g} mm"
        if self._profile.curve.closed:
            return DatumFeature("point", (station - within_mm) % length, (station + within_mm) % length, words)
        if not within_mm <= station <= length - within_mm:
            raise ValueError(
                f"a {words} of the datum needs {within_mm:.3g} mm of an open profile, {length:.6g} mm long, on either side of it"
            )
        return DatumFeature("point", station - within_mm, station + within_mm, words)

    def _station(self, place: Place, at_end: bool) -> float:
        """The station of a place that a region begins or ends at: of the two of a trailing edge the one that it runs from or to."""
        if place.station_mm is not None:
            return place.station_mm + place.offset_mm
        if place.near is not None:
            return station_near(self._profile, place.near) + place.offset_mm
        features = self._found_features
        trailing = features.last if at_end else features.first
        return (features.nose if place.feature == "LE" else trailing) + place.offset_mm

    @property
    def _found_features(self) -> Features:
        if self._features is None:
            self._features = features_of(self._profile)
        return self._features

    def _value(self, asked: AskedCharacteristic) -> SectionCharacteristic:
        assert not isinstance(asked, AskedProfile)
        lower, upper = asked.limits_of_deviation
        told = {name: getattr(asked, name) for name in ("edge", "offset_mm", "window_deg", "axis", "place_mm") if hasattr(asked, name)}
        wanted = SectionCharacteristic(
            asked.name,
            asked.type,
            asked.method,
            lower,
            upper,
            math.nan if asked.nominal is None else asked.nominal,
            asked.expanded_uncertainty,
            datum=self._known_pose,
            features=self._datum(getattr(asked, "datum", None)),
            filter=_filter(getattr(asked, "filter", None)),
            **told,
        )
        return with_nominal(wanted, self._found_outline)

    def _found_outline(self) -> Outline:
        if self._outline is None:
            self._outline = Outline(find_airfoil(self._profile))
        return self._outline


def _is_run_itself(asked: AskedProfile, plan: Plan | CtPlan) -> bool:
    """Whether a line-profile of the whole profile is what the run itself judges, by the same U: a budget is that of the run."""
    if asked.uncertainty_mm is not None and plan.uncertainty is not None:
        return False
    constant = asked.zone.stations_mm is None
    placed = asked.fit in ("none", "datum") or (asked.fit != "tolerance" and asked.is_all_free)
    return constant and placed and asked.filter is None and asked.datum is None


def _freedoms(asked: AskedProfile) -> Freedoms:
    """The motions that a fit may make, and how far."""
    limits: dict[FreedomName, tuple[float, float]] = {}
    if asked.limits.x_mm is not None:
        limits["x"] = asked.limits.x_mm
    if asked.limits.y_mm is not None:
        limits["y"] = asked.limits.y_mm
    if asked.limits.rotation_deg is not None:
        low, high = asked.limits.rotation_deg
        limits["rotation"] = (math.radians(low), math.radians(high))
    return Freedoms.about(asked.pivot_mm, asked.free, math.radians(asked.x_axis_deg), limits)


def _filter(asked: AskedFilter | None) -> ProfileFilter | None:
    return None if asked is None else ProfileFilter(asked.cutoff_mm, asked.order, asked.robust)
