"""How a section sits: turned and moved against its nominal.

A section may be turned in two ways that are both called twist. The difference of chord angles follows the two ends of the section,
and changes when its camber does; the rotation of the best fit follows the whole outline. The name of the method stands with the value.
"""

import numpy as np
from numpy.typing import ArrayLike

from inspection.characteristics.section_value import SectionValue, angle_within_half_a_turn, no_places
from inspection.registration import Registration


def twist_by_chord(nominal_angle: SectionValue, actual_angle: SectionValue) -> SectionValue:
    """The twist in degrees as the difference of two chord angles of one method, positive anticlockwise.

    Both are angles in the nominal's coordinates, the actual one at the pose of the datum: after a free fit it is what the fit left.
    Raises ValueError for angles of different methods.
    """
    if nominal_angle.key != actual_angle.key or nominal_angle.name != "chord angle":
        raise ValueError(f"twist needs two chord angles of one method, not {nominal_angle.key} and {actual_angle.key}")
    value = angle_within_half_a_turn(actual_angle.value - nominal_angle.value)
    names = tuple(f"actual {name}" for name in actual_angle.place_names)
    return SectionValue("twist", f"chord-angle {actual_angle.method}", value, "deg", actual_angle.places_mm, names)


def twist_by_fit(fit: Registration) -> SectionValue:
    """The twist in degrees as the rotation of the best fit, positive where the part is turned anticlockwise.

    fit : the registration of points that the datum had already brought into the nominal's coordinates. It turns the part back, so that
          the twist is the opposite of its rotation.
    """
    value = angle_within_half_a_turn(-float(np.degrees(fit.nominal_from_section.rotation_rad)))
    return SectionValue("twist", "best-fit", value, "deg", no_places(), ())


def displacement(fit: Registration, at_mm: ArrayLike) -> tuple[SectionValue, SectionValue, SectionValue]:
    """How far in mm the part lies from the nominal at a stated place of it: along x, along y, and in all.

    fit   : as for `twist_by_fit`
    at_mm : (2,) the place in the nominal, such as its stacking point; with a twist, every place is displaced differently
    """
    place = np.asarray(at_mm, dtype=np.float64)
    actual = fit.nominal_from_section.inverse().apply(place[None])[0]
    moved = actual - place
    window = (("x_mm", float(place[0])), ("y_mm", float(place[1])))
    values = {"displacement along x": moved[0], "displacement along y": moved[1], "displacement": np.hypot(*moved)}
    one, two, three = (
        SectionValue(name, "best-fit", float(value), "mm", np.vstack([place, actual]), ("nominal", "actual"), window)
        for name, value in values.items()
    )
    return one, two, three
