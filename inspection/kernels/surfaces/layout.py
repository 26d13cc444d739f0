"""The columns and codes of the packed tables of surfaces, by name. This file imports nothing of ours."""

# --- what a foot is -------------------------------------------------------------------------------------------------------

ON_FACE, ON_EDGE, ON_CORNER, ON_BORDER = range(4)  # inside a face, on an edge or corner between faces, on the border of an open surface
NO_FOOT = 4  # of a point that is not finite

# --- the search tree: nodes of eight boxes --------------------------------------------------------------------------------

WAYS = 8  # the children of a node; their boxes stand in columns of eight, so that all are looked at together
BOX_LOW, BOX_HIGH, BOX_SIDES = 0, 3, 6  # rows of a node (6, 8): low x, y, z, then high x, y, z
NO_CHILD = -1  # a link is the number of a node, or LEAF - (number of a leaf)
LEAF = -2
STACK = 256  # nodes that may wait: seven of each level, and a tree has less than twenty levels of eight
SQUARES_OF_EIGHT = STACK  # in the memory of reals: behind the squares of what waits those of eight boxes or items
SCRATCH = STACK + WAYS

# --- a cluster of triangles: columns of sixteen, in single precision, which only say where not to look ---------------------

LANES = 16  # triangles of a cluster; that of lane j of cluster c has the number c * LANES + j
# Four planes of each triangle, as nx, ny, nz, offset: its own, and those along its edges AB, AC, BC that stand upright on it, outward.
OWN_PLANE, PLANE_AB, PLANE_AC, PLANE_BC, PLANE_WIDTH, CLUSTER_ROWS = 0, 4, 8, 12, 4, 16
CLUSTER = LANES * CLUSTER_ROWS
REACH, ORIGIN_WIDTH = 3, 4  # the place that the planes are seen from, and the distance of the farthest corner from it
NOT_THERE = 1e18  # the offset of the plane of a lane without a triangle
# A box along the mean normal: the middle, three axes (the last is the normal), half the sides; then the tangents of the most that a normal
# around a corner leans from that mean, and from the normal of a triangle with the corner.
HULL_MIDDLE, HULL_AXES, HULL_HALF, HULL_TANGENT, HULL_OWN_TANGENT, HULL_WIDTH = 0, 3, 12, 15, 16, 17

# --- cells of space with the clusters that may hold the closest point of a place in them -----------------------------------

GRID_LOW, GRID_PER_MM, GRID_BLOCK_MM, GRID_WIDTH = 0, 3, 4, 5  # the lowest corner of the grid of blocks, blocks in a mm, a block in mm
FAR = -1  # a block or cell has the place of its eight parts, or LISTED - (place of its list), or FAR: nothing is known of it
LISTED = -2
MOST_LISTED = 16  # clusters in a list
LANE_BITS = MOST_LISTED * LANES - 1  # the last bits of a bound, which hold its lane
NOTHING = -1  # in place of a triangle beyond an edge, where there is none

# What a foot lies on in its triangle: its inside, the edges AB, AC, BC, the corners A, B, C.
IN_TRIANGLE, EDGE_1, EDGE_2, EDGE_3, CORNER_1, CORNER_2, CORNER_3 = range(7)

# --- cells of space with the piece of a spline face that Newton's method begins in -----------------------------------------

NAMED = 2  # a cell holds NAMED * (number of a piece) + one of these:
CERTAIN, GUESSED = range(2)  # whether a foot that is found from there is certainly the closest point, or a search may only begin with it

# --- a piece of a spline face: a polynomial in s, t of [-1/2, 1/2] each -------------------------------------------------------

# Bounds over the piece of the lengths of S_s, S_t, S_ss, S_st, S_tt, S_sss, S_sst, S_stt, S_ttt.
M10, M01, M20, M11, M02, M30, M21, M12, M03 = range(9)
# The box that holds it: the middle, three unit axes, half the sides along them. Then where it is on its face, 1 or -1 for the side, and by
# how much the number of the next piece along t is greater.
BOX_MIDDLE, BOX_AXES, BOX_HALF, PIECE_U, PIECE_V, PIECE_DU, PIECE_DV, PIECE_OUTWARD, PIECE_STRIDE = 9, 12, 21, 24, 25, 26, 27, 28, 29
COEFFICIENTS = 32  # of x, y, z: width * width each, that of s^i t^j at i * width + j
WIDTH_CUBIC, WIDTH_QUINTIC = 4, 6
HALF = 0.5  # where a piece ends
# What lies beyond the sides s = -1/2, s = 1/2, t = -1/2, t = 1/2, and at the corners (-,-), (+,-), (-,+), (+,+): a side that goes on
# in another piece has INNER, one at the border of the face the row of its border; a corner of the face has the row of its vertex.
SIDES, CORNERS, LINKS = 4, 4, 8
INNER = -1
BORDER_STEPS = 4  # a border has pseudonormals at so many steps and one place more: x, y, z, and 1 where nothing adjoins
PLACE_WIDTH = 4
BORDER_WIDTH = PLACE_WIDTH * (BORDER_STEPS + 1)
RECTANGLES = 128  # that may wait to be looked at in one piece: three for each halving, and one more
RECTANGLE_WIDTH = 4
PIECE_SCRATCH = SCRATCH + RECTANGLES * RECTANGLE_WIDTH
