"""Surfaces tried before they are needed, so that no measurement waits for what has to be compiled."""

import numpy as np

from inspection.surface.feet import NominalSurface
from inspection.surface.patches import PatchSurface
from inspection.surface.spline_face import SplineFace
from inspection.surface.triangles import TriangleSurface

_PLACES = 64


def rehearse_surface(nominal: NominalSurface) -> None:
    """Project places of a nominal on it, so that every loop that it needs is compiled, or loaded from the cache, before a scan begins."""
    places, normals = nominal.sample(_PLACES)
    nominal.project(places[:_PLACES] + 1e-3 * normals[:_PLACES])


def rehearse_surfaces() -> None:
    """The same of every kind of nominal that has loops of its own, on a bent sheet. A cloud has none."""
    u, v = np.meshgrid(np.arange(3.0), np.arange(3.0), indexing="ij")
    sheet = np.stack([u, v, 0.2 * u * v], axis=2)  # (3, 3, 3) corners, and control points as well
    knots = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    a, b, c, d = sheet[:-1, :-1], sheet[1:, :-1], sheet[1:, 1:], sheet[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], axis=-2).reshape(-1, 3, 3), np.stack([a, c, d], axis=-2).reshape(-1, 3, 3)])
    for nominal in (PatchSurface([SplineFace((2, 2), sheet, knots, knots)]), TriangleSurface(triangles)):
        rehearse_surface(nominal)
