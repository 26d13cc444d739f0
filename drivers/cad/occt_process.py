"""Open CASCADE in a process of its own: the drawn curves of STEP and IGES files, and sections of what has faces.

It prints, holds a quarter of a gigabyte and crashes on bad files: see drivers/helper_process.py. What the child does is occt_reader.py.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from drivers.errors import CadError
from drivers.helper_process import HelperProcess

Array = NDArray[np.float64]
Kind = Literal["step", "iges"]

_READER = "drivers.cad.occt_reader"


@dataclass(frozen=True, slots=True, eq=False)
class CadCurve:
    """One curve, exact: degree, poles (k, 4) in homogeneous form w x, w y, w z, w in mm, and clamped knots (k + degree + 1,)."""

    degree: int
    poles: Array
    knots: Array

    def __post_init__(self) -> None:
        if self.poles.shape != (len(self.knots) - self.degree - 1, 4):
            raise ValueError(f"degree {self.degree}, {self.poles.shape} poles and {len(self.knots)} knots do not fit together")
        for array in (self.poles, self.knots):
            array.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class CadCurves:
    """What a CAD file holds of a profile.

    curves      : the drawn curves; where there are none, the section of the faces by the plane
    faces       : how many faces the file has
    cut         : whether the curves are a section
    residual_mm : how far a section through free-form faces leaves them at most, at the points between its own; 0 where it is exact
    left_out    : kinds of curves that have no exact spline, one for each
    """

    curves: tuple[CadCurve, ...]
    faces: int
    cut: bool
    residual_mm: float
    left_out: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class CadFace:
    """A face, exact: degrees, poles (a, b, 4) in homogeneous form as of a curve, clamped knots; its outside is S_u x S_v.

    reversed    : the outside is the other side
    loop        : (s, 2, 5) segments along its loops, with u, v and x, y, z in mm at both ends; None where it is the whole rectangle
    loop_off_mm : how far the loops may lie off those segments: by the tolerance of its edges, and by how far the segments stray
    """

    degree: tuple[int, int]
    poles: Array
    knots_u: Array
    knots_v: Array
    reversed: bool
    loop: Array | None = None
    loop_off_mm: float = 0.0

    def __post_init__(self) -> None:
        for array in (self.poles, self.knots_u, self.knots_v, self.loop):
            if array is not None:
                array.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class CadFaces:
    """The faces of a CAD file.

    faces        : a face for each that is an exact spline, None for each that is not
    triangles_mm : (t, 3, 3) all faces as triangles, outsides out; none where every face is whole
    face         : (t,) the number of the face of each, from 0
    error_mm     : bound of how far the triangles lie off the faces
    """

    faces: tuple[CadFace | None, ...]
    triangles_mm: Array
    face: NDArray[np.int64]
    error_mm: float


class OcctProcess:
    """A running child with Open CASCADE in it. Use as a context manager; one that broke down on a file is started again for the next.

    python : the command that starts the child
    """

    def __init__(self, python: Sequence[str] = (sys.executable,)) -> None:
        self._child = HelperProcess(_READER, python)
        self._greeted = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._child.close()

    def load(self) -> None:
        """Wait until Open CASCADE is loaded. Raises CadError, which says how to install it, where it cannot be."""
        try:
            self._greet()
        except ChildProcessError as error:
            raise CadError(f"Open CASCADE, which reads STEP, cannot be loaded: {error}") from error

    def read(self, path: Path, kind: Kind, origin_mm: Sequence[float], normal: Sequence[float]) -> CadCurves:
        """Read the curves of a file; of faces alone, those of their section by the plane. Raises CadError: the cause and what to do."""
        request = {"do": kind, "path": str(path.resolve()), "origin_mm": list(origin_mm), "normal": list(normal)}
        answer, arrays = self._ask(request)
        curves = [CadCurve(degree, *arrays[2 * i : 2 * i + 2]) for i, degree in enumerate(answer["degrees"])]
        return CadCurves(tuple(curves), answer["faces"], answer["cut"], answer["residual_mm"], tuple(answer["left_out"]))

    def read_faces(self, path: Path, kind: Kind, chord_mm: float) -> CadFaces:
        """Read the faces of a file; where one is trimmed all come as triangles as well, no farther off than about `chord_mm`.

        Raises CadError: the cause and what to do.
        """
        answer, arrays = self._ask({"do": kind, "path": str(path.resolve()), "chord_mm": chord_mm})
        given = iter(arrays)
        faces = tuple(_face(each, given) if "degree" in each else None for each in answer["faces"])
        rest = list(given)
        triangles, owner = rest or (np.empty((0, 3, 3)), np.empty(0, dtype=np.int64))
        return CadFaces(faces, triangles, owner, answer["error_mm"])

    def _ask(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[NDArray[Any]]]:
        """Ask the child, a new one where it broke down on an earlier file. Raises CadError for what it complains of."""
        if self._child.ended:
            self._child.start_again()
            self._greeted = False
        try:
            self._greet()
            answer, arrays = self._child.ask(request)
        except ChildProcessError as error:
            raise CadError(
                f"Open CASCADE breaks down on it ({error}); export the file again, or the profile alone as DXF or IGES"
            ) from error
        if "error" in answer:
            raise CadError(str(answer["error"]))
        return answer, arrays

    def _greet(self) -> None:
        """Wait until Open CASCADE is loaded. Raises CadError where it cannot be."""
        if self._greeted:
            return
        hello, _ = self._child.receive()
        if "error" in hello:
            raise CadError(_how_to_install(hello))
        self._greeted = True


def _face(told: dict[str, Any], given: Iterator[Array]) -> CadFace:
    poles, knots_u, knots_v = next(given), next(given), next(given)
    loop = next(given) if told["trimmed"] else None
    return CadFace((told["degree"][0], told["degree"][1]), poles, knots_u, knots_v, told["reversed"], loop, told.get("loop_off_mm", 0.0))


def read_cad(path: Path, kind: Kind, origin_mm: Sequence[float], normal: Sequence[float]) -> CadCurves:
    """Read one file in a process that ends with it: see `OcctProcess.read`."""
    with OcctProcess() as process:
        return process.read(path, kind, origin_mm, normal)


def read_cad_faces(path: Path, kind: Kind, chord_mm: float) -> CadFaces:
    """Read the faces of one file in a process that ends with it: see `OcctProcess.read_faces`."""
    with OcctProcess() as process:
        return process.read_faces(path, kind, chord_mm)


def _how_to_install(hello: dict[str, Any]) -> str:
    if hello["installed"]:
        return f"Open CASCADE, which reads this file, cannot be loaded: {hello['error']}"
    return (
        f'needs Open CASCADE, which is not installed; install it with: {sys.executable} -m pip install "cmmlink[cad]", '
        "or export the profile as DXF, or as IGES without surfaces"
    )
