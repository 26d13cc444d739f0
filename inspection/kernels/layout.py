"""Where everything is kept: the columns, header slots and codes of the packed tables, by name.

Compiled loops take flat arrays, because a compiled call costs per array. Whoever writes or reads such an array takes the
numbers from here. This file imports nothing of ours.
"""

# --- codes --------------------------------------------------------------------------------------------------------------

INSIDE, CORNER, OPEN_END = range(3)  # what a foot is: inside the curve, at a corner, at an open end
NOT_REJECTED, NOT_FINITE, OFF_SECTION, BEYOND_END, OUTLIER, IN_HOLLOW = range(6)  # why a point of a scan has no verdict
OFF_SURFACE, BEYOND_EDGE, OPPOSITE_FACE, REJECTIONS = range(6, 10)  # the same for points in space; then how many reasons there are
NOT_JUDGED, CONFORM, UNCERTAIN, NONCONFORM = range(-1, 3)  # the verdict on a point; the worse, the greater
SAMPLE_METHODS = ("circle", "chord", "pcp", "veaw")  # those made at the nearest sample, in the order of their codes
CIRCLE, CHORD, PCP, VEAW = range(4)

# --- the foot grid: one array of reals and one of integers, a header and then the tables ------------------------------------

HEADER = 16  # numbers in either header
ORIGIN_X, ORIGIN_Y, BLOCKS_PER_MM = 0, 1, 2  # of the quadtree
GRAIN_MM = 3  # round-off of a place
FIRST_PARAMETER, LAST_PARAMETER, LENGTH_MM = 4, 5, 6  # of the curve
# Integers. The tables stand one after the other; each begins where the one before ends.
BLOCKS_ACROSS, PIECES, LEAVES = 0, 1, 2  # counts; LEAVES of the search tree
PIECES_AT, BOUNDS_AT, BOXES_AT, VERTICES_AT, REALS_END = 3, 4, 5, 6, 7  # among the reals
LINKS_AT, BLOCKS_AT, CELLS_AT, LISTS_AT, INTEGERS_END = 8, 9, 10, 11, 12  # among the integers

# A piece: the polynomials x(t), y(t) and the arc length s(t) by rising powers of t; parameter u = PIECE_U + PIECE_U_PER_T t. The
# piece reaches from -PIECE_END to PIECE_END; its polynomials are valid from PIECE_FIRST to PIECE_LAST.
PIECE_X, PIECE_Y, PIECE_U, PIECE_U_PER_T, PIECE_FIRST, PIECE_LAST, PIECE_STATION, PIECE_WIDTH = 0, 6, 12, 13, 14, 15, 16, 24
PIECE_DEGREE, STATION_DEGREE = 5, 7
PIECE_END = 0.5
BOUND_WIDTH = 4  # bounds of the first four derivatives over a piece
BOX_LOW_X, BOX_LOW_Y, BOX_HIGH_X, BOX_HIGH_Y, BOX_WIDTH = range(5)  # a node of a search tree
VERTEX_X, VERTEX_Y, VERTEX_NORMAL_X, VERTEX_NORMAL_Y, VERTEX_U, VERTEX_KIND, VERTEX_STATION = range(7)  # the kind: CORNER or OPEN_END
VERTEX_WIDTH = 8
PIECE_BEFORE, PIECE_AFTER, PIECE_LINKS = range(3)  # the adjoining piece, or -1 - vertex

BLOCK_LEVEL = 6  # the quadtree's root is cut into 64 x 64 blocks, found by one division
BLOCK_DEPTH = 4  # low bits of a block that hold the depth of its cells; the others hold where they begin
FAR, LISTED = -1, -2  # what a cell holds instead of a piece: nothing, or LISTED - (place of its list)
MOST_BRANCHES = 4  # cells with more stretches than this are left to the search over the whole curve
LIST_WIDTH = 1 + MOST_BRANCHES  # a list: how many pieces, then the pieces

# --- the samples of a nominal -------------------------------------------------------------------------------------------

SAMPLE_X, SAMPLE_Y, TANGENT_X, TANGENT_Y, NORMAL_X, NORMAL_Y, SAMPLE_CURVATURE, SAMPLE_U, SAMPLE_STATION, SAMPLE_SPEED = range(10)
LEFT_POLE_X, LEFT_POLE_Y, RIGHT_POLE_X, RIGHT_POLE_Y, LEFT_POLE_CURVATURE, RIGHT_POLE_CURVATURE = range(10, 16)
LEFT_EDGE_X, LEFT_EDGE_Y, RIGHT_EDGE_X, RIGHT_EDGE_Y = range(16, 20)  # ends of the Voronoi edge shared with the next sample
SAMPLE_COLUMNS, SAMPLE_WIDTH = 20, 24  # rows of whole cache lines
NEXT_SAMPLE, PREVIOUS_SAMPLE, TWIN_SAMPLE, AT_OPEN_END, LINK_WIDTH = range(5)  # -1 for none; AT_OPEN_END is 1 or 0
# What proves a sample the nearest: its place, and for each side three numbers (a, b, c). With (x, y) seen from the sample, a y - b x < c
# says that a point is surely on this side of the far edge of the sample's Voronoi cell. Nothing is below a c of minus infinity.
CELL_LEFT, CELL_RIGHT, CELL_WIDTH = 2, 5, 8  # after SAMPLE_X and SAMPLE_Y
LEAF = 16  # samples in a leaf of the search tree
DOMAIN_START, DOMAIN_END, DOMAIN_LENGTH_MM, DOMAIN_CLOSED = range(4)

# --- results of one point -----------------------------------------------------------------------------------------------

FOOT_U, FOOT_X, FOOT_Y, FOOT_DISTANCE, FOOT_GRADIENT_X, FOOT_GRADIENT_Y, FOOT_CURVATURE, FOOT_VERTEX, FOOT_STATION, FOOT_WIDTH = range(10)

# --- memory of a block of points ----------------------------------------------------------------------------------------

BLOCK = 128  # points worked on together: their intermediate values stay in the first-level cache
CHUNK = 8 * BLOCK  # points that a thread claims at a time
AT_ONCE = 4 * CHUNK  # points that a caller has projected together: their feet stay in the cache
QUEUE = BLOCK * (MOST_BRANCHES + 1)  # a block is taken while fewer than a block's items wait
ITEM_POINT, ITEM_PIECE, ITEM_TRIES, ITEM_WIDTH = range(4)  # an item of the queue
# Reals, BLOCK of each: the columns of the piece (PIECE_WIDTH of them), then these, then where each item of the queue goes on, then a foot.
LANE_X, LANE_Y, LANE_U, LANE_FOOT_X, LANE_FOOT_Y, LANE_DISTANCE, LANE_NORMAL_X, LANE_NORMAL_Y, LANE_CURVATURE, LANE_T, LANE_STATION = (
    BLOCK * i for i in range(PIECE_WIDTH, PIECE_WIDTH + 11)
)
WAITING_T = LANE_STATION + BLOCK
LANE_FOOT = WAITING_T + QUEUE
REALS = LANE_FOOT + FOOT_WIDTH
# Integers, BLOCK of each: piece (or FAR, LISTED - place), where its row begins, whether solved, point, tries; then the unsolved
# lanes, the queue, and the nodes of the search tree that are still to be looked at.
LANE_CONTENT, LANE_ROW, LANE_SOLVED, LANE_POINT, LANE_TRIES, UNSOLVED, WAITING = (BLOCK * i for i in range(7))
STACK = 64
STACK_AT = WAITING + ITEM_WIDTH * QUEUE
INTEGERS = STACK_AT + STACK

# --- sums over points at a pose -----------------------------------------------------------------------------------------

# e are the deviations, J their gradients by p = (shift in mm, rotation in rad about the centre): J e (3); J J', and e times the
# second derivative of e (6 each: xx, xy, xt, yy, yt, tt); e^2; the points that took part; e^2 over those of the pose before.
SLOPE_X, SLOPE_Y, SLOPE_TURN = 0, 1, 2
TANGENTIAL_XX, TANGENTIAL_XY, TANGENTIAL_XT, TANGENTIAL_YY, TANGENTIAL_YT, TANGENTIAL_TT = range(3, 9)
BENDING_XX, BENDING_XY, BENDING_XT, BENDING_YY, BENDING_YT, BENDING_TT = range(9, 15)
SQUARE, COUNT, SQUARE_BEFORE, SUMS = 15, 16, 17, 18

# --- a section's plane in machine coordinates ---------------------------------------------------------------------------

PLANE_ORIGIN, PLANE_X_AXIS, PLANE_Y_AXIS, PLANE_NORMAL, PLANE_WIDTH = 0, 3, 6, 9, 12
