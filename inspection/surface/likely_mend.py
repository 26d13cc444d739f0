"""What is to be mended where points do not fit a surface: their unit, or their hand. A few of them tell.

A part that merely fails is none of this file's business: no defect makes a scan of the whole part fit in another unit or mirrored. What
scans of a part of it would fit cannot be told as surely.
"""

import numpy as np
from numpy.typing import NDArray

from inspection.errors import NotMeasured, RegistrationError
from inspection.surface.feet import NominalSurface
from inspection.surface.surface_fit import register_surface
from inspection.unit_factors import UNIT_FACTORS

Array = NDArray[np.float64]

_FEW = 500
_FITS = 0.005  # of the size: the rms of points that fit a surface at all
_MIRROR_FAR_BETTER = 0.35  # of the rms as the points came, as for sections
_AS_LARGE = 0.3  # by which the spreads of two scans of a whole part differ at most, however dense they are where


def refuse_other_unit(points_mm: Array, nominal: NominalSurface, target_mm: float) -> None:
    """Raise NotMeasured where points (m, 3) are a scan of the whole part in another unit; a tiny one would fit nearly anywhere."""
    few, whole = _few(points_mm), _spreads(nominal.sample(_FEW)[0])
    for factor, mend in UNIT_FACTORS:
        if _are_alike(factor * _spreads(few), whole):
            rms_mm = _rms_mm(factor * few, nominal, target_mm)
            if rms_mm <= _FITS * nominal.size_mm:
                raise NotMeasured(
                    f"the points fit the whole surface, to {rms_mm:.4g} mm (rms), when they are taken {factor:.4g} times as large: {mend}"
                )


def refuse_mirrored(points_mm: Array, nominal: NominalSurface, target_mm: float) -> None:
    """Raise NotMeasured where points (m, 3), which do not fit as they came, are a scan of the whole part in a mirror."""
    few = _few(points_mm)
    if not _are_alike(_spreads(few), _spreads(nominal.sample(_FEW)[0])):
        return
    as_they_came, mirrored = _rms_mm(few, nominal, target_mm), _rms_mm(few * (-1.0, 1.0, 1.0), nominal, target_mm)
    if mirrored <= min(_MIRROR_FAR_BETTER * as_they_came, _FITS * nominal.size_mm):
        raise NotMeasured(
            f"the points fit the surface only mirrored, to {mirrored:.4g} mm (rms): are two columns swapped or one reversed, or is this "
            "the part of the other hand?"
        )


def _few(points_mm: Array) -> Array:
    finite = points_mm[np.isfinite(points_mm).all(axis=1)]
    return finite[np.unique(np.linspace(0, len(finite) - 1, _FEW).astype(np.int64))] if len(finite) else finite


def _spreads(points_mm: Array) -> Array:
    """How far points (m, 3) are spread along their axes (3,), the widest first."""
    if len(points_mm) < len(points_mm.T):
        return np.full(3, np.nan)
    return np.asarray(np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False) / np.sqrt(len(points_mm)))


def _are_alike(spreads: Array, others: Array) -> bool:
    return bool((np.abs(spreads - others) <= _AS_LARGE * others.max()).all())


def _rms_mm(points_mm: Array, nominal: NominalSurface, target_mm: float) -> float:
    """How well points (m, 3) fit wherever they fit best; infinite where they do not."""
    try:
        return register_surface(points_mm, nominal, target_mm=target_mm).rms_mm
    except RegistrationError:
        return np.inf
