"""Docstrings as the API reference shows them."""

import runpy
from pathlib import Path

API = runpy.run_path(str(Path(__file__).resolve().parents[2] / "docs" / "api.py"))

GIVEN = """Find the pose.

    pose = register(points)

points, more : (m, 2) in mm,
               in the order of the scan
nominal      : the profile
The rest is text: nothing else."""

SHOWN = """Find the pose.

    pose = register(points)


- `points, more`: (m, 2) in mm,
  in the order of the scan
- `nominal`: the profile

The rest is text: nothing else."""


def test_arguments_become_a_list_and_text_stays_text() -> None:
    assert API["markdown_of"](GIVEN) == SHOWN


def test_the_reference_covers_every_package() -> None:
    root = Path(__file__).resolve().parents[2]
    assert sorted(API["PACKAGES"]) == sorted(path.parent.name for path in root.glob("*/__init__.py"))
