"""Compiled code: nothing stale is loaded, whatever file changed; several processes at once; folders that cannot be written."""

import ast
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import njit, types
from numba.core import config
from numpy.typing import NDArray

from inspection.kernels import PoseFit, cache_folder, compiling, pose
from tests.inspection import profiles

Array = NDArray[Any]

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


def test_a_package_within_the_package_has_a_folder_of_its_own_and_sees_edits_of_both(package: Path) -> None:
    within = package / "within"
    within.mkdir()
    (within / "__init__.py").touch()
    deeper = OUTER.replace("def outer", "def deeper")
    (within / "deeper.py").write_text(deeper, encoding="utf-8")
    call = CALL + CALL.replace("kernels.outer import outer", "kernels.within.deeper import deeper").replace("outer(2)", "deeper(2)")
    assert outcome(started(package, call)).splitlines() == ["21 compiling", "21 compiling"]
    (within / "deeper.py").write_text(deeper.replace("+ 1", "+ 2"), encoding="utf-8")
    assert outcome(started(package, call)).splitlines() == ["21", "22 compiling"]  # the code of the package around it is still there
    (package / "inner.py").write_text(INNER.format(30), encoding="utf-8")
    assert outcome(started(package, call)).splitlines() == ["61 compiling", "62 compiling"]


def test_processes_that_start_at_once_all_have_their_result(package: Path) -> None:
    processes = [started(package) for _ in range(2)]
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
    def keep_nothing(function: Callable[[], int]) -> object:
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(compiling, "_KeptCode", keep_nothing)
    assert compiling.kernel(lambda: 7)() == 7


def test_the_setting_of_numba_is_put_back() -> None:
    before = config.CACHE_DIR
    compiling.kernel(lambda: 7)
    assert before == config.CACHE_DIR


def test_the_folder_of_the_product_is_that_of_its_stamp() -> None:
    package = Path(compiling.__file__).parent
    assert cache_folder.stamp_of(package)
    assert (package / "__pycache__" / f"compiled-{cache_folder.stamp_of(package)}").is_dir()


def test_code_called_by_its_place_gets_its_arguments_as_their_types_and_its_errors_come_back() -> None:
    wanted = (types.float64, compiling.REAL_TABLE, compiling.INTEGER_ARRAY)
    call = compiling.call_of(*wanted)

    def scale(factor: float, table: Array, out: Array) -> None:
        if factor < 0.0:
            raise ValueError("a negative factor")
        for i in range(len(table)):
            out[i] = factor * table[i]

    def use(place: int, factor: int, table: Array, out: Array) -> None:
        call(place, (factor, table, out))

    place, out, compiled = compiling.code_of(njit(scale), *wanted), np.zeros(3, dtype=np.int64), njit(use)
    table = np.array([1.0, 2.0, 3.5])  # that can be written to, and the factor is a whole number: both are converted
    compiled(place, 2, table, out)
    assert out.tolist() == [2, 4, 7]
    with pytest.raises(ValueError, match="a negative factor"):
        compiled(place, -2, table, out)


WIDE = """
import sys
from llvmlite import binding
from numba import config
config.CPU_NAME, config.CPU_FEATURES = sys.argv[1], ""
from numba import njit
from inspection.kernels.compiling import array_at, stack_reals

def scaled(table, factor):
    values = array_at(stack_reals(), 256)
    for i in range(256):
        values[i] = factor * table[i] + 1.0
    for i in range(256):
        table[i] = values[i] * values[i]

compiled = njit(scaled)
compiled.compile("void(float64[::1], float64)")
print(compiled.inspect_asm(compiled.signatures[0]).count("zmm"))
"""


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="another processor has other vectors")
@pytest.mark.parametrize(("processor", "is_wide"), [("skylake-avx512", True), ("haswell", False)])
def test_loops_over_a_block_use_vectors_as_wide_as_the_processor_has(processor: str, is_wide: bool) -> None:
    root = Path(compiling.__file__).parents[2]
    told = subprocess.run([sys.executable, "-c", WIDE, processor], capture_output=True, text=True, cwd=root, check=True, timeout=120)
    assert (int(told.stdout) > 0) == is_wide, "by itself the compiler takes half of them for the first"


def test_one_compiled_fit_serves_all_methods() -> None:
    nominal = profiles.nominal_of("P3", 500)
    points = nominal.points_mm + 0.01
    compiled = []
    for method in ("exact", "pcp", "circle"):
        PoseFit(points, nominal.grid, nominal.table_for(method), method, nominal.outward, 0.0).settle((0.0, 0.0, 0.0), 5)
        compiled.append(len(pose._settle_pose.signatures))  # type: ignore[attr-defined]  # numba has no types
    assert compiled[0] == compiled[1] == compiled[2]


def kernels_in(path: Path, *kinds: str) -> set[str]:
    """The functions of a file that are decorated with one of these names."""
    functions = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.FunctionDef)]
    return {f.name for f in functions if any(isinstance(node, ast.Name) and node.id in kinds for node in f.decorator_list)}


@pytest.mark.parametrize("path", sorted(Path(compiling.__file__).parent.glob("*.py")), ids=lambda path: path.stem)
def test_python_calls_no_kernel_that_is_there_for_other_kernels_alone(path: Path) -> None:
    # such a kernel has no way in from Python: a call ends the process
    tree = ast.parse(path.read_text(encoding="utf-8"))
    inner = kernels_in(path, "inner_kernel", "inlined_kernel")
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("inspection.kernels."):
            there = path.with_name(f"{(node.module or '').rpartition('.')[2]}.py")
            inner |= kernels_in(there, "inner_kernel", "inlined_kernel") & {name.name for name in node.names}
    kernels = kernels_in(path, "kernel", "brief_kernel", "inner_kernel", "inlined_kernel")
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name not in kernels):
        called = {node.func.id for node in ast.walk(function) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
        assert not called & inner, function.name


def test_code_on_disk_is_loaded_without_what_compiles(package: Path) -> None:
    compiler = 'import sys; print(*(name in sys.modules for name in ("numba.np.arraymath", "numba.cpython.unicode", "scipy.linalg")))'
    assert outcome(started(package, CALL + compiler)).startswith("21 compiling\nTrue True")
    assert outcome(started(package, CALL + compiler)) == "21\nFalse False False"
