"""The camber of a section: how far its camber line bulges from the line between its two ends."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.inscribed import CamberLine, inscribe_circles
from inspection.characteristics.outline import AirfoilSection
from inspection.characteristics.section_value import SectionValue
from inspection.characteristics.zoom import find_maximum

Array = NDArray[np.float64]


def maximum_camber(section: AirfoilSection, camber: CamberLine) -> SectionValue:
    """The largest distance in mm of the camber line from the nose-tail line, positive towards the upper side.

    The camber line is the medial axis (the centres of inscribed circles), not the mean of upper and lower ordinates. The places are that
    on the camber line, then the nose and tail points. The other value is how far it bulges to the other side.
    """
    chord = camber.tail_mm - camber.nose_mm
    chord = chord / np.hypot(*chord)
    upwards = np.array([-chord[1], chord[0]])
    height = (camber.circles.centre_mm - camber.nose_mm) @ upwards

    def height_at(u: Array) -> Array:
        return np.asarray((inscribe_circles(section, u).centre_mm - camber.nose_mm) @ upwards)

    up, down = (_farthest(height_at, camber.circles.u, height, sense) for sense in (1.0, -1.0))
    farther, other = (up, down) if height_at(up)[0] >= -height_at(down)[0] else (down, up)
    centre = inscribe_circles(section, farther).centre_mm[0]
    places = np.vstack([centre, camber.nose_mm, camber.tail_mm])
    return SectionValue(
        "maximum camber",
        "inscribed",
        float((centre - camber.nose_mm) @ upwards),
        "mm",
        places,
        ("on the camber line", "nose", "tail"),
        notes=camber.notes,
        other=float(height_at(other)[0]),
    )


def _farthest(height_at: Callable[[Array], Array], u: Array, height: Array, sense: float) -> Array:
    """Where (1,) the camber line bulges most to one side: up by the sense 1, down by -1."""
    best = int(np.argmax(sense * height))
    beside = sorted((float(u[max(best - 1, 0)]), float(u[min(best + 1, len(u) - 1)])))
    return np.array([find_maximum(lambda at: sense * height_at(at), beside[0], beside[1])])
