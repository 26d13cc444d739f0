"""What the front door of the drivers gives, and what that does not load: a device's library is loaded where a device is opened."""

import subprocess
import sys
from pathlib import Path

import drivers
import drivers.surface

ROOT = Path(drivers.__file__).parents[1]


def loaded_by(statement: str) -> set[str]:
    """Return the top-level modules that are loaded after a statement, in a fresh interpreter."""
    program = f"{statement}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    said = subprocess.run([sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    return set(said.split())


def test_every_name_of_the_doors_is_there() -> None:
    for door in (drivers, drivers.surface):
        assert [name for name in door.__all__ if not hasattr(door, name)] == []
        assert len(door.__all__) == len(set(door.__all__))  # ruff keeps their order


def test_the_door_loads_no_library_of_devices_surfaces_or_pictures() -> None:
    heavy = {"serial", "pymodbus", "scipy", "open3d", "matplotlib", "numba"}
    assert loaded_by("from drivers import *") & heavy == set()
    assert loaded_by("import drivers.surface") & (heavy - {"scipy"}) == set()
    assert loaded_by("import drivers.links.axis, drivers.links.link_settings") & heavy == set()


def test_each_link_loads_its_own_library_alone() -> None:
    assert loaded_by("import drivers.links.serial_scanner") & {"serial", "pymodbus"} == {"serial"}
    assert "pymodbus" in loaded_by("import drivers.links.modbus_scanner")


def test_serial_ports_are_looked_for_only_when_asked() -> None:
    program = "import drivers.links.serial_scanner as s, sys; before = set(sys.modules); s.ports(); print(*set(sys.modules) - before)"
    said = subprocess.run([sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    assert "serial.tools.list_ports" in said.split()
