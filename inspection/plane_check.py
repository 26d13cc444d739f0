"""Whether the points lie in the plane of the section: not in another one, and not in several."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from inspection.coarse import FEWEST_POINTS
from inspection.errors import NotMeasured
from inspection.kernels.layout import OFF_SECTION
from inspection.scan_rows import ScanRows
from inspection.section import SectionPlane
from inspection.terms import Terms

Array = NDArray[np.float64]

STRAIGHT = 1e-3  # of the length: narrower points lie on a line, through which many planes go
_PLANE_LIMIT = 0.01  # of the nominal's size: heights that differ by less leave one section
_THIN = 0.1  # of the heights' range: points nearer to a plane lie in it
_EDGEWISE = 1e-3  # of a normal: with less of it along the section's, neither side is up
_LEVEL_MM = 0.5  # between two heights that are two sections


def check_section(rows: ScanRows, usable: int, off_section_max_mm: float) -> None:
    """Raise NotMeasured where hardly a point lies near the plane of the section."""
    off = int(np.count_nonzero(rows.rejection[: rows.count] == OFF_SECTION))
    if usable < FEWEST_POINTS <= off:
        heights = rows.height[: rows.count][rows.rejection[: rows.count] == OFF_SECTION]
        low, middle, high = (_machine_height(rows.plane, height) for height in np.quantile(heights, [0.0, 0.5, 1.0]))
        raise NotMeasured(
            f"{off} of {rows.count} points lie farther than {off_section_max_mm:g} mm from the plane of the section, at heights from "
            f"{low:.4g} to {high:.4g} mm along its normal, half of them below {middle:.4g} mm: are its origin and its normal right?"
        )


def check_plane(space_mm: Array, plane: SectionPlane, terms: Terms) -> None:
    """Raise NotMeasured where the points (m, 3: x and y in the section, height above it) lie in another plane, or in several."""
    low, high = np.quantile(space_mm[:, 2], [0.02, 0.98])
    spread = float(high - low)
    limit = _PLANE_LIMIT * terms.nominal.size_mm if not np.isfinite(terms.off_section_max_mm) else float("inf")
    if spread <= min(limit, _LEVEL_MM):
        return
    centred = space_mm - np.median(space_mm, axis=0)
    _, singular, axes = np.linalg.svd(centred, full_matrices=False)
    off = np.quantile(centred @ axes[2], [0.02, 0.98])
    if spread > limit and off[1] - off[0] < _THIN * spread and singular[1] > STRAIGHT * singular[0]:
        raise NotMeasured(_words_of_plane(space_mm, axes[2], plane))
    levels = _levels(space_mm[:, 2])
    if len(levels) > 1:
        *first, last = (f"{_machine_height(plane, level):.4g}" for level in levels)
        raise NotMeasured(
            f"the points lie at several heights, {', '.join(first)} and {last} mm: this is more than one section. Give one at a time, or "
            "name the height (section.origin_mm with section.off_plane_max_mm)"
        )
    if spread > limit:
        raise NotMeasured(
            f"the points lie at heights from {_machine_height(plane, low):.4g} to {_machine_height(plane, high):.4g} mm, not in one plane "
            f"(within {limit:.3g} mm): is the section's plane right (--plane), or its height (section.off_plane_max_mm)?"
        )


def _machine_height(plane: SectionPlane, height_mm: float) -> float:
    """The height of a section point along the normal, from the machine's origin, rounded for people."""
    return round(float(plane.origin_mm @ plane.normal) + height_mm, 3) + 0.0


def _words_of_plane(space_mm: Array, normal: Array, plane: SectionPlane) -> str:
    """Name the plane that the points (m, 3) lie in, by its normal in the section's coordinates, and how to say so."""
    turn = np.array([plane.x_axis, np.cross(plane.normal, plane.x_axis), plane.normal])  # (3, 3) the section's axes, a row each
    upward = normal[2] if abs(normal[2]) > _EDGEWISE else normal[np.argmax(np.abs(normal))]
    direction = (normal if upward > 0 else -normal) @ turn  # the same side up as in the section, or x and y would be swapped
    axis = int(np.argmax(np.abs(direction)))
    place = float(np.median((plane.origin_mm + space_mm @ turn) @ direction))
    if abs(direction[axis]) > 0.9999:
        return f"the points lie in the plane {'xyz'[axis]} = {place:.5g}: say --plane {('yz', 'xz', 'xy')[axis]} (section.normal)"
    told = ", ".join(f"{round(value, 4) + 0.0:g}" for value in direction)
    tilt = np.degrees(np.arccos(min(1.0, abs(float(normal[2])))))
    return f"the points lie in a plane that is tilted by {tilt:.3g} deg against the section: say section.normal [{told}]"


def _levels(heights_mm: Array) -> list[float]:
    """Heights at which many points lie, each apart from the next; fewer than two where heights run on."""
    ordered = np.sort(heights_mm)
    groups = np.split(ordered, np.flatnonzero(np.diff(ordered) > _LEVEL_MM) + 1)
    many = [group for group in groups if len(group) >= max(FEWEST_POINTS, 0.05 * len(ordered))]
    gaps = [after[0] - before[-1] for before, after in pairwise(many)]
    return [float(np.median(group)) for group in many] if gaps and min(gaps) > max(np.ptp(group) for group in many) else []
