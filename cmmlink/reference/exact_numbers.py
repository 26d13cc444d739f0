"""Numbers of 50 digits by decimal arithmetic, and the 15 digits of them that files hold.

Decimal arithmetic is specified to the last digit (IBM General Decimal Arithmetic), so that every machine finds the same numbers; the
sines of its mathematical library may differ in theirs.
"""

from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from decimal import ROUND_HALF_EVEN, Context, Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

Number = Decimal | int | str
Pair = tuple[Decimal, Decimal]

PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")  # OEIS A000796

_WORKING = Context(prec=50, rounding=ROUND_HALF_EVEN, Emin=-999999, Emax=999999, traps=[])
_IN_FILES = Context(prec=15, rounding=ROUND_HALF_EVEN, Emin=-999999, Emax=999999, traps=[])


def with_fifty_digits() -> AbstractContextManager[Context]:
    """Everything that is computed within has 50 digits, whatever the caller's own decimal context is."""
    return localcontext(_WORKING)


def rounded(value: Decimal) -> Decimal:
    """The nearest number of 15 digits, which is what a file holds."""
    return _IN_FILES.plus(value)


def as_float(value: Decimal) -> float:
    """The number of 15 digits as a float, whose shortest decimal form is those digits again."""
    return float(rounded(value))


def as_array(values: Sequence[Decimal]) -> NDArray[np.float64]:
    """Numbers (m,) of 15 digits."""
    return np.array([as_float(value) for value in values], dtype=np.float64)


def as_pairs(values: Sequence[Pair]) -> NDArray[np.float64]:
    """Places (m, 2) of 15 digits."""
    return np.array([[as_float(x), as_float(y)] for x, y in values], dtype=np.float64).reshape(-1, 2)


def cosine_and_sine(angle: Decimal) -> Pair:
    """Cosine and sine of an angle in radians, by their series about the nearest multiple of a right angle."""
    turns = (2 * angle / PI).to_integral_value(ROUND_HALF_EVEN)
    rest = angle - turns * PI / 2
    square, terms, parts, k = rest * rest, [Decimal(1), rest], [Decimal(1), rest], 1
    while abs(terms[0]) > Decimal("1e-52"):
        terms = [-terms[0] * square / ((2 * k - 1) * (2 * k)), -terms[1] * square / ((2 * k) * (2 * k + 1))]
        parts = [parts[0] + terms[0], parts[1] + terms[1]]
        k += 1
    cosine, sine = parts
    return ((cosine, sine), (-sine, cosine), (-cosine, -sine), (sine, -cosine))[int(turns) % 4]


def sine(angle: Decimal) -> Decimal:
    """Sine of an angle in radians."""
    return cosine_and_sine(angle)[1]


def total(values: Iterable[Decimal]) -> Decimal:
    """The sum, which is a decimal number also of none."""
    return sum(values, Decimal(0))


def determinant(a: Sequence[Decimal], b: Sequence[Decimal], c: Sequence[Decimal]) -> Decimal:
    """Determinant of the matrix whose columns are three vectors (3,)."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def scattered(count: int, seed: int) -> list[Decimal]:
    """Numbers (count,) between -1 and 1 without a visible order, by the linear congruence of MINSTD (Park and Miller, 1988)."""
    found, state = [], seed
    for _ in range(count):
        state = 48271 * state % 2147483647
        found.append(Decimal(state) / Decimal(1073741823) - 1)
    return found
