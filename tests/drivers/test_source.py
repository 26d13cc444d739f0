import numpy as np
import pytest

from drivers.source import PointBatch


def batch(sequence: int, times: int, points: tuple[int, ...]) -> PointBatch:
    return PointBatch(np.arange(sequence), np.zeros(times), np.zeros(points))


@pytest.mark.parametrize(
    ("sequence", "times", "points"),
    [(3, 2, (3, 3)), (3, 3, (2, 3)), (3, 3, (3, 2)), (3, 3, (3,)), (0, 1, (0, 3))],
)
def test_arrays_that_do_not_belong_together_are_no_batch(sequence: int, times: int, points: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=rf"expected \({sequence},\) and \({sequence}, 3\), got \({times},\) and "):
        batch(sequence, times, points)


def test_a_batch_cannot_be_changed_by_whoever_gets_it() -> None:
    found = batch(2, 2, (2, 3))
    assert len(found) == 2
    for array in (found.sequence, found.time_s, found.points_mm):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
