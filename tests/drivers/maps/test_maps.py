from pathlib import Path

import pytest
import yaml

import drivers.maps
from drivers.codecs.register_map import register_map
from drivers.maps import shipped_map, shipped_maps

PATTERNS = {"generic-fifo": "fifo", "generic-ring": "ring", "gocator": "queue", "riftek-rf60x": "latest"}


def test_every_file_of_the_folder_is_a_map_that_is_shipped() -> None:
    assert shipped_maps() == tuple(sorted(file.stem for file in Path(drivers.maps.__file__).parent.glob("*.yaml")))
    assert {name: shipped_map(name).pattern for name in PATTERNS} == PATTERNS
    assert set(PATTERNS) <= set(shipped_maps())


@pytest.mark.parametrize("name", shipped_maps())
def test_a_shipped_map_says_its_device_and_reads_back_as_the_same_map(name: str) -> None:
    shipped = shipped_map(name)
    assert shipped.device
    kept = yaml.safe_load(yaml.safe_dump(shipped.model_dump(mode="json")))
    assert register_map(kept) == shipped
    assert register_map(kept).model_dump() == shipped.model_dump()


def test_another_name_lists_what_is_shipped() -> None:
    with pytest.raises(ValueError, match="no map called mine is shipped; expected one of generic-fifo, generic-ring, gocator"):
        shipped_map("mine")
