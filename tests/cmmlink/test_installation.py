"""An installation is told to the bit: every change of a file that computes is found, and named, whatever its size and times say."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cmmlink import installation
from cmmlink.installation import Installation, read_installation

FILES = {
    "inspection/kernels/rows.py": b"def rows(): return 1.0\n",
    "inspection/live.py": b"LIMIT = 0.05\n",
    "drivers/maps/gocator.yaml": b"x: 41\n",
    "numpy/core.so": b"\x7fELF 1234",
    "numpy/linalg/lapack.py": b"EPS = 2.2e-16\n",
    "numpy.libs/libopenblas.so.0.3": b"\x7fELF dgemm",
}


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Packages of which everything is known, in place of those that are installed."""
    for name, content in FILES.items():
        path = tmp_path / "site-packages" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    root = tmp_path / "site-packages"

    def roots(names: tuple[str, ...]) -> Iterator[tuple[str, Path]]:
        yield from ((name, root / name) for name in names if (root / name).is_dir())
        if "numpy" in names:
            yield "numpy.libs", root / "numpy.libs"

    monkeypatch.setattr(installation, "_roots", roots)
    monkeypatch.setattr(installation, "compiled_code_folder", lambda: root / "compiled")
    return root


def _flip_a_bit(path: Path) -> None:
    """Change one bit and nothing else: neither the size nor the time of the last change of the content."""
    told = path.stat()
    content = bytearray(path.read_bytes())
    content[-2] ^= 1
    path.write_bytes(bytes(content))
    os.utime(path, ns=(told.st_atime_ns, told.st_mtime_ns))


CHANGES: dict[str, Callable[[Path], object]] = {
    "a bit": _flip_a_bit,
    "another name": lambda path: path.rename(path.with_name(f"other_{path.name}")),
    "gone": Path.unlink,
    "one more": lambda path: path.with_name(f"one_more_{path.name}").write_bytes(b"1"),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", FILES)
def test_every_change_of_a_file_is_found_and_its_part_is_named(tree: Path, tmp_path: Path, name: str, change: str) -> None:
    before = read_installation(tmp_path / "kept")
    assert installation._known(tmp_path / "kept" / "installation.json") == before
    CHANGES[change](tree / name)
    assert installation._known(tmp_path / "kept" / "installation.json") is None, "what was kept is not taken for what is there"
    after = read_installation(tmp_path / "kept")
    assert after.sha256 != before.sha256
    assert after.changes_since(before) == [f"files of {name.partition('/')[0]}"]


def test_what_is_no_code_changes_nothing(tree: Path, tmp_path: Path) -> None:
    before = read_installation(tmp_path / "kept")
    for name in ("inspection/__pycache__/live.cpython-311.pyc", "numpy/tests/test_core.py", "numpy/core.pyi"):
        (tree / name).parent.mkdir(exist_ok=True)
        (tree / name).write_bytes(b"any")
    assert read_installation(tmp_path / "kept").changes_since(before) == []


def test_a_file_that_was_only_touched_is_the_same(tree: Path, tmp_path: Path) -> None:
    before = read_installation(tmp_path / "kept")
    os.utime(tree / "inspection/live.py")
    assert read_installation(tmp_path / "kept").sha256 == before.sha256


def test_a_compiled_kernel_counts_but_one_more_or_less_does_not(tree: Path, tmp_path: Path) -> None:
    kept = tree / "compiled" / "kernels_1"
    kept.mkdir(parents=True)
    for name in ("rows.1.nbc", "feet.1.nbc"):
        (kept / name).write_bytes(b"machine code")
    before = read_installation(tmp_path / "kept")
    (kept / "search.1.nbc").write_bytes(b"more of it")
    (kept / "feet.1.nbc").unlink()
    assert read_installation(tmp_path / "kept").changes_since(before) == []
    _flip_a_bit(kept / "rows.1.nbc")
    assert installation._known(tmp_path / "kept" / "installation.json") is None
    assert read_installation(tmp_path / "kept").changes_since(before) == ["compiled kernels"]


@pytest.mark.parametrize("name", ["Python", "system", "processor"])
def test_another_python_system_or_processor_is_another_installation(
    tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    before = read_installation(tmp_path / "kept")
    now = {**installation._surroundings(), name: "another"}
    monkeypatch.setattr(installation, "_surroundings", lambda: now)
    assert installation._known(tmp_path / "kept" / "installation.json") is None
    assert read_installation(tmp_path / "kept").changes_since(before) == [name]


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b'{"parts": 1, "compiled": {}, "paths": 3, "stamps": ""}', b"\xff"])
def test_what_is_kept_and_cannot_be_read_is_looked_up_anew(tree: Path, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "installation.json").write_bytes(content)
    assert installation._known(tmp_path / "installation.json") is None


def test_this_installation_is_told_with_every_library_that_computes(tmp_path: Path) -> None:
    here = read_installation(tmp_path)
    assert installation._known(tmp_path / "installation.json") == here
    assert here == Installation(**{"parts": here.parts, "compiled": here.compiled})
    for name in ("inspection", "drivers", "cmmlink", "numpy", "scipy", "numba", "llvmlite"):
        assert len(here.parts[f"files of {name}"]) == 64
    for name in ("numpy", "scipy", "numba", "ezdxf", "Python", "system", "processor"):
        assert here.parts[name]
    assert len(set(here.parts.values())) == len(here.parts), "no two parts are the same text"
