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

# --- a cluster of triangles: columns of eight -----------------------------------------------------------------------------

# Corner A, the edges AB and AC, their square lengths' reciprocals, that of BC, and the reciprocal of |AB x AC|^2; 0 stands for none.
CORNER_A, EDGE_AB, EDGE_AC, PER_AB, PER_AC, PER_BC, PER_NORMAL, CLUSTER_ROWS = 0, 3, 6, 9, 10, 11, 12, 13
CLUSTER = WAYS * CLUSTER_ROWS
NOTHING = -1  # in place of a triangle, where a cluster is not full; of a face beyond an edge, where there is none

# What a foot lies on in its triangle: its inside, the edges AB, AC, BC, the corners A, B, C.
IN_TRIANGLE, EDGE_1, EDGE_2, EDGE_3, CORNER_1, CORNER_2, CORNER_3 = range(7)
