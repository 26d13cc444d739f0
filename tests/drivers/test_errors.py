"""The tree of errors, and that it is the whole of what the drivers raise of their own."""

import ast
from pathlib import Path

import pytest

import drivers
from drivers import errors

ROOT = Path(errors.__file__).parent
OURS = {name for name, found in vars(errors).items() if isinstance(found, type) and issubclass(found, Exception)}


@pytest.mark.parametrize("error", [errors.LinkError, errors.ProtocolError, errors.DeviceRefused])
def test_whatever_a_device_does_is_caught_as_one_error(error: type[Exception]) -> None:
    assert issubclass(error, errors.DeviceError)
    assert not issubclass(error, ValueError)  # which is a mistake of whoever asks


def test_a_file_that_cannot_be_used_is_a_mistake_of_whoever_names_it() -> None:
    assert issubclass(errors.PointFileError, ValueError)
    assert issubclass(errors.MeshError, ValueError)


def test_every_error_is_at_the_front_door() -> None:
    assert set(drivers.__all__) >= OURS


def test_no_other_error_is_raised() -> None:
    raised = {
        (path.name, node.exc.func.id)
        for path in ROOT.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name)
    }
    others = {(file, error) for file, error in raised if error not in OURS | {"ValueError", "NotImplementedError", "PydanticCustomError"}}
    of_the_system = {  # links name them
        *(("tcp_line.py", error) for error in ("OSError", "ConnectionResetError", "TimeoutError")),
        *(("growing_file.py", error) for error in ("OSError", "NotADirectoryError")),
        *(("listener.py", error) for error in ("InterruptedError", "TimeoutError")),
    }
    of_python = {("__init__.py", "AttributeError")}  # what a module says of a name that it does not have
    assert others == {("open3d_process.py", "Open3DMissing"), ("helper_process.py", "ChildProcessError")} | of_the_system | of_python
