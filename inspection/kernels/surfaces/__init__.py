"""The compiled inner loops of surfaces in space: closest points of triangles, of spline patches and of clouds.

They compile by themselves, and are kept in a folder of their own: who inspects sections never waits for them. As in the package
around it every point is worked out on its own: no result depends on the batch, the order or the thread that a point comes in.
"""

TYPE_CHECKING = False  # as type checkers read it

if TYPE_CHECKING:
    from inspection.kernels.surfaces.on_patches import PatchTables, project_on_patches
    from inspection.kernels.surfaces.on_triangles import TriangleTables, project_on_triangles
    from inspection.kernels.surfaces.patch_cells import PatchNets, fill_patch_cells
    from inspection.kernels.surfaces.space_feet import SpaceFeet
    from inspection.kernels.surfaces.triangle_cells import CellMemory, fill_cells
else:
    from inspection.front_door import load_on_use

    _PLACES = {
        "inspection.kernels.surfaces.on_patches": ("PatchTables", "project_on_patches"),
        "inspection.kernels.surfaces.on_triangles": ("TriangleTables", "project_on_triangles"),
        "inspection.kernels.surfaces.patch_cells": ("PatchNets", "fill_patch_cells"),
        "inspection.kernels.surfaces.space_feet": ("SpaceFeet",),
        "inspection.kernels.surfaces.triangle_cells": ("CellMemory", "fill_cells"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "CellMemory",
    "PatchNets",
    "PatchTables",
    "SpaceFeet",
    "TriangleTables",
    "fill_cells",
    "fill_patch_cells",
    "project_on_patches",
    "project_on_triangles",
]
