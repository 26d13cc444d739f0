"""How far Open CASCADE finds points from the faces of STEP and IGES files, in a process of its own: `python -m ... FILE.npy FILE ...`.

The .npy file holds points (m, 3). Prints JSON: for each file the distances of all points, by its extrema on trimmed faces.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.gp import gp_Pnt
from OCP.IGESControl import IGESControl_Reader
from OCP.Message import Message, Message_PrinterOStream
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer


def distances(path: Path, points: Any) -> list[float]:
    reader = IGESControl_Reader() if path.suffix == ".igs" else STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    found = np.full(len(points), np.inf)
    faces = TopExp_Explorer(reader.OneShape(), TopAbs_FACE)
    while faces.More():
        for i, point in enumerate(points):
            vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*point.tolist())).Vertex()
            found[i] = min(found[i], BRepExtrema_DistShapeShape(vertex, faces.Current()).Value())
        faces.Next()
    return [float(value) for value in found]


if __name__ == "__main__":
    Message.DefaultMessenger_s().RemovePrinters(Message_PrinterOStream.get_type_descriptor_s())
    given = np.load(sys.argv[1])
    print(json.dumps([distances(Path(name), given) for name in sys.argv[2:]]))
