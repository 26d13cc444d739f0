"""Writes the wire and some solids as Open CASCADE writes them; run as a process of its own: `python -m ... FOLDER`."""

import sys
from collections.abc import Sequence
from math import pi
from pathlib import Path
from typing import Any

from OCP.BRep import BRep_Builder
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeTorus,
)
from OCP.Geom import Geom_BSplineCurve
from OCP.gp import gp_Ax1, gp_Ax2, gp_Circ, gp_Dir, gp_Elips, gp_Pnt, gp_Trsf, gp_Vec
from OCP.IGESControl import IGESControl_Controller, IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_PrinterOStream
from OCP.STEPControl import STEPControl_AsIs, STEPControl_GeometricCurveSet, STEPControl_Writer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound

from tests.cmmlink.nominal_files.wire import CENTER, ELLIPSE_CENTER, LINES, POLES, RADIUS, SEMI_X, SEMI_Y, WEIGHTS

try:
    from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_int
except ImportError:  # as they were called before OCCT 8
    from OCP.TColgp import TColgp_Array1OfPnt as Array1_gp_Pnt
    from OCP.TColStd import TColStd_Array1OfInteger as Array1_int
    from OCP.TColStd import TColStd_Array1OfReal as Array1_double

SCHEMAS = ("AP203", "AP214IS", "AP242DIS")
UNITS = ("MM", "INCH", "M")
TORUS = (30.0, 8.0)


def edges(scale: float = 1.0) -> list[Any]:
    """The wire's edges, in order."""

    def at(place: Sequence[float]) -> Any:
        return gp_Pnt(scale * place[0], scale * place[1], 0)

    up = gp_Dir(0, 0, 1)
    first, last = (BRepBuilderAPI_MakeEdge(at(a), at(b)).Edge() for a, b in LINES)
    circle = gp_Circ(gp_Ax2(at(CENTER), up, gp_Dir(0, -1, 0)), scale * RADIUS)
    poles, weights = _array(Array1_gp_Pnt, [at(pole) for pole in POLES]), _array(Array1_double, list(WEIGHTS))
    cubic = Geom_BSplineCurve(poles, weights, _array(Array1_double, [0.0, 1.0]), _array(Array1_int, [4, 4]), 3)
    ellipse = gp_Elips(gp_Ax2(at(ELLIPSE_CENTER), up, gp_Dir(0, 1, 0)), scale * SEMI_Y, scale * SEMI_X)
    half, quarter = BRepBuilderAPI_MakeEdge(circle, 0.0, pi).Edge(), BRepBuilderAPI_MakeEdge(ellipse, 0.0, pi / 2).Edge()
    return [first, half, BRepBuilderAPI_MakeEdge(cubic).Edge(), quarter, last]


def _array(kind: Any, values: Sequence[Any]) -> Any:
    array = kind(1, len(values))
    for i, value in enumerate(values, 1):
        array.SetValue(i, value)
    return array


def wire(scale: float = 1.0) -> Any:
    maker = BRepBuilderAPI_MakeWire()
    for edge in edges(scale):
        maker.Add(edge)
    return maker.Wire()


def write_step(shape: Any, path: Path, schema: str = "AP214IS", unit: str = "MM", curves: bool = False) -> None:
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.schema", schema)
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(shape, STEPControl_GeometricCurveSet if curves else STEPControl_AsIs)
    writer.Write(str(path))


def write_iges(shapes: Sequence[Any], path: Path, unit: str = "MM", mode: int = 0) -> None:
    writer = IGESControl_Writer(unit, mode)
    for shape in shapes:
        writer.AddShape(shape)
    writer.ComputeModel()
    writer.Write(str(path))


def moved() -> TopLoc_Location:
    """A quarter about x, then 40 mm along y."""
    turn, shift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)), pi / 2)
    shift.SetTranslation(gp_Vec(0, 40, 0))
    return TopLoc_Location(shift.Multiplied(turn))


def main(folder: Path) -> None:
    Message.DefaultMessenger_s().RemovePrinters(Message_PrinterOStream.get_type_descriptor_s())
    IGESControl_Controller.Init_s()
    for schema in SCHEMAS:
        for unit in UNITS:
            write_step(wire(), folder / f"wire-{schema}-{unit}.step", schema, unit, curves=True)
    write_iges(edges(), folder / "wire-MM.igs")
    write_iges(edges(25.4), folder / "wire-IN.igs", "IN")  # numbers that its nine digits hold
    write_iges(edges(), folder / "wire-M.igs", "M")
    write_step(wire().Moved(moved()), folder / "upright.step", curves=True)
    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(20, 15, -5), gp_Dir(0.2, 0, 1)), 8, 40).Shape()
    part = BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(40, 30, 20).Shape(), hole).Shape()
    write_step(part, folder / "part.step", "AP203", "INCH")
    write_step(BRepPrimAPI_MakeTorus(*TORUS).Shape(), folder / "torus.step", "AP242DIS", "M")
    prism = BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire()).Face(), gp_Vec(0, 0, 50)).Shape()
    write_step(prism, folder / "prism.step")
    write_iges([part], folder / "part.igs")
    write_step(BRepPrimAPI_MakeCone(20.0, 15.0, 20.0).Shape(), folder / "cone.step")
    assembly, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(assembly)
    builder.Add(assembly, prism.Moved(moved()))
    write_step(assembly, folder / "assembly.step")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
