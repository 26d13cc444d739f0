"""One characteristic of every type, and a part that they are asked of."""

from functools import cache
from typing import Any

import numpy as np

from inspection import (
    Characteristic,
    CharacteristicResult,
    Freedoms,
    InspectionResult,
    LineProfile,
    LiveInspection,
    Missing,
    NominalProfile,
    Outline,
    ProfileFilter,
    Region,
    RigidTransform,
    SectionCharacteristic,
    ToleranceZone,
    VaryingZone,
    WholeProfile,
    discretize,
    find_airfoil,
    with_nominal,
)
from inspection.datum import DatumFeature, DatumFeatures
from inspection.evaluation.region import features_of
from tests.inspection import profiles
from tests.inspection.profiles import Array

DATUM = RigidTransform(0.3, np.array([4.0, -2.0]))
COUNT = 240
LIMIT = 0.06


@cache
def nominal() -> NominalProfile:
    return discretize(profiles.naca("4412"), samples=2000)


def even(lower: float, upper: float) -> VaryingZone:
    return VaryingZone.constant(lower, upper, nominal().length_mm, nominal().curve.closed)


def point(station: float) -> DatumFeature:
    return DatumFeature("point", station - 3.0, station + 3.0, f"point at station {station:g} mm")


@cache
def by_features() -> DatumFeatures:
    """A line along the rear of one side, and the nose: what is measured of a part to place it."""
    nose = features_of(nominal()).nose
    return DatumFeatures((DatumFeature("line", 20.0, 70.0, "line station 20 .. 70 mm"), point(nose)))


def value(name: str, type_: Any, method: str, limit: float = LIMIT, **told: Any) -> SectionCharacteristic:
    asked = SectionCharacteristic(name, type_, method, -limit, limit, datum=DATUM, **told)
    return with_nominal(asked, lambda: Outline(find_airfoil(nominal())))


@cache
def every_type() -> tuple[Characteristic, ...]:
    """Of the profile every fit, with regions, filters and freedoms; of the section every kind. Their limits suit `form`."""
    length = nominal().length_mm
    features = features_of(nominal())
    flank = Region(0.1 * length, 0.35 * length)
    varying = VaryingZone(
        np.array([0.0, 0.2, 0.5, 0.8]) * length, np.array([-0.06, -0.08, -0.06, -0.06]), np.array([0.06, 0.06, 0.09, 0.06]), length, True
    )
    freedoms = Freedoms.about((40.0, 2.0), ("y", "rotation"), limits={"y": (-0.2, 0.2)})
    return (
        WholeProfile("profile"),
        LineProfile("flank at the pose of the run", even(-LIMIT, LIMIT), region=flank, fit="none"),
        LineProfile("location", even(-LIMIT, LIMIT), fit="datum", datum=DATUM),
        LineProfile("at its own datum", even(-LIMIT, LIMIT), fit="datum", features=by_features()),
        LineProfile("flank", even(-LIMIT, LIMIT), region=flank, fit="best-fit"),
        LineProfile("filtered", even(-LIMIT, LIMIT), fit="best-fit", filter=ProfileFilter(3.0), rule="best-fit"),
        LineProfile("edge", even(-LIMIT, LIMIT), region=features.edge("LE", 20.0), fit="minimum-zone"),
        LineProfile("over the seam", even(-LIMIT, LIMIT), region=Region(0.8 * length, 0.2 * length), fit="none"),
        LineProfile("varying", varying, fit="tolerance"),
        LineProfile("stepped", stepped(), fit="none"),
        LineProfile("stepped and fitted", stepped(0.4), region=Region(0.7 * length, 0.6 * length), fit="tolerance"),
        LineProfile("limited", even(-LIMIT, LIMIT), fit="best-fit", freedoms=freedoms, datum=DATUM),
        value("chord", "chord", "tangent", 0.15),
        value("angle", "chord-angle", "nose-tail", 0.2),
        value("thickness", "thickness", "inscribed", 0.15),
        value("edge thickness", "edge-thickness", "tip-arc", 0.15, offset_mm=5.0),
        value("radius", "edge-radius", "circle", 0.5, window_deg=40.0),
        value("camber", "camber", "inscribed", 0.15),
        value("twist", "twist", "best-fit", 0.1),
        value("displacement", "displacement", "best-fit", 0.1),
        value("twist of its own datum", "twist", "best-fit", 0.1, features=by_features()),
    )


def stepped(border_mm: float = 0.0) -> VaryingZone:
    """A zone with steps: at the corner, which is the seam, at the nose, and two on a flank with a narrow one between them."""
    length = nominal().length_mm
    at = np.array([0.0, 0.3 * length, 0.3 * length + 8.0, features_of(nominal()).nose])
    return VaryingZone(at, np.array([-0.06, -0.05, -0.07, -0.06]), np.array([0.06, 0.05, 0.09, 0.08]), length, True, "constant", border_mm)


def stations(count: int = COUNT) -> Array:
    return (np.arange(count) + 0.5) / count * nominal().length_mm


def form(station: Array, bump_mm: float = 0.0, at_mm: float = 0.0, width_mm: float = 3.0) -> Array:
    """The deviation at stations (m,): two waves, and a bump as high and as wide as is asked for."""
    length = nominal().length_mm
    s = 2 * np.pi * station / length
    off = np.mod(station - at_mm + length / 2, length) - length / 2
    return 0.012 * np.sin(2 * s + 0.4) + 0.008 * np.cos(5 * s) + bump_mm * np.exp(-((off / width_mm) ** 2))


def points_at(station: Array, deviation: Array) -> Array:
    """Section points (m, 2) with these deviations at these stations; the datum brings them onto the nominal."""
    curve = nominal().curve
    u = np.interp(station, nominal().station_mm, nominal().parameter)
    for _ in range(4):
        u = u - (curve.station_mm(u) - station) / np.hypot(*curve.derivatives(u, 1)[1].T)
    places = curve.point(u) + deviation[:, None] * nominal().outward * profiles.left_normal(curve, u)
    return DATUM.inverse().apply(places)


def run(
    points: Array,
    *,
    sizes: tuple[int, ...] = (),
    complete: bool = True,
    missing: Missing | None = None,
    asked: tuple[Characteristic, ...] | None = None,
    **terms: Any,
) -> InspectionResult:
    """Inspect points in batches of these sizes, the last one of what is left."""
    live = LiveInspection(
        nominal(), ToleranceZone(-LIMIT, LIMIT), coverage_min=0.95, provisional=False, characteristics=asked or every_type(), **terms
    )
    for batch in np.split(points, np.cumsum(sizes)):
        live.add(batch)
    return live.finish(complete, missing)


def named(result: InspectionResult) -> dict[str, CharacteristicResult]:
    return {one.name: one for one in result.characteristics}
