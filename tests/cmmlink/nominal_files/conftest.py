"""One process with Open CASCADE for all tests of nominal files, and files that it wrote."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cmmlink.nominal_files import solids
from drivers import CadError
from drivers.cad import OcctProcess

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def occt_process(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[OcctProcess]:
    with OcctProcess() as process:
        try:
            process.read(tmp_path_factory.mktemp("occt") / "none.step", "step", (0, 0, 0), (0, 0, 1))
        except CadError as error:
            if "is no STEP file" not in str(error):
                (pytest.fail if request.config.getoption("--require-cad") else pytest.skip)(str(error))
        yield process


@pytest.fixture
def occt(occt_process: OcctProcess, monkeypatch: pytest.MonkeyPatch) -> OcctProcess:
    """Let nominal files be read by that one process."""
    monkeypatch.setattr(solids, "read_cad", occt_process.read)
    return occt_process


@pytest.fixture(scope="session")
def cad_files(occt_process: OcctProcess, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of what occt_writer.py writes."""
    folder = tmp_path_factory.mktemp("cad")
    subprocess.run([sys.executable, "-m", "tests.cmmlink.nominal_files.occt_writer", folder], cwd=ROOT, check=True, capture_output=True)
    return folder
