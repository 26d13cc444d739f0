"""Compiled code: nothing stale is loaded, whatever file changed; several processes at once; folders that cannot be written."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from numba import njit
from numba.core import config

from inspection.kernels import cache_folder, compiling

INNER = "from inspection.kernels.compiling import kernel\n\nFACTOR = {}\n\n\n@kernel\ndef inner(x):\n    return FACTOR * x\n"
OUTER = """
from inspection.kernels.compiling import kernel
from inspection.kernels.inner import inner


@kernel
def outer(x):
    return inner(x) + 1
"""
CALL = """
from inspection.kernels.compile_notice import while_compiling
from inspection.kernels.outer import outer

told = []
with while_compiling(lambda: told.append("compiling")):
    print(outer(2), *told)
"""
REMOVED = """
import shutil
from pathlib import Path
from inspection.kernels.outer import outer

(folder,) = Path("inspection/kernels/__pycache__").glob("compiled-*")
shutil.rmtree(folder)
print(outer(2))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of two kernels in two files, with the product's own way to compile."""
    package = tmp_path / "inspection" / "kernels"
    package.mkdir(parents=True)
    for name in ("compiling", "compile_notice", "cache_folder", "layout"):
        source = Path(compiling.__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
        (package / f"{name}.py").write_text(source, encoding="utf-8")
    (package.parent / "__init__.py").touch()
    (package / "__init__.py").touch()
    (package / "inner.py").write_text(INNER.format(10), encoding="utf-8")
    (package / "outer.py").write_text(OUTER, encoding="utf-8")
    return package


def started(package: Path, code: str = CALL) -> "subprocess.Popen[str]":
    top = package.parent.parent
    settings = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    settings |= {"PYTHONPATH": str(top), "HOME": str(top / "home"), "USERPROFILE": str(top / "home"), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.Popen([sys.executable, "-c", code], cwd=top, env=settings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def outcome(process: "subprocess.Popen[str]") -> str:
    out, error = process.communicate(timeout=100)
    assert process.returncode == 0, error
    return out.strip()


def test_an_edit_of_an_inner_file_is_seen_by_the_next_process(package: Path) -> None:
    assert outcome(started(package)) == "21 compiling"
    assert outcome(started(package)) == "21"
    (package / "inner.py").write_text(INNER.format(30), encoding="utf-8")
    assert outcome(started(package)) == "61 compiling"


def test_four_processes_that_start_at_once_all_have_their_result(package: Path) -> None:
    processes = [started(package) for _ in range(4)]
    assert {outcome(process).partition(" ")[0] for process in processes} == {"21"}
    assert outcome(started(package)) == "21"


def test_a_process_whose_folder_is_removed_goes_on(package: Path) -> None:
    assert outcome(started(package, REMOVED)) == "21"


def test_a_package_that_cannot_be_written_keeps_its_code_with_the_user(package: Path) -> None:
    (package / "__pycache__").write_text("a file where the folder would be")
    assert outcome(started(package)) == "21 compiling"
    assert outcome(started(package)) == "21"
    (folder,) = (package.parent.parent / "home").rglob("compiled-*")
    assert folder.name == f"compiled-{cache_folder.stamp_of(package)}"


def test_where_nothing_can_be_written_every_process_compiles(package: Path) -> None:
    (package / "__pycache__").write_text("a file where the folder would be")
    (package.parent.parent / "home").write_text("and here")
    assert outcome(started(package)) == "21 compiling"


def test_where_numba_finds_no_place_loops_are_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_cache(**options: bool) -> Callable[[Callable[[], int]], Callable[[], int]]:
        if options.pop("cache", False):
            raise RuntimeError("cannot cache function: no locator available")
        return njit(**options)  # type: ignore[no-any-return]

    monkeypatch.setattr(compiling, "njit", without_cache)
    assert compiling.kernel(lambda: 7)() == 7


def test_the_setting_of_numba_is_put_back() -> None:
    before = config.CACHE_DIR
    compiling.kernel(lambda: 7)
    assert before == config.CACHE_DIR


def test_the_folder_of_the_product_is_that_of_its_stamp() -> None:
    package = Path(compiling.__file__).parent
    assert cache_folder.stamp_of(package)
    assert (package / "__pycache__" / f"compiled-{cache_folder.stamp_of(package)}").is_dir()
