"""One process with Open3D for all tests of surfaces."""

from collections.abc import Iterator

import pytest

from drivers.surface.open3d_process import Open3DProcess


@pytest.fixture(scope="session")
def open3d(request: pytest.FixtureRequest) -> Iterator[Open3DProcess]:
    with Open3DProcess() as process:
        if process.status().version is None:
            if request.config.getoption("--require-open3d"):
                pytest.fail(process.status().sentence())
            pytest.skip(process.status().sentence())
        yield process
