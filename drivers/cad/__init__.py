"""Curves and faces of CAD files that only a geometry kernel reads: STEP, and IGES with surfaces or solids. This is the front door.

Open CASCADE itself is loaded only by the child process that reads a file.
"""

from drivers.cad.occt_process import CadCurve, CadCurves, CadFace, CadFaces, Kind, OcctProcess, read_cad, read_cad_faces

__all__ = ["CadCurve", "CadCurves", "CadFace", "CadFaces", "Kind", "OcctProcess", "read_cad", "read_cad_faces"]
