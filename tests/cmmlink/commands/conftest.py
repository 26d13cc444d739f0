"""The nominal that the tests of commands inspect against."""

from pathlib import Path

import pytest

from tests.cmmlink.oval_part import write_nominal


@pytest.fixture
def nominal(tmp_path: Path) -> Path:
    return write_nominal(tmp_path / "oval.yaml")
