"""The camber of a section: how far its camber line bulges from the line between its two ends."""

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
    on the camber line, then the nose and tail points.
    """
    chord = camber.tail_mm - camber.nose_mm
    chord = chord / np.hypot(*chord)
    upwards = np.array([-chord[1], chord[0]])
    height = (camber.circles.centre_mm - camber.nose_mm) @ upwards
    best = int(np.argmax(np.abs(height)))
    sense = 1.0 if height[best] >= 0 else -1.0
    u = camber.circles.u
    beside = sorted((float(u[max(best - 1, 0)]), float(u[min(best + 1, len(u) - 1)])))

    def bulge(at: Array) -> Array:
        return np.asarray(sense * ((inscribe_circles(section, at).centre_mm - camber.nose_mm) @ upwards))

    centre = inscribe_circles(section, np.array([find_maximum(bulge, beside[0], beside[1])])).centre_mm[0]
    value = float((centre - camber.nose_mm) @ upwards)
    places = np.vstack([centre, camber.nose_mm, camber.tail_mm])
    return SectionValue("maximum camber", "inscribed", value, "mm", places, ("on the camber line", "nose", "tail"), notes=camber.notes)
