"""Which devices there are: every module of this package that says `DEVICES`. A new one needs no entry here."""

import importlib
import pkgutil
from collections.abc import Mapping

from simulators.settings import Serve


def known_devices() -> Mapping[str, Serve]:
    """Return what serves a simulated device, by the name of the device."""
    found: dict[str, Serve] = {}
    for module in pkgutil.iter_modules(__path__):
        found.update(importlib.import_module(f"{__name__}.{module.name}").DEVICES)
    return found
