"""The packed tables hold what the names of their columns say, and the codes of the loops are those of the enumerations."""

from typing import get_args

import numpy as np
import pytest

from inspection import Rejection, Verdict, discretize
from inspection.foot_grid import FootGrid
from inspection.kernels import SAMPLE_METHODS, layout, project
from inspection.methods import Method
from inspection.verdict import NOT_JUDGED
from tests.inspection.kernels.places import grid_of
from tests.inspection.profiles import Array, curve_of, nominal_of


def tables_of(grid: FootGrid) -> tuple[Array, Array, Array, Array]:
    """Pieces, bounds, boxes and vertices, cut where the header says."""
    index = grid.integers
    begin = index[layout.PIECES_AT : layout.REALS_END + 1]
    widths = (layout.PIECE_WIDTH, layout.BOUND_WIDTH, layout.BOX_WIDTH, layout.VERTEX_WIDTH)
    parts = [grid.reals[a:b].reshape(-1, width) for a, b, width in zip(begin[:-1], begin[1:], widths, strict=True)]
    assert begin[0] == layout.HEADER
    assert begin[-1] == len(grid.reals)
    return parts[0], parts[1], parts[2], parts[3]


def polynomial(rows: Array, column: int, degree: int, t: float) -> Array:
    return np.asarray((rows[:, column : column + degree + 1] * t ** np.arange(degree + 1)).sum(axis=1))


def test_codes_of_the_loops_are_those_of_the_enumerations() -> None:
    assert {reason.name: int(reason) for reason in Rejection} == {
        "NONE": layout.NOT_REJECTED,
        "NOT_FINITE": layout.NOT_FINITE,
        "OFF_SECTION": layout.OFF_SECTION,
        "BEYOND_END": layout.BEYOND_END,
        "OUTLIER": layout.OUTLIER,
        "IN_HOLLOW": layout.IN_HOLLOW,
        "OFF_SURFACE": layout.OFF_SURFACE,
        "BEYOND_EDGE": layout.BEYOND_EDGE,
        "OPPOSITE_FACE": layout.OPPOSITE_FACE,
    }
    assert {verdict.name: int(verdict) for verdict in Verdict} == {
        "CONFORM": layout.CONFORM,
        "UNCERTAIN": layout.UNCERTAIN,
        "NONCONFORM": layout.NONCONFORM,
    }
    assert len(Rejection) == layout.REJECTIONS
    assert layout.NOT_JUDGED == NOT_JUDGED
    assert NOT_JUDGED not in list(Verdict)


def test_codes_stay_as_they_are_written_in_records() -> None:
    assert [int(reason) for reason in Rejection] == list(range(9))
    assert (Verdict.CONFORM, Verdict.UNCERTAIN, Verdict.NONCONFORM, NOT_JUDGED) == (0, 1, 2, -1)


def test_a_method_on_samples_has_the_code_of_its_place() -> None:
    codes = {"circle": layout.CIRCLE, "chord": layout.CHORD, "pcp": layout.PCP, "veaw": layout.VEAW}
    assert {method: SAMPLE_METHODS.index(method) for method in SAMPLE_METHODS} == codes
    assert set(get_args(Method)) - set(SAMPLE_METHODS) == {"exact", "hermite", "inversion"}


@pytest.mark.parametrize("name", ["P1", "P3", "square", "NACA 4412 blunt"])
def test_pieces_are_the_curve(name: str) -> None:
    curve, grid = curve_of(name), grid_of(name)
    pieces, bounds, _, _ = tables_of(grid)
    assert len(pieces) == len(bounds) == grid.pieces == grid.integers[layout.PIECES]
    speed = np.abs(pieces[:, [layout.PIECE_X + 1, layout.PIECE_Y + 1]])
    assert (bounds[:, :1] >= speed * (1 - 1e-12)).all()
    for t in (-0.4, 0.0, 0.3):
        u = pieces[:, layout.PIECE_U] + t * pieces[:, layout.PIECE_U_PER_T]
        x, y = (polynomial(pieces, column, layout.PIECE_DEGREE, t) for column in (layout.PIECE_X, layout.PIECE_Y))
        assert np.abs(np.column_stack([x, y]) - curve.point(u)).max() < 1e-12
        station = polynomial(pieces, layout.PIECE_STATION, layout.STATION_DEGREE, t)
        assert np.abs(station - curve.station_mm(u)).max() < 1e-10
    assert (pieces[:, layout.PIECE_FIRST] <= -layout.PIECE_END + 1e-12).all()
    assert (pieces[:, layout.PIECE_LAST] >= layout.PIECE_END - 1e-12).all()


@pytest.mark.parametrize("name", ["P1", "P3", "square", "NACA 4412 blunt"])
def test_the_header_vertices_links_and_boxes_are_those_of_the_curve(name: str) -> None:
    curve, grid = curve_of(name), grid_of(name)
    pieces, _, boxes, vertices = tables_of(grid)
    header, index = grid.reals, grid.integers
    assert (header[layout.FIRST_PARAMETER], header[layout.LAST_PARAMETER]) == curve.domain
    assert header[layout.LENGTH_MM] == curve.length_mm
    across = index[layout.BLOCKS_ACROSS] / header[layout.BLOCKS_PER_MM]
    on_curve = curve.point(np.linspace(*curve.domain, 500))
    origin = header[[layout.ORIGIN_X, layout.ORIGIN_Y]]
    assert ((on_curve > origin) & (on_curve < origin + across)).all()
    ends = [] if curve.closed else list(curve.domain)
    kinds = [layout.CORNER] * len(curve.corners) + [layout.OPEN_END] * len(ends)
    assert vertices[:, layout.VERTEX_KIND].tolist() == kinds
    assert vertices[:, layout.VERTEX_U].tolist() == [*curve.corners, *ends]
    if len(vertices):
        at = curve.point(vertices[:, layout.VERTEX_U])
        assert np.abs(vertices[:, [layout.VERTEX_X, layout.VERTEX_Y]] - at).max() < 1e-12
        normal = vertices[:, [layout.VERTEX_NORMAL_X, layout.VERTEX_NORMAL_Y]]
        assert np.abs(np.hypot(*normal.T) - 1).max() < 1e-15
    links = index[index[layout.LINKS_AT] : index[layout.BLOCKS_AT]].reshape(-1, layout.PIECE_LINKS)
    for piece, (before, after) in enumerate(zip(links[:, layout.PIECE_BEFORE], links[:, layout.PIECE_AFTER], strict=True)):
        assert before < 0 or links[before, layout.PIECE_AFTER] == piece
        assert after < 0 or links[after, layout.PIECE_BEFORE] == piece
    assert len({-1 - link for link in links.ravel() if link < 0}) == len(vertices)
    leaves = boxes[index[layout.LEAVES] :][: len(pieces)]
    middle = pieces[:, [layout.PIECE_X, layout.PIECE_Y]]
    assert (leaves[:, [layout.BOX_LOW_X, layout.BOX_LOW_Y]] <= middle).all()
    assert (leaves[:, [layout.BOX_HIGH_X, layout.BOX_HIGH_Y]] >= middle).all()


def test_cells_hold_the_piece_of_the_closest_point() -> None:
    grid, rng = grid_of("P3"), np.random.default_rng(47)
    index, header = grid.integers, grid.reals
    pieces = tables_of(grid)[0]
    blocks, cells = index[index[layout.BLOCKS_AT] : index[layout.CELLS_AT]], index[index[layout.CELLS_AT] : index[layout.LISTS_AT]]
    assert len(cells) == grid.cells
    points = curve_of("P3").point(rng.uniform(0, 1, 400)) + rng.normal(0, 0.3, (400, 2))
    place = (points - header[[layout.ORIGIN_X, layout.ORIGIN_Y]]) * header[layout.BLOCKS_PER_MM]
    block = place.astype(int)
    word = blocks[block[:, 1] * index[layout.BLOCKS_ACROSS] + block[:, 0]]
    depth, begin = word & ((1 << layout.BLOCK_DEPTH) - 1), word >> layout.BLOCK_DEPTH
    inner = ((place - block) * (1 << depth)[:, None]).astype(int)
    content = cells[begin + (inner[:, 1] << depth) + inner[:, 0]]
    u = project(points, grid).parameter
    single = content >= 0
    assert single.mean() > 0.9
    row = pieces[content[single]]
    t = (u[single] - row[:, layout.PIECE_U]) / row[:, layout.PIECE_U_PER_T]
    assert (np.abs(t) < 1.5 + 1e-9).all()  # on the piece of the cell or on a neighbour


def test_tables_of_a_curve_are_the_same_for_any_samples_and_stay_as_they_are() -> None:
    curve = curve_of("P3")
    few, many = discretize(curve, samples=200, step_min=5e-3).grid, discretize(curve, samples=2000, step_min=5e-4, material="right").grid
    for one, other in ((few.reals, many.reals), (few.integers, many.integers)):
        assert np.array_equal(one, other)
        before = one.copy()
        with pytest.raises(ValueError, match="read-only"):
            one[0] = 0
        project(curve.point(np.linspace(0, 1, 50)), few)
        assert np.array_equal(one, before)
    assert few.band_mm == many.band_mm > 0.05 * 100


@pytest.mark.parametrize("name", ["P1", "square"])
def test_samples_stand_in_the_columns_of_their_names(name: str) -> None:
    nominal = nominal_of(name, samples=200)
    rows, poles = nominal.sample_table.samples, nominal.poles
    wanted: dict[int, Array] = {
        layout.SAMPLE_X: nominal.points_mm,
        layout.TANGENT_X: nominal.tangent,
        layout.NORMAL_X: nominal.normal,
        layout.SAMPLE_CURVATURE: nominal.curvature,
        layout.SAMPLE_U: nominal.parameter,
        layout.SAMPLE_STATION: nominal.station_mm,
        layout.SAMPLE_SPEED: nominal.speed,
        layout.LEFT_POLE_X: poles.left,
        layout.RIGHT_POLE_X: poles.right,
        layout.LEFT_POLE_CURVATURE: poles.left_curvature,
        layout.RIGHT_POLE_CURVATURE: poles.right_curvature,
        layout.LEFT_EDGE_X: poles.edge_left_mm,
        layout.RIGHT_EDGE_X: poles.edge_right_mm,
    }
    assert rows.shape == (len(nominal), layout.SAMPLE_WIDTH)
    for column, values in wanted.items():
        found = rows[:, column : column + 2] if values.ndim == 2 else rows[:, column]
        assert np.array_equal(found, values, equal_nan=True), column
    links = nominal.sample_table.links
    assert np.array_equal(links[:, layout.NEXT_SAMPLE], nominal.next_site)
    assert np.array_equal(links[:, layout.PREVIOUS_SAMPLE], nominal.previous_site)
    assert np.array_equal(links[:, layout.TWIN_SAMPLE], nominal.twin)
    assert np.array_equal(links[:, layout.AT_OPEN_END], nominal.is_open_end)
    domain = nominal.sample_table.domain
    curve = nominal.curve
    assert (domain[layout.DOMAIN_START], domain[layout.DOMAIN_END]) == curve.domain
    assert domain[layout.DOMAIN_LENGTH_MM] == curve.length_mm
    assert domain[layout.DOMAIN_CLOSED] == float(curve.closed)
