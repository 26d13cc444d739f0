"""Pieces of a curve against the curve: they are it to round-off, also beyond their borders, and every bound holds."""

import numpy as np
import pytest

from inspection import NominalError, NurbsCurve
from inspection.curve_pieces import CurvePieces, cut_into_pieces, derivative_bounds, piece_tree
from tests.inspection import profiles
from tests.inspection.profiles import Array, curve_of

INSIDE = np.linspace(-0.5, 0.5, 41)


def values(pieces: CurvePieces, t: Array, order: int = 0) -> Array:
    """Derivative (p, k, 2) of that order by t, at t (k,) or (p, k)."""
    coefficients = np.moveaxis(pieces.rows[:, :12].reshape(-1, 2, 6), 2, 0)  # (6, p, 2)
    polynomial = np.polynomial.polynomial
    derived = polynomial.polyder(coefficients, order) if order else coefficients
    at = np.broadcast_to(t, (len(pieces), t.shape[-1]))
    return np.stack([polynomial.polyval(row, derived[:, i]).T for i, row in enumerate(at)])


def parameters(pieces: CurvePieces, t: Array) -> Array:
    return pieces.rows[:, 12:13] + pieces.rows[:, 13:14] * t


def size_of(curve: NurbsCurve) -> float:
    return float(np.abs(curve.control_points_mm).max())


@pytest.mark.parametrize("name", profiles.EVERY)
def test_pieces_are_the_curve_to_round_off_and_a_little_beyond_their_borders(name: str) -> None:
    curve = curve_of(name)
    pieces = cut_into_pieces(curve)
    first, last = pieces.rows[:, 14:15], pieces.rows[:, 15:16]
    assert (first < 0).all()
    assert (last > 0).all()
    within = np.clip(first + (last - first) * np.linspace(0, 1, 33), -0.9, 0.9)
    inner_knots = np.unique(curve.knots)
    u = parameters(pieces, within)
    # at a knot the curve goes on as another polynomial, and the slack for round-off may reach a little past the domain
    u = np.clip(u, *curve.domain)
    span = np.searchsorted(inner_knots, pieces.rows[:, 12], side="right")
    same = (u > inner_knots[span - 1][:, None]) & (u < inner_knots[np.minimum(span, len(inner_knots) - 1)][:, None])
    off = values(pieces, within) - curve.point(u.ravel()).reshape(*u.shape, 2)
    assert np.abs(off[same]).max() < 8 * np.finfo(float).eps * size_of(curve)
    s = np.stack([np.polynomial.polynomial.polyval(t, row[16:24]) for t, row in zip(within, pieces.rows, strict=True)])
    assert np.abs(s - curve.station_mm(u.ravel()).reshape(u.shape))[same].max() < 1e-12 * curve.length_mm


@pytest.mark.parametrize("name", profiles.EVERY)
def test_pieces_follow_each_other_along_the_whole_curve(name: str) -> None:
    curve = curve_of(name)
    pieces = cut_into_pieces(curve)
    start, end = curve.domain
    borders = np.append(parameters(pieces, np.array([-0.5]))[:, 0], parameters(pieces, np.array([0.5]))[-1])
    assert borders[[0, -1]] == pytest.approx([start, end], abs=1e-12 * (end - start))
    assert (np.diff(borders) > 0).all()
    assert np.abs(parameters(pieces, np.array([0.5]))[:-1, 0] - borders[1:-1]).max() < 1e-12 * (end - start)
    for piece, follower in enumerate(pieces.after.tolist()):
        if follower >= 0:
            assert pieces.before[follower] == piece
    at_vertex = np.flatnonzero(pieces.before < 0)
    begin = curve.corners if curve.closed else np.append(curve.corners, start)
    assert np.sort(borders[at_vertex]) == pytest.approx(np.sort(begin), abs=1e-9)
    assert len(pieces.vertices) == len(curve.corners) + (0 if curve.closed else 2)


@pytest.mark.parametrize("name", profiles.EVERY)
def test_every_bound_of_a_piece_holds(name: str) -> None:
    curve = curve_of(name)
    pieces = cut_into_pieces(curve)
    here = values(pieces, INSIDE)
    along = pieces.along_mm[:, None]
    reach = here - pieces.start_mm[:, None]
    share = np.clip((reach * along).sum(axis=2) / (along * along).sum(axis=2), 0, 1)
    strayed = np.linalg.norm(reach - share[..., None] * along, axis=2).max(axis=1)
    grain = 8 * np.finfo(float).eps * size_of(curve)
    assert (strayed <= pieces.sagitta_mm * (1 + 1e-9) + grain).all()
    boxes = piece_tree(pieces)[len(piece_tree(pieces)) // 2 :][: len(pieces)]
    assert (here >= boxes[:, None, :2] - grain).all()
    assert (here <= boxes[:, None, 2:] + grain).all()
    for order, bound in enumerate(derivative_bounds(pieces).T, start=1):
        assert (np.linalg.norm(values(pieces, INSIDE, order), axis=2).max(axis=1) <= bound * (1 + 1e-12)).all(), order
    first, second = values(pieces, INSIDE, 1), values(pieces, INSIDE, 2)
    curvature = (first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]) / np.hypot(first[..., 0], first[..., 1]) ** 3
    round_off = 1e-9 * np.maximum(1.0, np.abs(curvature).max())
    assert (curvature.min(axis=1) >= pieces.least - round_off).all()
    assert (curvature.max(axis=1) <= pieces.most + round_off).all()
    assert (pieces.reach_mm >= pieces.half_mm * (1 - 1e-12)).all()


def test_a_curve_that_stands_still_cannot_be_cut() -> None:
    doubled = NurbsCurve(
        3, np.array([(0, 0), (5, 5), (5, 5), (5, 5), (10, 0), (15, 5)], dtype=float), np.array([0, 0, 0, 0, 1, 2, 3, 3, 3, 3])
    )
    with pytest.raises(NominalError, match="stands still or is not smooth near parameter"):
        cut_into_pieces(doubled)
