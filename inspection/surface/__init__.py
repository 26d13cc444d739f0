"""Whole surfaces against CAD, meshes and clouds: closest points with the right sign, poses in six freedoms.

This is the front door, beside that of the package around it, which holds what both share: the tolerance zone, verdicts, rejections.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from inspection.surface.ball_centres import BallCentres
    from inspection.surface.cloud_surface import CloudSurface
    from inspection.surface.feet import FootKind, NominalSurface, SurfaceFeet, rejections
    from inspection.surface.judged_surface import judge_surface
    from inspection.surface.live_surface import LiveSurface, SurfaceUpdate
    from inspection.surface.odd_faces import SingleFace, words_on_odd_faces, words_on_odd_triangles
    from inspection.surface.patches import PatchSurface
    from inspection.surface.rehearsal import rehearse_surface, rehearse_surfaces
    from inspection.surface.rigid_motion import RigidMotion
    from inspection.surface.section_course import SectionCourse, course_of_section, into_plane
    from inspection.surface.spline_face import SplineFace
    from inspection.surface.surface_fit import SurfaceFreedom, SurfaceRegistration, register_surface
    from inspection.surface.surface_result import Defect, SurfaceResult, Unmeasured
    from inspection.surface.surface_terms import SurfaceTerms
    from inspection.surface.triangles import TriangleSurface
    from inspection.surface.trimmed_surface import TrimmedFace, TrimmedSurface
    from inspection.surface.weakness import Weakness
    from inspection.surface.welding import have_area
else:
    from inspection.front_door import load_on_use

    _PLACES = {
        "inspection.surface.ball_centres": ("BallCentres",),
        "inspection.surface.cloud_surface": ("CloudSurface",),
        "inspection.surface.feet": ("FootKind", "NominalSurface", "SurfaceFeet", "rejections"),
        "inspection.surface.judged_surface": ("judge_surface",),
        "inspection.surface.live_surface": ("LiveSurface", "SurfaceUpdate"),
        "inspection.surface.odd_faces": ("SingleFace", "words_on_odd_faces", "words_on_odd_triangles"),
        "inspection.surface.patches": ("PatchSurface",),
        "inspection.surface.surface_fit": ("SurfaceFreedom", "SurfaceRegistration", "register_surface"),
        "inspection.surface.surface_result": ("Defect", "SurfaceResult", "Unmeasured"),
        "inspection.surface.surface_terms": ("SurfaceTerms",),
        "inspection.surface.rehearsal": ("rehearse_surface", "rehearse_surfaces"),
        "inspection.surface.rigid_motion": ("RigidMotion",),
        "inspection.surface.section_course": ("SectionCourse", "course_of_section", "into_plane"),
        "inspection.surface.spline_face": ("SplineFace",),
        "inspection.surface.triangles": ("TriangleSurface",),
        "inspection.surface.trimmed_surface": ("TrimmedFace", "TrimmedSurface"),
        "inspection.surface.weakness": ("Weakness",),
        "inspection.surface.welding": ("have_area",),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "BallCentres",
    "CloudSurface",
    "Defect",
    "FootKind",
    "LiveSurface",
    "NominalSurface",
    "PatchSurface",
    "RigidMotion",
    "SectionCourse",
    "SingleFace",
    "SplineFace",
    "SurfaceFeet",
    "SurfaceFreedom",
    "SurfaceRegistration",
    "SurfaceResult",
    "SurfaceTerms",
    "SurfaceUpdate",
    "TriangleSurface",
    "TrimmedFace",
    "TrimmedSurface",
    "Unmeasured",
    "Weakness",
    "course_of_section",
    "have_area",
    "into_plane",
    "judge_surface",
    "register_surface",
    "rehearse_surface",
    "rehearse_surfaces",
    "rejections",
    "words_on_odd_faces",
    "words_on_odd_triangles",
]
