"""How well points determine the pose of a part: the direction in which it may slide with the least change of the deviations."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_UNDETERMINED = 1e-8  # of the strongest direction's stiffness


@dataclass(frozen=True, slots=True, eq=False)
class Weakness:
    """The rigid motion that changes the deviations least.

    shift       : (3,) the shift of the middle of the points, in the coordinates of the nominal, for a motion of the points by 1 mm rms
    turn_rad    : (3,) the turn that goes with it
    mm_per_mm   : by how many mm the part may move for 1 mm rms of deviation: 1 where it is firmly held, infinite where it slides freely
    shift_95_mm : how far it may lie off by the scatter of the deviations alone (95 %); form errors may move it by up to
                  `mm_per_mm` times their rms
    undetermined : how many directions have no minimum; the pose keeps what it began with along them
    symmetric    : in how many of those the whole nominal slides in itself as well, as round parts do, so that nothing depends on them
    """

    shift: Array
    turn_rad: Array
    mm_per_mm: float
    shift_95_mm: float
    undetermined: int
    symmetric: int = 0

    def __post_init__(self) -> None:
        for array in (self.shift, self.turn_rad):
            array.setflags(write=False)

    @property
    def slides(self) -> bool:
        """Whether the points leave a direction undetermined that matters: another place along it is another place on the nominal."""
        return self.undetermined > self.symmetric

    @property
    def words(self) -> str:
        """The direction in words."""
        parts = []
        length, turn = float(np.linalg.norm(self.shift)), float(np.linalg.norm(self.turn_rad))
        if length > 0.05:
            parts.append(f"along ({', '.join(f'{value:.2f}' for value in self.shift / length)})")
        if np.degrees(turn) > 1e-3:
            axis = ", ".join(f"{value:.2f}" for value in self.turn_rad / turn)
            parts.append(
                f"turning about ({axis}) by {np.degrees(turn) / max(length, 1e-9):.3g} deg a mm" if parts else f"turning about ({axis})"
            )
        return ", ".join(parts)


def weakness_of(rows: Array, weights: Array, arms: Array, free: NDArray[np.bool_], rms_mm: float, nominal_rows: Array) -> Weakness:
    """The weakest direction by the rows (m, 6) of the deviations' change by shift and turn, and the arms (m, 3) of the points.

    Stiffness is the mean square of the deviations' change; motion is measured by the mean square of how far the points move.

    nominal_rows : (n, 6) the same rows of places all over the nominal, about the same centre
    """
    total = float(weights.sum())
    stiffness = np.einsum("mi,mj,m->ij", rows, rows, weights) / total
    spread = np.einsum("mi,mj,m->ij", arms, arms, weights) / total
    motion = np.zeros((6, 6))
    motion[:3, :3], motion[3:, 3:] = np.eye(3), np.trace(spread) * np.eye(3) - spread  # the middle of the points is the centre of turns
    stiffness, motion = stiffness[np.ix_(free, free)], motion[np.ix_(free, free)]
    if not free.any():
        return Weakness(np.zeros(3), np.zeros(3), 1.0, 0.0, 0)
    values, vectors = np.linalg.eigh(motion)
    root = vectors / np.sqrt(np.maximum(values, 1e-12 * values[-1]))  # its columns move the points by 1 mm rms
    values, vectors = np.linalg.eigh(root.T @ stiffness @ root)
    undetermined = int(np.count_nonzero(values <= _UNDETERMINED * values[-1]))
    motions = root @ vectors[:, : max(undetermined, 1)]
    whole = nominal_rows[:, free] @ motions
    stays, turned = np.linalg.eigh(np.einsum("ni,nj->ij", whole, whole) / len(whole))
    symmetric = int(np.count_nonzero(stays <= _UNDETERMINED * values[-1])) if undetermined else 0
    weakest = np.zeros(6)
    weakest[free] = motions @ turned[:, -1]  # of what is not determined, what matters most
    weakest *= np.sign(weakest[np.argmax(np.abs(weakest))])
    per = float(1 / np.sqrt(values[0])) if not undetermined else float("inf")
    scatter = float(1.96 * rms_mm * per / np.sqrt(total)) if not undetermined else float("inf")
    return Weakness(weakest[:3], weakest[3:], per, scatter, undetermined, symmetric)
