"""Where a drawn section ends at its trailing edge: parts that are longer or shorter than the nominal by known amounts."""

from functools import cache

import numpy as np
import pytest

from inspection import (
    ActualSection,
    LiveInspection,
    NominalProfile,
    NurbsCurve,
    Outline,
    RigidTransform,
    SectionCharacteristic,
    ToleranceZone,
    Verdict,
    chord,
    deviations,
    discretize,
    draw_actual_section,
    find_airfoil,
    find_camber_line,
    with_nominal,
)
from tests.inspection.characteristics.airfoils import Array
from tests.inspection.characteristics.test_edge_thickness import tapered
from tests.inspection.profiles import even_in_arc_length, naca

CURVES = {"sharp": lambda: naca("2412"), "open": lambda: naca("2412", sharp=False), "blunt": lambda: tapered()[0].curve}
SPACING_MM = 0.051  # of 4,000 points, no more


@cache
def nominal(kind: str) -> NominalProfile:
    return discretize(CURVES[kind](), samples=1000)


def moved_tail(kind: str, by_mm: float, count: int = 4000) -> Array:
    """Points of a part whose rear is drawn out along the chord: by nothing at x = 60, by all of it at the trailing edge."""
    curve: NurbsCurve = nominal(kind).curve
    points = curve.point(even_in_arc_length(curve, count))
    moved = points.copy()
    moved[:, 0] += by_mm * np.clip((points[:, 0] - 60) / (points[:, 0].max() - 60), 0, 1)
    return moved


def drawn(kind: str, points: Array) -> ActualSection:
    return draw_actual_section(find_airfoil(nominal(kind)), deviations(points, nominal(kind)), gap_max_mm=2.0)


def extent_mm(section: ActualSection) -> float:
    return chord(section.section, find_camber_line(section.section), "x-extent").value


@cache
def chord_of(kind: str, limit_mm: float) -> SectionCharacteristic:
    asked = SectionCharacteristic("chord", "chord", "x-extent", -limit_mm, limit_mm)
    return with_nominal(asked, lambda: Outline(find_airfoil(nominal(kind))))


def judged(kind: str, points: Array, limit_mm: float) -> tuple[float, Verdict, list[str]]:
    """The deviation of the chord, its verdict, and the kinds of its reasons."""
    whole = chord_of(kind, limit_mm)
    live = LiveInspection(nominal(kind), ToleranceZone(-2, 2), datum=RigidTransform.identity(), characteristics=(whole,))
    live.add(points)
    (found,) = live.finish().characteristics
    return found.deviation, found.verdict, [reason.kind for reason in found.reasons]


@pytest.mark.parametrize("kind", CURVES)
@pytest.mark.parametrize("by_mm", [0.0, 0.02, 0.3])
def test_a_part_that_is_longer_has_a_longer_chord(kind: str, by_mm: float) -> None:
    """To within the spacing of the points at an edge without a flat, and never too long; by a flat closely."""
    longer = extent_mm(drawn(kind, moved_tail(kind, by_mm))) - extent_mm(drawn(kind, moved_tail(kind, 0.0)))
    assert longer == pytest.approx(by_mm, abs=5e-3 if kind == "blunt" else SPACING_MM)
    assert longer <= by_mm + 5e-3


@pytest.mark.parametrize("kind", ["sharp", "open"])
def test_a_part_that_is_shorter_is_not_taken_for_one_that_is_as_long_as_its_nominal(kind: str) -> None:
    """Nobody knows whether it is broken off or was not measured to its end, so neither is proven."""
    for by_mm in (0.2, 0.9):
        shorter = drawn(kind, moved_tail(kind, -by_mm))
        assert shorter.is_unseen[[0, -1]].all()
        assert any("mm before its trailing edge" in note for note in shorter.notes)
        _, verdict, reasons = judged(kind, moved_tail(kind, -by_mm), 0.05)
        assert (verdict, reasons[0]) == (Verdict.UNCERTAIN, "unseen")
    assert judged(kind, moved_tail(kind, 0.0), 0.05)[1:] == (Verdict.CONFORM, [])
    assert judged(kind, moved_tail(kind, 0.3), 0.05)[1:] == (Verdict.NONCONFORM, ["out-of-tolerance"])


@pytest.mark.parametrize("by_mm", [-0.3, -0.06, 0.0, 0.06, 0.3])
def test_a_flat_tells_where_a_blunt_edge_is(by_mm: float) -> None:
    deviation, verdict, _ = judged("blunt", moved_tail("blunt", by_mm), 0.05)
    assert deviation == pytest.approx(by_mm, abs=6e-3)
    assert verdict is (Verdict.CONFORM if abs(by_mm) < 0.05 else Verdict.NONCONFORM)


@pytest.mark.parametrize("kind", CURVES)
def test_order_and_dwelling_do_not_move_the_end(kind: str) -> None:
    points = moved_tail(kind, 0.3)
    mixed = np.random.default_rng(2).permutation(np.vstack([points, np.repeat(points[5:6], 500, axis=0)]))
    assert extent_mm(drawn(kind, mixed)) == pytest.approx(extent_mm(drawn(kind, points)), abs=1e-6)


@pytest.mark.parametrize("kind", CURVES)
@pytest.mark.parametrize("count", [300, 1500])
def test_a_perfect_part_keeps_its_chord_however_few_points_it_has(kind: str, count: int) -> None:
    whole = drawn(kind, moved_tail(kind, 0.0, count))
    assert not whole.is_unseen.any()
    assert extent_mm(whole) == pytest.approx(chord(whole.nominal, find_camber_line(whole.nominal), "x-extent").value, abs=2e-5)


def test_the_camber_line_of_a_drawn_arc_does_not_turn_aside() -> None:
    """Along the arc of a nose all circles are one, and contacts that noise picks there give no direction."""
    curve = nominal("blunt").curve
    points = curve.point(even_in_arc_length(curve, 4000))
    for size in (0.998, 0.9995, 1.0005, 1.002):
        section = drawn("blunt", points * (size, 1.0)).section
        assert np.abs(find_camber_line(section).nose_mm[1]) < 0.7  # of a nose of radius 5: its chord is right to 0.05 mm
