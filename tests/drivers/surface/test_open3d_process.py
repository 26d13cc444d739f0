"""Open3D in its own process: found or not found, alive or gone, and its files good or bad."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.errors import MeshError
from drivers.surface.open3d_process import Open3DMissing, Open3DProcess, Open3DStatus, mend_open3d, open3d_status, status_from
from tests.drivers.surface.meshes import Triangles, box, write

CUBE = box((0, 0, 0), (10, 10, 10))


def ply(triangles: Triangles, vertices: int | None = None) -> str:
    flat = triangles.reshape(-1, 3)
    head = f"ply\nformat ascii 1.0\nelement vertex {vertices or len(flat)}\nproperty double x\nproperty double y\nproperty double z\n"
    head += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in flat.tolist()] + [f"3 {3 * i} {3 * i + 1} {3 * i + 2}" for i in range(len(triangles))]
    return head + "\n".join(rows) + "\n"


def as_set(triangles: Triangles) -> set[tuple[float, ...]]:
    return {tuple(corners) for corners in triangles.reshape(-1, 9).tolist()}


def test_ply_is_read_as_written(open3d: Open3DProcess, tmp_path: Path) -> None:
    mesh = open3d.read(write(tmp_path / "cube.ply", ply(CUBE)), scale=2.0)
    assert as_set(np.concatenate(list(mesh.pieces()))) == as_set(2 * CUBE)
    assert (mesh.kind, mesh.warnings) == ("PLY", ())


@pytest.mark.parametrize("line", ["comment\n", "comment \n", "comment made for a test\n", "obj_info\n", "\n"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_header_lines_without_words_do_not_lose_the_surface(open3d: Open3DProcess, tmp_path: Path, line: str, ending: str) -> None:
    text = ply(CUBE).replace("element vertex", line + "element vertex", 1).replace("end_header", line + "end_header")
    mesh = open3d.read(write(tmp_path / "cube.ply", text.replace("\n", ending)))
    assert as_set(np.concatenate(list(mesh.pieces()))) == as_set(CUBE)


def test_a_point_cloud_and_faces_that_are_not_there_are_told_apart(open3d: Open3DProcess, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="a point cloud: its header announces no faces"):
        open3d.read(write(tmp_path / "cloud.ply", ply(CUBE[:0], vertices=3) + "0 0 0\n1 0 0\n0 1 0\n"))
    with pytest.raises(MeshError, match="its header announces 12 faces"):
        open3d.read(write(tmp_path / "cut.ply", ply(CUBE)[: ply(CUBE).index("end_header") + 40]))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("cut.ply", ply(CUBE)[:300]),
        ("empty.ply", ""),
        ("words.ply", "this is no surface\n"),
        ("points.ply", ply(CUBE[:0], vertices=1) + "0 0 0\n"),
        ("nan.ply", ply(CUBE).replace("10.0 10.0 10.0", "nan 10.0 10.0", 1)),
    ],
)
def test_bad_ply_files_give_one_clear_error(open3d: Open3DProcess, tmp_path: Path, name: str, content: str) -> None:
    with pytest.raises(MeshError, match=name) as caught:
        open3d.read(write(tmp_path / name, content))
    assert "\n" not in str(caught.value)
    assert open3d.status().version is not None
    assert len(open3d.cut(CUBE[:4] - [0, 0, 5.0])) > 0  # it answers again, even where it crashed on the file


def test_a_missing_ply_file(open3d: Open3DProcess, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="No such file"):
        open3d.read(tmp_path / "nowhere.ply")


def test_a_process_that_ends_at_once_is_a_status_and_an_error_not_a_hang() -> None:
    with Open3DProcess((sys.executable, "-c", "raise SystemExit(3)")) as process:
        assert process.status().version is None
        assert "exit status 3" in process.status().sentence()
        with pytest.raises(Open3DMissing, match="exit status 3"):
            process.cut(CUBE)


def test_a_process_that_was_killed_is_started_again(open3d: Open3DProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    children: list[subprocess.Popen[bytes]] = []

    def start(*arguments: Any, **options: Any) -> subprocess.Popen[bytes]:
        children.append(popen(*arguments, **options))
        return children[-1]

    popen = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", start)
    with Open3DProcess() as process:
        name = process.name
        above = CUBE - [0, 0, 5.0]
        segments = process.cut(above[above[:, :, 2].min(axis=1) < 0])
        children[0].kill()
        children[0].wait()
        assert np.array_equal(process.cut(above[above[:, :, 2].min(axis=1) < 0]), segments)
        assert process.name == name
        assert len(children) == 2


def test_a_library_that_cannot_be_loaded_is_told_with_its_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "open3d"
    package.mkdir()
    write(package / "__init__.py", "raise ImportError('libnowhere.so.7: cannot open shared object file')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    status = open3d_status()
    assert status.version is None
    assert "libnowhere.so.7" in status.reason
    assert status.sentence().startswith("Open3D cannot be loaded")


def test_missing_libraries_name_the_exact_command() -> None:
    hello = {"error": "libGL.so.1: cannot open", "installed": True, "missing": ["libusb-1.0.so.0", "libGL.so.1", "libEGL.so.1"]}
    apt = status_from(hello, which=lambda name: "/usr/bin/apt-get" if name == "apt-get" else None)
    assert apt.mend == ("apt-get", "install", "--yes", "libusb-1.0-0", "libgl1", "libegl1")
    assert apt.sentence().endswith("mend it with: apt-get install --yes libusb-1.0-0 libgl1 libegl1")
    dnf = status_from(hello, which=lambda name: "/usr/bin/dnf" if name == "dnf" else None)
    assert dnf.mend == ("dnf", "install", "--assumeyes", "libusb1", "mesa-libGL", "mesa-libEGL")
    assert status_from(hello, which=lambda name: None).mend is None


def test_open3d_that_is_not_installed_names_the_one_pip_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "darwin")
    monkeypatch.setattr("platform.machine", lambda: "arm64")
    status = status_from({"error": "No module named 'open3d'", "installed": False, "missing": []})
    assert not status.installed
    assert status.mend == (sys.executable, "-m", "pip", "install", "cmmlink[open3d]")
    assert status.sentence().startswith("Open3D is not installed; install it with: ")
    assert status.sentence().endswith(' -m pip install "cmmlink[open3d]"')


@pytest.mark.parametrize(
    ("system", "machine", "library", "exists"),
    [
        ("linux", "x86_64", ("glibc", "2.35"), True),
        ("linux", "aarch64", ("glibc", "2.41"), True),
        ("linux", "x86_64", ("glibc", "2.28"), False),  # RHEL 8
        ("linux", "x86_64", ("glibc", "2.9"), False),
        ("linux", "x86_64", ("", ""), False),  # musl
        ("linux", "riscv64", ("glibc", "2.41"), False),
        ("darwin", "arm64", ("", ""), True),
        ("darwin", "x86_64", ("", ""), False),
        ("win32", "AMD64", ("", ""), True),
        ("win32", "ARM64", ("", ""), False),
    ],
)
def test_where_open3d_has_no_wheel_no_command_is_named(
    system: str, machine: str, library: tuple[str, str], exists: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", system)
    monkeypatch.setattr("platform.machine", lambda: machine)
    monkeypatch.setattr("platform.libc_ver", lambda: library)
    status = status_from({"error": "No module named 'open3d'", "installed": False, "missing": []})
    assert (status.mend is not None) is exists
    assert ("has no wheel of it for this system" in status.sentence()) is not exists


@pytest.mark.parametrize(("is_root", "exit_status", "mended"), [(True, 0, True), (True, 100, False), (False, 0, False)])
def test_mending_runs_apt_only_as_root(is_root: bool, exit_status: int, mended: bool) -> None:
    ran: list[tuple[str, ...]] = []
    status = Open3DStatus(None, ("libGL.so.1",), ("apt-get", "install", "--yes", "libgl1"))

    def run(command: object) -> int:
        ran.append(tuple(command))  # type: ignore[arg-type]
        return exit_status

    assert mend_open3d(status, run, is_root) is mended
    if mended:
        assert ran == [("apt-get", "update", "--quiet"), ("apt-get", "install", "--yes", "libgl1")]
    if not is_root:
        assert ran == []
