"""Which of equally close feet is kept, and how points are shared among threads."""

import os
import subprocess
import sys

import numpy as np
import pytest

from inspection.kernels import Feet, project
from tests.inspection.kernels.places import grid_of

FIELDS = Feet._fields


def test_equally_close_feet_are_chosen_alike_in_any_order() -> None:
    # near the medial axis of a thin edge one foot is worked out on two pieces, with other last bits
    rng, grid = np.random.default_rng(1), grid_of("NACA 2412 sharp")
    for _ in range(8):  # of these 400,000 points some twenty depended on their order before ties were settled
        points = np.column_stack([rng.uniform(97.0, 100.0, 50_000), rng.normal(0, 2.0, 50_000)])
        order = rng.permutation(len(points))
        here, there = project(points, grid, threads=1), project(points[order], grid, threads=1)
        for field in FIELDS:
            assert np.array_equal(getattr(here, field)[order], getattr(there, field)), field


FORKED = """
import os
import numpy as np
from inspection.foot_grid import build_foot_grid
from inspection.kernels import project
from tests.inspection import profiles

grid, points = build_foot_grid(profiles.p3()), np.random.default_rng(1).uniform(-60, 60, (20_000, 2))
before = project(points, grid, threads=3).distance_mm
child = os.fork()
if child == 0:
    os._exit(0 if np.array_equal(project(points, grid, threads=3).distance_mm, before) else 1)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_does_not_wait_for_the_threads_it_left_behind() -> None:
    subprocess.run([sys.executable, "-W", "ignore", "-c", FORKED], check=True, timeout=120)
