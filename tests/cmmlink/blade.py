"""A blade without noise, as a surface and as plans of it."""

import threading
import time
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline

from cmmlink.plan.surface import CtPlan
from cmmlink.stack import StackOutcome, inspect_stack
from tests.drivers.surface.meshes import Triangles, tube


def inspect(plan: CtPlan) -> StackOutcome:
    return inspect_stack(plan, clock=time.monotonic, stop=threading.Event())


def plan_of(mesh: Path, nominal: Path, sections: dict[str, object], **further: object) -> CtPlan:
    settings = {
        "part": {"name": "blade"},
        "mesh": {"file": mesh},
        "nominal": {"file": nominal},
        "tolerance": {"lower_mm": -0.1, "upper_mm": 0.1},
        "sections": sections,
        "cut": {"cutter": "numpy"},  # starting Open3D takes a second; both give the same points
        **further,
    }
    return CtPlan.model_validate(settings)


def chord_mm(spline: BSpline) -> float:
    """How far the chords between 600 points stay off the profile."""
    u = np.linspace(0, 1, 600)
    ends, between = spline(u), spline((u[1:] + u[:-1]) / 2)
    along = np.diff(ends, axis=0)
    off = along[:, 0] * (between - ends[:-1])[:, 1] - along[:, 1] * (between - ends[:-1])[:, 0]
    return float(np.max(np.abs(off) / np.linalg.norm(along, axis=1)))


def tapered(spline: BSpline) -> Triangles:
    """From full size at z = 0 to nine tenths at z = 20 mm, ruled along straight lines."""
    profile = spline(np.linspace(0, 1, 600))
    triangles = tube(profile, np.linspace(0.0, 20.0, 21))
    triangles[:, :, :2] *= 1 - 0.005 * triangles[:, :, 2:]
    return triangles
