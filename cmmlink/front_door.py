"""Front doors that load a file when a name of it is first used, so that a command loads only what it works with (PEP 562)."""

import sys
from collections.abc import Callable
from importlib import import_module


def load_on_use(package: str, places: dict[str, tuple[str, ...]]) -> Callable[[str], object]:
    """The `__getattr__` of a package whose names are found in other files; a name that was used once stays at the door.

    places : the names by the file that has them; a file that is given whole is named like its own name
    """
    place_of = {name: place for place, names in places.items() for name in names}

    def load(name: str) -> object:
        if name not in place_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        place = place_of[name]
        file = import_module(place)
        found = file if place == f"{package}.{name}" else getattr(file, name)
        setattr(sys.modules[package], name, found)
        return found

    return load
