"""Open3D in a process of its own: it cuts selected triangles and reads PLY files.

Why a process: importing Open3D stops every thread of a program for a tenth of a second at a time, and `slice_plane` holds the
interpreter for as long as it runs; acquisition must never wait for either. And a file on which Open3D crashes
costs a message and not the run. This is the only file that imports open3d, and only the child does.
"""

import ctypes
import importlib.util
import platform
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from threading import Lock
from types import ModuleType, TracebackType
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from drivers.errors import MeshError
from drivers.helper_process import Answer, HelperProcess, answer_questions
from drivers.surface.ply_header import faces_announced, header_of, readable
from drivers.surface.stl_file import SurfaceMesh, rounding_note, surface_of

# Shared libraries that Open3D needs and wheels do not bring, with the package that holds each on Debian/Ubuntu and Fedora.
LIBRARIES: Final = {
    "libusb-1.0.so.0": ("libusb-1.0-0", "libusb1"),
    "libGL.so.1": ("libgl1", "mesa-libGL"),
    "libEGL.so.1": ("libegl1", "mesa-libEGL"),
    "libX11.so.6": ("libx11-6", "libX11"),
}


class Open3DMissing(RuntimeError):  # noqa: N818 - reads as the sentence it is
    """Open3D cannot be loaded; the message says why and what mends it."""


@dataclass(frozen=True, slots=True)
class Open3DStatus:
    """Whether Open3D can be loaded.

    version : None when it cannot
    installed : whether it is there at all; it is an extra, and nothing is wrong where it is not
    missing : shared libraries that the system lacks
    mend    : the exact command that mends it, when one is known
    reason  : what the import said
    """

    version: str | None
    missing: tuple[str, ...] = ()
    mend: tuple[str, ...] | None = None
    reason: str = ""
    installed: bool = True

    def sentence(self) -> str:
        """One line for the operator."""
        if self.version:
            return f"Open3D {self.version} can be loaded"
        if not self.installed:
            return f"Open3D is not installed{f'; install it with: {_quote(self.mend)}' if self.mend else f', and {self.reason}'}"
        what = f"the system lacks {', '.join(self.missing)}" if self.missing else self.reason
        return f"Open3D cannot be loaded: {what}" + (f"; mend it with: {_quote(self.mend)}" if self.mend else "")


class Open3DProcess:
    """A running child with Open3D in it: a `Cutter` for cut.py, and the reader of PLY.

    Use as a context manager. Starting returns at once; the first call waits until Open3D is there.
    """

    def __init__(self, python: Sequence[str] = (sys.executable,)) -> None:
        self._child = HelperProcess(__name__, python)
        self._status: Open3DStatus | None = None
        self._turn = Lock()  # one question at a time; threads that chain meanwhile do not wait

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End the child; it has nothing to save."""
        self._child.close()

    def status(self) -> Open3DStatus:
        """Wait until Open3D is loaded, or is known not to load."""
        if self._status is None:
            try:
                hello, _ = self._receive()
                self._status = status_from(hello)
            except Open3DMissing as error:
                self._status = Open3DStatus(None, reason=str(error))
        return self._status

    @property
    def name(self) -> str:
        """As a result states it."""
        return f"open3d {self.status().version}"

    def cut(self, triangles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Cut (t, 3, 3) triangles, in-plane x, y and height above the plane, to (s, 2, 2) segments by `slice_plane`."""
        with self._turn:
            _, (points, lines) = self._ask({"do": "cut"}, [np.ascontiguousarray(triangles, dtype=np.float64)])
        return np.asarray(points[lines][:, :, :2], dtype=np.float64)

    def read(self, path: Path, scale: float = 1.0) -> SurfaceMesh:
        """Read PLY, whatever Open3D reads; raises `MeshError` where it yields no triangles or breaks."""
        vertices, triangles, faces = self._read(path)
        mesh = surface_of(_corners(vertices * scale, triangles, path, faces), str(path), "PLY")
        return replace(mesh, warnings=rounding_note(mesh, scale) if vertices.dtype == np.float32 else ())

    def faces_of(self, path: Path, vertices: int) -> NDArray[np.int64]:
        """The triangles (t, 3) of a PLY file with so many vertices, as numbers of these from 0. Raises as `read` does."""
        places, triangles, faces = self._read(path)
        _corners(places, triangles, path, faces)
        if len(places) != vertices:
            raise MeshError(f"{path}: Open3D reads {len(places)} of its {vertices} vertices; export the surface again, or as STL")
        return triangles.astype(np.int64)

    def _read(self, path: Path) -> tuple[NDArray[Any], NDArray[Any], int]:
        """The vertices (v, 3) of a PLY file, its triangles (t, 3), and how many faces it announces."""
        header = header_of(path)
        with readable(path, header) as file, self._turn:
            loaded = self.status().version is not None
            try:
                answer, arrays = self._ask({"do": "read", "path": str(file)}, [])
            except Open3DMissing as error:
                if not loaded:
                    raise
                raise MeshError(f"{path}: Open3D breaks down on it ({error}); export the surface again, or as STL") from error
        if "error" in answer:
            raise MeshError(f"{path}: Open3D cannot read it ({answer['error']}); export the surface again, or as STL")
        vertices, triangles = arrays
        return vertices, triangles, faces_announced(header)

    def _ask(self, request: dict[str, Any], arrays: list[NDArray[Any]]) -> tuple[dict[str, Any], list[NDArray[Any]]]:
        status = self.status()
        if status.version is None:
            raise Open3DMissing(status.sentence())
        if self._child.ended:  # it broke down on an earlier question: a bad file must not spoil the next
            self._child.start_again()
            self._receive()
        try:
            return self._child.ask(request, arrays)
        except ChildProcessError as error:
            raise Open3DMissing(f"the process with Open3D ended ({error})") from error

    def _receive(self) -> tuple[dict[str, Any], list[NDArray[Any]]]:
        try:
            return self._child.receive()
        except ChildProcessError as error:
            raise Open3DMissing(f"the process with Open3D ended ({error})") from error


def open3d_status(python: Sequence[str] = (sys.executable,)) -> Open3DStatus:
    """Try to load Open3D in a process of its own and say what came of it, and what would mend it."""
    with Open3DProcess(python) as child:
        return child.status()


def mend_open3d(status: Open3DStatus, run: Callable[[Sequence[str]], int], is_root: bool) -> bool:
    """Install the missing shared libraries where apt and the rights of root allow it. `run` returns the exit status of a command.

    Returns whether a command ran and succeeded; `status.mend` is what the operator has to run otherwise.
    """
    if status.mend is None or status.mend[0] != "apt-get" or not is_root:
        return False
    return run(("apt-get", "update", "--quiet")) == 0 and run(status.mend) == 0


def status_from(hello: dict[str, Any], which: Callable[[str], str | None] = shutil.which) -> Open3DStatus:
    """Read the first message of the child, and find the command that would mend what it complains of."""
    if "version" in hello:
        return Open3DStatus(str(hello["version"]))
    if not hello.get("installed"):
        if _wheel_exists():
            return Open3DStatus(None, mend=(sys.executable, "-m", "pip", "install", "cmmlink[open3d]"), installed=False)
        return Open3DStatus(None, reason="the package index has no wheel of it for this system", installed=False)
    missing = tuple(hello.get("missing", ()))
    return Open3DStatus(None, missing, _mending_command(missing, which), str(hello.get("error", "")))


def _wheel_exists() -> bool:
    """Whether Open3D 0.20 has a wheel for this system: the markers of the extra in pyproject.toml, and the C library."""
    if sys.version_info >= (3, 15):
        return False
    if sys.platform == "linux":
        library, version = platform.libc_ver()
        new = library == "glibc" and tuple(int(part) for part in version.split(".")[:2]) >= (2, 35)
        return new and platform.machine() in ("x86_64", "aarch64")
    return (sys.platform, platform.machine()) in (("darwin", "arm64"), ("win32", "AMD64"))


def _quote(command: Sequence[str]) -> str:
    """Spell a command as every shell takes it."""
    return " ".join(f'"{word}"' if set(word) & set(" []") else word for word in command)


def _mending_command(missing: tuple[str, ...], which: Callable[[str], str | None]) -> tuple[str, ...] | None:
    if missing and which("apt-get"):
        return ("apt-get", "install", "--yes", *(LIBRARIES[name][0] for name in missing))
    if missing and which("dnf"):
        return ("dnf", "install", "--assumeyes", *(LIBRARIES[name][1] for name in missing))
    return None


def _corners(vertices: NDArray[np.floating], triangles: NDArray[np.integer], path: Path, faces: int) -> NDArray[np.floating]:
    if not len(triangles):
        if faces == 0:
            raise MeshError(f"{path}: a point cloud: its header announces no faces. Export the surface as triangles")
        raise MeshError(
            f"{path}: its header announces {faces} faces, but Open3D reads no triangle from it: is it truncated? "
            "Export the surface again, or as STL"
        )
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        bad = int(np.flatnonzero((triangles < 0).any(axis=1) | (triangles >= len(vertices)).any(axis=1))[0])
        raise MeshError(
            f"{path}: triangle {bad + 1} names a vertex that is not there (there are {len(vertices)}); export the surface again"
        )
    return np.asarray(vertices[triangles])


def serve() -> None:
    """Run as the child."""
    answer_questions(_load)


def _load() -> tuple[dict[str, Any], Answer | None]:
    try:
        open3d = load_open3d()
    except Exception as error:  # whatever keeps it from being loaded is told to the operator
        installed = importlib.util.find_spec("open3d") is not None
        return {"error": str(error), "installed": installed, "missing": _missing_libraries()}, None
    return {"version": open3d.__version__}, partial(_answer, open3d)


def _answer(open3d: Any, request: dict[str, Any], arrays: list[NDArray[Any]]) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    return _cut(open3d, arrays[0]) if request["do"] == "cut" else _read(open3d, request["path"])


def load_open3d() -> ModuleType:
    """Import Open3D, with the libusb of the package index loaded first: pip installs none that the loader would find."""
    if sys.platform == "linux" and importlib.util.find_spec("libusb_package") is not None:
        import libusb_package  # noqa: PLC0415 - only the child loads it

        library = libusb_package.get_library_path()
        if library is not None:
            ctypes.CDLL(str(library))
    import open3d  # noqa: PLC0415 - only the child loads it

    return open3d


def _missing_libraries() -> list[str]:
    if sys.platform != "linux":
        return []
    missing = []
    for name in LIBRARIES:
        try:
            ctypes.CDLL(name)
        except OSError:
            missing.append(name)
    return missing


def _cut(open3d: Any, triangles: NDArray[np.float64]) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    """Cut at height zero, in float64; the normal is z, because the third coordinate is the height above the plane."""
    core = open3d.core
    corners = core.Tensor.from_numpy(triangles.reshape(-1, 3).copy())
    indices = core.Tensor.from_numpy(np.arange(3 * len(triangles), dtype=np.int64).reshape(-1, 3))
    lines = open3d.t.geometry.TriangleMesh(corners, indices).slice_plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0])
    if "positions" not in lines.point or "indices" not in lines.line:
        return {}, [np.empty((0, 3)), np.empty((0, 2), dtype=np.int64)]
    return {}, [lines.point.positions.numpy(), lines.line.indices.numpy()]


def _read(open3d: Any, path: str) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    try:
        mesh = open3d.t.io.read_triangle_mesh(path)
        if "positions" not in mesh.vertex or "indices" not in mesh.triangle:
            return {}, [np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)]
        return {}, [mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy()]
    except Exception as error:
        return {"error": str(error)}, []
