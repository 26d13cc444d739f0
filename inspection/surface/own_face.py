"""Points whose closest face is not the one that was scanned: beyond the middle of a thin wall the other side is nearer.

There a deviation would be told from the wrong side, and a part that lacks half of its wall might look good. Where the scanner gives the
direction of what it saw, the foot on the face that looks that way is sought: from a place lifted out of the material along its normal.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inspection.surface.feet import FootKind, NominalSurface, SurfaceFeet, faces_away, with_rows

Array = NDArray[np.float64]

_STEPS = 8  # of lifting anew along the normal that was found last
_SAME = 1e-9  # of the size: so far off the normal through its foot a point may lie
_LEAST = 1e-3  # of the first lift


def feet_on_own_face(points_mm: Array, scan_normals: Array, nominal: NominalSurface, feet: SurfaceFeet, lift_mm: float) -> SurfaceFeet:
    """The feet of points (m, 3), with those on a face that looks elsewhere moved to the one that was scanned, where it is found.

    scan_normals : (m, 3) outward directions of the measured surface, of any length; zero or NaN where they are not known
    lift_mm      : how far a point is lifted first: its own face is not found deeper below it
    """
    rows = np.flatnonzero(faces_away(feet, scan_normals) & (feet.kind < FootKind.BORDER))
    if not len(rows):
        return feet
    points, seen = points_mm[rows], scan_normals[rows]
    along, lift = seen / np.sqrt((seen**2).sum(axis=1))[:, None], np.full(len(rows), lift_mm)
    for _ in range(_STEPS):  # as often for every point, so that none depends on the others
        found = nominal.project(points + lift[:, None] * along)
        off = points - found.foot_mm
        height = (off * found.normal).sum(axis=1)
        is_own = (found.kind < FootKind.BORDER) & ~faces_away(found, seen) & (np.abs(height) <= lift_mm)
        along = np.where(is_own[:, None], found.normal, along)
        lift = np.where(is_own, np.maximum(2 * np.abs(height), _LEAST * lift_mm), lift)
    beside = np.sqrt(((off - height[:, None] * found.normal) ** 2).sum(axis=1))
    kept = is_own & (beside <= _SAME * nominal.size_mm)
    return with_rows(feet, rows[kept], kept, replace(found, distance_mm=height))
