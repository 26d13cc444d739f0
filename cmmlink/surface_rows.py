"""What was found of every point of a scan of a surface, row by row, as results hand it out and records keep it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from inspection import NOT_JUDGED

if TYPE_CHECKING:
    from inspection.surface import SurfaceResult

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceRows:
    """A row for every received point, in the order of arrival; of rejected points all but the first two and the last two are NaN.

    actual_mm    : (m, 3) the measured points in nominal coordinates, as they arrived: ball centres are not compensated
    face         : (m,) number of the face, from 0, that the foot lies on; -1 of rejected points
    foot_mm      : (m, 3) the nominal points they are compared with
    normal       : (m, 3) unit direction in which the deviation grows, in single precision
    deviation_mm : (m,) positive out of material
    verdicts     : (m,) codes of `Verdict`
    rejection    : (m,) codes of `Rejection`
    """

    actual_mm: Array
    face: NDArray[np.int32]
    foot_mm: Array
    normal: NDArray[np.float32]
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    rejection: NDArray[np.int8]

    def __post_init__(self) -> None:
        m = len(self.verdicts)
        shapes = ((m, 3), (m,), (m, 3), (m, 3), (m,), (m,), (m,))
        arrays: tuple[NDArray[Any], ...] = (
            self.actual_mm,
            self.face,
            self.foot_mm,
            self.normal,
            self.deviation_mm,
            self.verdicts,
            self.rejection,
        )
        if any(array.shape != shape for array, shape in zip(arrays, shapes, strict=True)):
            raise ValueError(f"expected {shapes}, got {[array.shape for array in arrays]}")
        for array in arrays:
            array.setflags(write=False)

    @property
    def received(self) -> int:
        """Points received; always judged + rejected."""
        return len(self.verdicts)


def surface_blocks(result: "SurfaceResult", rows: int) -> Iterator[SurfaceRows]:
    """The rows of a result, so many at a time."""
    for first in range(0, result.received, rows):
        part = slice(first, first + rows)
        feet, judged = result.feet, result.verdicts[part] != NOT_JUDGED
        yield SurfaceRows(
            result.nominal_from_scan.apply(result.points_mm[part]),
            np.where(judged, feet.face[part], np.int32(-1)),
            np.where(judged[:, None], feet.foot_mm[part], np.nan),
            np.where(judged[:, None], feet.normal[part], np.nan).astype(np.float32),
            np.where(judged, feet.distance_mm[part], np.nan),
            result.verdicts[part].copy(),
            result.rejection[part].copy(),
        )


def joined_surface_rows(blocks: Iterator[SurfaceRows]) -> SurfaceRows:
    """The rows of blocks that follow one another, in one."""
    names = SurfaceRows.__dataclass_fields__
    parts = list(blocks)
    return SurfaceRows(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
