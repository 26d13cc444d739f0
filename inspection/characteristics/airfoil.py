"""All characteristics of an airfoil section at once, and those of an actual section beside those of its nominal."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import get_args

from inspection.characteristics.actual import ActualSection
from inspection.characteristics.camber import maximum_camber
from inspection.characteristics.chord import ChordAngleMethod, ChordMethod, chord, chord_angle
from inspection.characteristics.edge_radius import edge_radius
from inspection.characteristics.inscribed import CamberLine, find_camber_line
from inspection.characteristics.outline import AirfoilSection, Edge
from inspection.characteristics.section_value import ComparedValue, SectionValue, compare_values
from inspection.characteristics.thickness import EdgeThicknessMethod, ThicknessMethod, edge_thickness, maximum_thickness
from inspection.errors import InspectionError


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A characteristic that a section does not have or that was not measured, and why."""

    name: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class AirfoilValues:
    """The characteristics of one section.

    values   : in the order chord, chord angle, thickness, camber, edge radii, edge thicknesses
    left_out : what the section has no value of, such as a caliper chord without a hollow side
    camber   : the camber line that they stand on
    """

    values: tuple[SectionValue, ...]
    left_out: tuple[LeftOut, ...]
    camber: CamberLine


@dataclass(frozen=True, slots=True, eq=False)
class ComparedAirfoil:
    """The characteristics of an actual section beside those of its nominal.

    compared : each with nominal, actual and deviation
    left_out : what there is no deviation of; a value that was found where nothing was measured is among them
    notes    : how the actual section was drawn, and where nothing was measured; an extreme value may hide there
    """

    compared: tuple[ComparedValue, ...]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def evaluate_airfoil(
    section: AirfoilSection, windows_deg: tuple[float, ...] = (30.0,), offsets_mm: tuple[float, ...] = ()
) -> AirfoilValues:
    """Every characteristic of a section by every method.

    windows_deg : windows of the circles that give edge radii
    offsets_mm  : ways in from both edges at which the edge thickness is measured
    """
    camber = find_camber_line(section)
    values, left_out = [], []
    for name, evaluate in _characteristics(section, camber, windows_deg, offsets_mm):
        try:
            values.append(evaluate())
        except InspectionError as error:
            left_out.append(LeftOut(name, str(error)))
    return AirfoilValues(tuple(values), tuple(left_out), camber)


def compare_airfoil(
    actual: ActualSection,
    windows_deg: tuple[float, ...] = (30.0,),
    offsets_mm: tuple[float, ...] = (),
    nominal: AirfoilValues | None = None,
) -> ComparedAirfoil:
    """Every characteristic of an actual section, with its deviation from the nominal.

    windows_deg, offsets_mm : as for `evaluate_airfoil`
    nominal                 : what that gave of the nominal section, where many parts are held against one
    """
    nominal = nominal or evaluate_airfoil(actual.nominal, windows_deg, offsets_mm)
    found = evaluate_airfoil(actual.section, windows_deg, offsets_mm)
    by_key = {value.key: value for value in found.values}
    compared, left_out = [], [*nominal.left_out]
    reasons = {one.name: one.reason for one in found.left_out}
    for value in nominal.values:
        other = by_key.get(value.key)
        label = f"{value.name} ({value.method})"
        unseen = None if other is None else actual.unseen_place(other)
        if other is None:
            left_out.append(LeftOut(label, f"the actual section has none: {reasons.get(label, 'it was not found')}"))
        elif unseen is not None:
            left_out.append(LeftOut(label, f"it was found where nothing was measured ({unseen}); measure that stretch"))
        else:
            compared.append(compare_values(value, other))
    return ComparedAirfoil(tuple(compared), tuple(left_out), actual.notes)


def _characteristics(
    section: AirfoilSection, camber: CamberLine, windows_deg: tuple[float, ...], offsets_mm: tuple[float, ...]
) -> Iterator[tuple[str, Callable[[], SectionValue]]]:
    """The name of every characteristic, and what evaluates it."""
    edges: tuple[Edge, ...] = get_args(Edge)
    for chord_method in get_args(ChordMethod):
        yield f"chord ({chord_method})", partial(chord, section, camber, chord_method)
    for angle_method in get_args(ChordAngleMethod):
        yield f"chord angle ({angle_method})", partial(chord_angle, section, camber, angle_method)
    for thickness_method in get_args(ThicknessMethod):
        yield f"maximum thickness ({thickness_method})", partial(maximum_thickness, section, camber, thickness_method)
    yield "maximum camber (inscribed)", partial(maximum_camber, section, camber)
    for edge in edges:
        yield f"{edge} edge radius (curvature)", partial(edge_radius, section, edge, "curvature")
    for edge, window in product(edges, windows_deg):
        yield f"{edge} edge radius (circle)", partial(edge_radius, section, edge, "circle", window)
    for edge, offset, edge_method in product(edges, offsets_mm, get_args(EdgeThicknessMethod)):
        yield f"{edge} edge thickness ({edge_method})", partial(edge_thickness, section, camber, edge, offset, edge_method)
