"""The compiled inner loops (numba): closest points on a curve, the paper's projections, poses, and the rows of a scan.

Every point is worked out on its own: no result depends on the batch, the order or the thread that a point comes in.
Arithmetic is plain IEEE double precision with explicit fused multiply-adds, so results are the same bit for bit in
vectorised and scalar code. Nothing is compiled at import; the first call does it. A name is loaded when it is used, and
numba with the first name that needs it.

What the rest of the project may call stands here; the files behind it are this package's own.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from inspection.kernels.blocks import CurveTables, compile_projection
    from inspection.kernels.compile_notice import while_compiling
    from inspection.kernels.compiling import compiled_code_folder
    from inspection.kernels.feet import Feet, Marks, Room
    from inspection.kernels.few_rows import NONE_TAKEN, FewRows, Taken
    from inspection.kernels.growing import GrowingSums
    from inspection.kernels.layout import AT_ONCE, SAMPLE_METHODS
    from inspection.kernels.on_samples import SampleTables
    from inspection.kernels.outliers import OutlierFit, OutlierLimit
    from inspection.kernels.pose import NONE_LEFT_OUT, PoseEstimate, PoseFit
    from inspection.kernels.projection import Turned, project, project_on_samples, project_outward
    from inspection.kernels.rows import JUDGED_AS, TALLY, Columns, Judgement, Places, judge_rows, take_in
    from inspection.kernels.side_by_side import fit_compiled_beside, is_fit_compiled
    from inspection.kernels.splines import Spline, spline_derivatives
    from inspection.kernels.thinning import strides
    from inspection.kernels.touching import nearest_squared, settle_contacts, smallest_touching
    from inspection.kernels.tree_growing import GrownTree, shortest_tree
else:
    from inspection.front_door import load_on_use

    _PLACES = {
        "inspection.kernels.blocks": ("CurveTables", "compile_projection"),
        "inspection.kernels.compile_notice": ("while_compiling",),
        "inspection.kernels.compiling": ("compiled_code_folder",),
        "inspection.kernels.feet": ("Feet", "Marks", "Room"),
        "inspection.kernels.few_rows": ("NONE_TAKEN", "FewRows", "Taken"),
        "inspection.kernels.growing": ("GrowingSums",),
        "inspection.kernels.layout": ("AT_ONCE", "SAMPLE_METHODS"),
        "inspection.kernels.on_samples": ("SampleTables",),
        "inspection.kernels.outliers": ("OutlierFit", "OutlierLimit"),
        "inspection.kernels.pose": ("NONE_LEFT_OUT", "PoseEstimate", "PoseFit"),
        "inspection.kernels.projection": ("Turned", "project", "project_on_samples", "project_outward"),
        "inspection.kernels.rows": ("JUDGED_AS", "TALLY", "Columns", "Judgement", "Places", "judge_rows", "take_in"),
        "inspection.kernels.side_by_side": ("fit_compiled_beside", "is_fit_compiled"),
        "inspection.kernels.splines": ("Spline", "spline_derivatives"),
        "inspection.kernels.thinning": ("strides",),
        "inspection.kernels.touching": ("nearest_squared", "settle_contacts", "smallest_touching"),
        "inspection.kernels.tree_growing": ("GrownTree", "shortest_tree"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "AT_ONCE",
    "JUDGED_AS",
    "NONE_LEFT_OUT",
    "NONE_TAKEN",
    "SAMPLE_METHODS",
    "TALLY",
    "Columns",
    "CurveTables",
    "Feet",
    "FewRows",
    "GrowingSums",
    "GrownTree",
    "Judgement",
    "Marks",
    "OutlierFit",
    "OutlierLimit",
    "Places",
    "PoseEstimate",
    "PoseFit",
    "Room",
    "SampleTables",
    "Spline",
    "Taken",
    "Turned",
    "compile_projection",
    "compiled_code_folder",
    "fit_compiled_beside",
    "is_fit_compiled",
    "judge_rows",
    "nearest_squared",
    "project",
    "project_on_samples",
    "project_outward",
    "settle_contacts",
    "shortest_tree",
    "smallest_touching",
    "spline_derivatives",
    "strides",
    "take_in",
    "while_compiling",
]
