"""How numbers of 15 digits stand in CAD files: with a decimal point and without an exponent, which every format reads alike."""

from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from cmmlink.reference.case import ReferenceNominal


def real(value: float) -> str:
    """The shortest decimal form of a number, with a point."""
    text = f"{Decimal(repr(float(value))):f}"
    return text if "." in text else f"{text}."


def weights_of(nominal: ReferenceNominal) -> NDArray[np.float64]:
    """The weights (k,), also where all are 1."""
    return np.ones(len(nominal.control_points)) if nominal.weights is None else nominal.weights
