"""What a simulated device is told, from Python or from a command line, and how its parent process hears of it."""

import argparse
import importlib
import pkgutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .faults import CATALOGUE, Fault
from .motion import Motion, read_path


@dataclass(frozen=True, slots=True)
class SimulatorSettings:
    """What a simulated device is told.

    address    `pty` or `host:port`; port 0 takes any free one
    path_mm    (k, 2) or (k, 3) points of the path on the part
    paced      take points when they are due by `motion.rate_hz`; otherwise as fast as the client fetches them
    """

    address: str
    path_mm: NDArray[np.float64]
    motion: Motion
    faults: tuple[Fault, ...] = ()
    paced: bool = True


Announce = Callable[[str], None]
Serve = Callable[[SimulatorSettings, Announce], None]


def devices() -> Mapping[str, Serve]:
    """Return every simulated device: the modules of this package that say `DEVICES`."""
    package = __package__ or "simulators"
    found: dict[str, Serve] = {}
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        if module.name != "__main__":
            found.update(getattr(importlib.import_module(f"{package}.{module.name}"), "DEVICES", {}))
    return found


def settings_from(arguments: Sequence[str]) -> SimulatorSettings:
    """Read the settings from command-line arguments."""
    parser = argparse.ArgumentParser(description="A simulated device; faults: " + ", ".join(CATALOGUE))
    parser.add_argument("--address", required=True, help="pty or host:port")
    parser.add_argument("--path", required=True, type=Path, help="points of the path on the part, mm")
    parser.add_argument("--fault", action="append", default=[], metavar="NAME[:VALUE][@POINT]")
    parser.add_argument("--unpaced", action="store_true", help="as fast as the client takes the points")
    parser.add_argument("--rate", dest="rate_hz", type=float, default=1000.0, help="points per second")
    parser.add_argument("--speed", dest="speed_mm_s", type=float, default=50.0, help="mm per second along the path")
    parser.add_argument("--open", dest="closed", action="store_false", help="the path is open")
    parser.add_argument("--backward", action="store_true")
    for name, kind in (("count", int), ("seed", int), ("form_error_mm", float), ("noise_mm", float), ("tip_radius_mm", float)):
        parser.add_argument("--" + name.replace("_", "-"), type=kind)
    for name in ("defect_mm", "defect_station_mm", "rotation_deg", "start_mm"):
        parser.add_argument("--" + name.replace("_", "-"), type=float)
    parser.add_argument("--translation-mm", type=float, nargs=3)
    given = {name: value for name, value in vars(parser.parse_args(arguments)).items() if value is not None}
    if "translation_mm" in given:
        given["translation_mm"] = tuple(given["translation_mm"])
    try:
        motion = Motion(**{field.name: given[field.name] for field in fields(Motion) if field.name in given})
        faults = tuple(Fault.parse(text) for text in given["fault"])
        return SimulatorSettings(given["address"], read_path(given["path"]), motion, faults, not given["unpaced"])
    except (ValueError, OSError) as error:
        parser.error(str(error))


def say(text: str) -> None:
    """Write one line for the parent process to read at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
