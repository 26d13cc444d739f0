"""The result of bringing measured points onto the nominal."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.rigid import RigidTransform

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """Pose of a section on the nominal, and how it was reached.

    nominal_from_section : the motion to apply to section points
    rms_mm               : root mean square deviation at that pose, over the points the fit used
    iterations           : steps taken by the fine registration; 0 for a coarse or given pose
    converged            : the last step moved no point by more than the stated limit
    covariance           : (3, 3) of the pose (x, y in mm, rotation in rad about `centre_mm`), from the scatter of the deviations
                           as if they were independent. Where they are form error, above all on a part of a profile, the pose
                           is less certain than that (`LiveUpdate.can_move_mm` takes it into account). Zero for a given pose.
                           A motion that changes no deviation (a circle's rotation) has the size of the part as its standard
                           deviation
    centre_mm            : (2,) centre of the points, in nominal coordinates
    rivals               : other poses that fit as well, on symmetric parts: the points cannot tell which one is true
    outliers             : (m,) points left out of the fit as outliers; all False unless a robust fit was asked for
    """

    nominal_from_section: RigidTransform
    rms_mm: float
    iterations: int
    converged: bool
    covariance: Array
    centre_mm: Array
    rivals: tuple[RigidTransform, ...]
    outliers: NDArray[np.bool_]

    def __post_init__(self) -> None:
        for array in (self.covariance, self.centre_mm, self.outliers):
            array.setflags(write=False)

    def at(self, pose: RigidTransform) -> "Registration":
        """The same at another pose."""
        return Registration(pose, self.rms_mm, self.iterations, self.converged, self.covariance, self.centre_mm, self.rivals, self.outliers)

    def __repr__(self) -> str:
        pose, settled = self.nominal_from_section, "converged" if self.converged else "not converged"
        moved = "({:.4f}, {:.4f})".format(*pose.translation_mm)
        turned = f"turned {np.degrees(pose.rotation_rad):.4f} deg, moved {moved} mm"
        return f"<Registration {turned}, rms {self.rms_mm:.4f} mm, {self.iterations} steps, {settled}>"


def datum_registration(nominal_from_section: RigidTransform, points: int) -> Registration:
    """The registration of that many points whose pose is known beforehand."""
    return Registration(nominal_from_section, float("nan"), 0, True, np.zeros((3, 3)), np.zeros(2), (), no_outliers(points))


def no_outliers(points: int) -> NDArray[np.bool_]:
    """Marks (points,) that say of none that it is an outlier; they take no memory."""
    return np.broadcast_to(np.False_, (points,))
