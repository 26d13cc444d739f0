"""The register maps that are shipped, one YAML file each; a user copies from them."""

from importlib import resources

import yaml

from drivers.codecs.register_map import RegisterMap, register_map


def shipped_maps() -> tuple[str, ...]:
    """Return the names of the maps that are shipped, in order."""
    names = (file.name for file in resources.files(__name__).iterdir())
    return tuple(sorted(name.removesuffix(".yaml") for name in names if name.endswith(".yaml")))


def shipped_map(name: str) -> RegisterMap:
    """Return a map that is shipped. Raises ValueError for any other name."""
    if name not in shipped_maps():
        raise ValueError(f"no map called {name} is shipped; expected one of {', '.join(shipped_maps())}")
    text = resources.files(__name__).joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    return register_map(yaml.safe_load(text))
