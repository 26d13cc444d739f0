"""Register maps as plans name them: one that is shipped, a file of the user's own, or the content that a record keeps.

A file is read as plans are, with the same messages; what a map means is the model's business in `drivers`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cmmlink.errors import PlanError, YamlError
from cmmlink.plan.yaml_model import read_model
from drivers import PointFileError, RegisterMap, read_text, register_map, shipped_map, shipped_maps


def map_of(map_: str | Path | Mapping[str, Any]) -> RegisterMap:
    """Return a device's map. Raises PlanError naming file, line, key, what was found and what is expected.

    A name as text that is shipped is always the shipped map, whatever else bears that name; a `Path` is always a file.
    """
    if isinstance(map_, Mapping):
        return register_map(map_)
    if isinstance(map_, str) and map_ in shipped_maps():
        return shipped_map(map_)
    try:
        return read_model(read_text(Path(map_)), RegisterMap)
    except YamlError as error:
        raise PlanError(f"{map_}: {error}") from None
    except PointFileError as error:
        raise PlanError(f"{error}; give a YAML file or one of {', '.join(shipped_maps())}") from None
