"""Which devices there are: every module of this package that says `DEVICES`. A new one needs no entry here."""

import importlib
from collections.abc import Mapping
from importlib import resources

from simulators.settings import Serve


def known_devices() -> Mapping[str, Serve]:
    """Return what serves a simulated device, by the name of the device.

    Raises OSError where the folder cannot be read, which `pkgutil.iter_modules` takes for an empty one.
    """
    found: dict[str, Serve] = {}
    for name in sorted(file.name for file in resources.files(__name__).iterdir()):
        if name.endswith(".py") and name != "__init__.py":
            found.update(importlib.import_module(f"{__name__}.{name.removesuffix('.py')}").DEVICES)
    return found
