"""Open CASCADE in a process of its own: the drawn curves of STEP and IGES files, and sections of what has faces.

It prints, holds a quarter of a gigabyte and crashes on bad files: see drivers/helper_process.py. What the child does is occt_reader.py.
"""

import sys
from collections.abc import Sequence
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
        if self._child.ended:
            self._child.start_again()
            self._greeted = False
        request = {"do": kind, "path": str(path.resolve()), "origin_mm": list(origin_mm), "normal": list(normal)}
        try:
            self._greet()
            answer, arrays = self._child.ask(request)
        except ChildProcessError as error:
            raise CadError(
                f"Open CASCADE breaks down on it ({error}); export the file again, or the profile alone as DXF or IGES"
            ) from error
        if "error" in answer:
            raise CadError(str(answer["error"]))
        curves = [CadCurve(degree, *arrays[2 * i : 2 * i + 2]) for i, degree in enumerate(answer["degrees"])]
        return CadCurves(tuple(curves), answer["faces"], answer["cut"], answer["residual_mm"], tuple(answer["left_out"]))

    def _greet(self) -> None:
        """Wait until Open CASCADE is loaded. Raises CadError where it cannot be."""
        if self._greeted:
            return
        hello, _ = self._child.receive()
        if "error" in hello:
            raise CadError(_how_to_install(hello))
        self._greeted = True


def read_cad(path: Path, kind: Kind, origin_mm: Sequence[float], normal: Sequence[float]) -> CadCurves:
    """Read one file in a process that ends with it: see `OcctProcess.read`."""
    with OcctProcess() as process:
        return process.read(path, kind, origin_mm, normal)


def _how_to_install(hello: dict[str, Any]) -> str:
    if hello["installed"]:
        return f"Open CASCADE, which reads this file, cannot be loaded: {hello['error']}"
    return (
        f'needs Open CASCADE, which is not installed; install it with: {sys.executable} -m pip install "cmmlink[cad]", '
        "or export the profile as DXF, or as IGES without surfaces"
    )
