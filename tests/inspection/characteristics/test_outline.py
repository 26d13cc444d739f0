import numpy as np
import pytest

from inspection import NominalError, NurbsCurve, discretize, edge_radius, find_airfoil
from inspection.characteristics.outline import Edge
from tests.inspection.characteristics.airfoils import bent_ellipse, ellipse_section, invert
from tests.inspection.profiles import clamped, ellipse, moved_curve, naca, polygon


def with_flat_end(sharpness: str = "4412") -> NurbsCurve:
    """A section whose two ends at the trailing edge are joined by a straight flat: one closed curve with two corners."""
    wrap = naca(sharpness, sharp=False)
    first, last = wrap.control_points_mm[0], wrap.control_points_mm[-1]
    flat = last + (first - last) * np.array([[1 / 3], [2 / 3], [1.0]])
    knots = np.concatenate([wrap.knots[:-1], np.full(4, wrap.knots[-1] + 0.1)])
    return NurbsCurve(3, np.vstack([wrap.control_points_mm, flat]), knots, closed=True)


def reversed_curve(curve: NurbsCurve) -> NurbsCurve:
    """The same curve, run the other way."""
    return NurbsCurve(
        curve.degree, curve.control_points_mm[::-1].copy(), (curve.knots[0] + curve.knots[-1]) - curve.knots[::-1], closed=curve.closed
    )


def test_a_sharp_trailing_edge_is_the_corner() -> None:
    section = find_airfoil(naca("2412"))
    assert section.trailing == "sharp"
    assert section.ends_mm() == pytest.approx(np.array([[100.0, 0.0], [100.0, 0.0]]), abs=1e-9)


def test_an_open_trailing_edge_has_two_ends() -> None:
    section = find_airfoil(naca("4412", sharp=False))
    assert section.trailing == "open"
    gap = np.hypot(*(section.ends_mm()[1] - section.ends_mm()[0]))
    assert gap == pytest.approx(2 * 5 * 12 * 0.0021, abs=1e-9)  # the sum of the thickness equation's coefficients is 0.0021


def test_a_blunt_trailing_edge_lies_between_two_corners() -> None:
    section, open_one = find_airfoil(with_flat_end()), find_airfoil(naca("4412", sharp=False))
    assert section.trailing == "blunt"
    assert section.ends_mm() == pytest.approx(open_one.ends_mm(), abs=1e-9)
    assert section.point([section.nose]) == pytest.approx(open_one.point([open_one.nose]), abs=1e-6)


@pytest.mark.parametrize("make", [lambda: naca("2412"), lambda: naca("4412", sharp=False), with_flat_end], ids=["sharp", "open", "blunt"])
def test_the_sides_do_not_depend_on_the_sense_of_the_curve(make) -> None:  # type: ignore[no-untyped-def]
    for section in (find_airfoil(make()), find_airfoil(reversed_curve(make()))):
        middles = {side: section.point([(low + high) / 2])[0] for side, (low, high) in section.sides().items()}
        assert middles["upper"][1] > middles["lower"][1]
        assert section.side_of(section.first) == ("upper" if section.upper_first else "lower")
        inside = section.points_mm + 1e-3 * section.normal
        assert np.ptp(inside[:, 0]) < np.ptp(section.points_mm[:, 0])


def test_the_upper_side_is_on_the_left_of_who_looks_towards_the_trailing_edge() -> None:
    section = find_airfoil(moved_curve(naca("2412"), 180.0, (0.0, 0.0)))
    low, high = section.sides()["upper"]
    assert section.point([(low + high) / 2])[0, 1] < 0  # upside down, so that it lies below


def test_the_blunter_tip_of_a_round_section_is_the_leading_edge() -> None:
    t = np.linspace(0, 2 * np.pi, 201)[:-1]
    egg = np.column_stack([50 * np.cos(t), (8 + 3 * np.cos(t)) * np.sin(t)])  # blunter at x = +50
    section = find_airfoil(NurbsCurve.interpolate(egg, closed=True))
    assert section.trailing == "round"
    assert section.point([section.nose])[0] == pytest.approx([50.0, 0.0], abs=1e-3)
    told = find_airfoil(NurbsCurve.interpolate(egg, closed=True), leading_near_mm=(-40.0, 5.0))
    assert told.point([told.nose])[0] == pytest.approx([-50.0, 0.0], abs=1e-3)


def test_of_two_equal_tips_the_one_of_smaller_x_is_the_leading_edge() -> None:
    assert ellipse_section().point([ellipse_section().nose])[0] == pytest.approx([-50.0, 0.0], abs=1e-5)
    assert bent_ellipse().point([bent_ellipse().nose])[0] == pytest.approx(invert(np.array([[-50.0, 0.0]]))[0], abs=0.5)


def test_the_nominal_profile_tells_on_which_side_the_material_lies() -> None:
    curve = ellipse(50, 6)
    assert find_airfoil(curve).outward == -1
    assert find_airfoil(discretize(curve, samples=100, material="left")).outward == -1
    assert find_airfoil(discretize(curve, samples=100, material="right")).outward == 1


@pytest.mark.parametrize(
    ("curve", "message"),
    [
        (clamped(3, [(0, 0), (0, 50), (60, 60), (80, 0)]), "it is open 80 mm wide"),
        (polygon([(0, 0), (40, 0), (40, 40)]), "has 3 corners"),
    ],
    ids=["half", "triangle"],
)
def test_what_is_no_airfoil_section_is_refused_with_its_reason(curve: NurbsCurve, message: str) -> None:
    with pytest.raises(NominalError, match=message):
        find_airfoil(curve)


def test_a_lens_with_corners_at_both_edges_is_refused() -> None:
    x = np.linspace(0, 100, 4)
    control = [(0, 0), *((v, -8) for v in x[1:3]), (100, 0), *((v, 8) for v in x[2:0:-1]), (0, 0)]
    lens = NurbsCurve(3, np.array(control, dtype=float), np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2.0]), closed=True)
    with pytest.raises(NominalError, match="two corners lie 100 mm apart"):
        find_airfoil(lens)


def drop(seam: int, turned_deg: float) -> NurbsCurve:
    """Arcs of radius 6 about (0, 0) and 1.26 about (62.5, 0), joined by lines that touch both; the seam lies in front of one of 6 pieces.

    The lines lean by asin(237 / 3125); a rational parabola with the weights 50, 41, 62.5 or 62.5, 38, 50 is half an edge.
    """
    front, back = (0.45504, 5.98272), (62.5955584, 1.2563712)
    upper = [(63.76, 1.26 * 38 / 41), back, ((front[0] + back[0]) / 2, (front[1] + back[1]) / 2), front, (-6, 6 * 41 / 38)]
    ring = np.array([(63.76, 0), *upper, (-6, 0), *((x, -y) for x, y in upper[::-1])])
    weights = np.array([50, 41, 62.5, 62.5, 62.5, 38, 50, 38, 62.5, 62.5, 62.5, 41])
    ring, weights = np.roll(ring, -2 * seam, axis=0), np.roll(weights, -2 * seam)
    knots = np.array([0, *np.repeat(np.arange(7), 2), 6], dtype=float)
    closed = NurbsCurve(2, np.vstack([ring, ring[:1]]), knots, np.append(weights, weights[0]), closed=True)
    return moved_curve(closed, turned_deg, (3.0, -8.0))


@pytest.mark.parametrize("seam", range(6))
@pytest.mark.parametrize("way", [1, -1])
def test_the_tip_of_an_edge_that_is_an_arc_is_its_middle_wherever_the_seam_lies(seam: int, way: int) -> None:
    curve = drop(seam, 20.0)
    if way < 0:
        weights = curve.weights
        assert weights is not None
        curve = NurbsCurve(2, curve.control_points_mm[::-1].copy(), 6 - curve.knots[::-1], weights[::-1].copy(), closed=True)
    section = find_airfoil(curve)
    c, s = np.cos(np.radians(20.0)), np.sin(np.radians(20.0))
    for parameter, x in ((section.nose, -6.0), (section.first, 63.76), (section.last, 63.76)):
        assert section.curve.point(np.array([parameter]))[0] == pytest.approx([3 + c * x, -8 + s * x], abs=1e-9)
    radii: tuple[tuple[Edge, float], ...] = (("leading", 6.0), ("trailing", 1.26))
    for edge, radius in radii:
        assert edge_radius(section, edge, "circle", 80.0).value == pytest.approx(radius, abs=1e-9)
