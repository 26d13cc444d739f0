"""Surfaces: meshes are read, cut, and chained into contours. This is the front door for whoever needs surfaces.

Open3D itself is loaded only by the child process of `Open3DProcess`.
"""

from drivers.surface.contour_source import Contour, ContourSource, Gap, SurfaceSection, add_points_between
from drivers.surface.cut import Cutter, NumpyCutter, cut_surface, height_range_mm
from drivers.surface.obj_file import read_obj
from drivers.surface.open3d_process import Open3DMissing, Open3DProcess, Open3DStatus, mend_open3d, open3d_status
from drivers.surface.ply_cloud import PlyCloud, is_ply_cloud, read_ply_cloud
from drivers.surface.section_axes import SectionAxes, axes_of
from drivers.surface.stl_file import SurfaceMesh, read_stl, surface_of

__all__ = [
    "Contour",
    "ContourSource",
    "Cutter",
    "Gap",
    "NumpyCutter",
    "Open3DMissing",
    "Open3DProcess",
    "Open3DStatus",
    "PlyCloud",
    "SectionAxes",
    "SurfaceMesh",
    "SurfaceSection",
    "add_points_between",
    "axes_of",
    "cut_surface",
    "height_range_mm",
    "is_ply_cloud",
    "mend_open3d",
    "open3d_status",
    "read_obj",
    "read_ply_cloud",
    "read_stl",
    "surface_of",
]
