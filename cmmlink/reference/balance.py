"""Deviations whose best fit, minimum zone or least consumption is known before anything is fitted.

A small motion changes deviations e by G m, with the rows of G from `Foot.gradient`. The sum of squares is smallest in place where the
columns of G are orthogonal to e. The largest |e| is smallest in place where the gradients of some points that have it cancel with
positive multipliers, signs taken into account (Kuhn and Tucker): whatever the motion, one of these points then gets worse.
"""

from collections.abc import Callable, Sequence
from decimal import Decimal
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cmmlink.reference.case import KnownHold
from cmmlink.reference.exact_curve import Foot
from cmmlink.reference.exact_numbers import as_array, as_float, determinant, total

_LEAST_MULTIPLIER = Decimal("0.1")  # of four with the sum 1: none of the points may be dispensable
_LEAST_VOLUME = Decimal("0.15")  # of gradients of length near 1: motions must be well determined


class Held(NamedTuple):
    """Four points that hold an optimum: their rows, the signs of their deviations, and their multipliers."""

    rows: tuple[int, ...]
    signs: tuple[int, ...]
    multipliers: tuple[Decimal, ...]

    def known(self, size: Callable[[int], Decimal], factor: int = 1) -> KnownHold:
        """The optimum by the points as they are written.

        size   : |deviation| of a row in the measure that is held
        factor : of the value to that measure
        """
        value = total(m * size(row) for m, row in zip(self.multipliers, self.rows, strict=True))
        return KnownHold(as_float(factor * value), np.array(self.rows, dtype=np.int64), as_array(self.multipliers))


def without_motion(feet: Sequence[Foot], deviation: Sequence[Decimal], weights: Sequence[Decimal] | None = None) -> list[Decimal]:
    """The nearest deviations (m,) that no small motion makes smaller in the sense of least squares, points counting by weights (m,)."""
    rows = [foot.gradient for foot in feet]
    heavy = weights or [Decimal(1)] * len(rows)
    normal = [[total(w * row[i] * row[j] for w, row in zip(heavy, rows, strict=True)) for j in range(3)] for i in range(3)]
    right = [total(w * row[i] * d for w, row, d in zip(heavy, rows, deviation, strict=True)) for i in range(3)]
    whole = determinant(*normal)
    motion = [determinant(*(right if j == i else normal[j] for j in range(3))) / whole for i in range(3)]
    return [d - total(g * m for g, m in zip(row, motion, strict=True)) for row, d in zip(rows, deviation, strict=True)]


def held_by_four(feet: Sequence[Foot], arm: Decimal, halves: Sequence[Decimal | None], first: int = 0) -> Held:
    """Four feet whose gradients, each divided by its half width of the zone, cancel with multipliers of which none is small.

    arm    : a length by which a rotation counts, some mean distance from the origin
    halves : (m,) half widths; all 1 for a minimum zone; None for a foot that is not to hold
    first  : where the search for them begins, so that different cases have different ones
    """
    count = len(feet)
    rows = [
        None if half is None else (gx / half, gy / half, turn / arm / half)
        for foot, half in zip(feet, halves, strict=True)
        for gx, gy, turn in (foot.gradient,)
    ]
    margin, step = max(count // 40, 1), max(count // 23, 1)
    for start in range(first, first + count):
        for gaps in ((3, 7, 5), (5, 6, 4), (4, 8, 6), (6, 5, 7), (2, 9, 7), (7, 3, 8), (5, 5, 6)):
            at = [start, *(start + step * sum(gaps[: k + 1]) for k in range(3))]
            chosen = sorted({margin + row % (count - 2 * margin) for row in at})
            four = [rows[row] for row in chosen]
            if len(chosen) == 4 and min(b - a for a, b in pairwise(chosen)) > 2 and (held := _balanced(chosen, four)):
                return held
    raise ValueError("no four of these feet hold one another")


def _balanced(chosen: Sequence[int], gradients: Sequence[Sequence[Decimal] | None]) -> Held | None:
    """The null vector of four gradients by Cramer's rule; None where a component of it is small, or all of them are."""
    four = [each for each in gradients if each is not None]
    if len(four) < len(chosen):
        return None
    null = [(-1) ** k * determinant(*(four[j] for j in range(4) if j != k)) for k in range(4)]
    whole = total(abs(each) for each in null)
    sizes = [max(total(g * g for g in row).sqrt(), Decimal("1e-9")) for row in four]
    volume = sizes[0] * sizes[1] * sizes[2] * sizes[3]
    if whole == 0 or min(abs(each) for each in null) < _LEAST_MULTIPLIER * whole:
        return None
    if min(abs(each) * size for each, size in zip(null, sizes, strict=True)) < _LEAST_VOLUME * volume:
        return None
    return Held(tuple(chosen), tuple(1 if each > 0 else -1 for each in null), tuple(abs(each) / whole for each in null))
