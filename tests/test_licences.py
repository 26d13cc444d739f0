"""What an installation brings, and under which licences: docs/licences.md against the metadata of what is installed.

Markers of systems and Python versions are left out of account, so that what only Windows or macOS needs is listed as well.
"""

import importlib.metadata
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
COPYLEFT = re.compile(r"\b[AL]?GPL|General Public Licen[cs]e|\bEUPL|\bSSPL|\bCC-BY-(SA|NC)", re.IGNORECASE)
# What a page may say of a licence, for what the metadata of distributions say of it.
FAMILIES = {
    "MIT": r"\bMIT\b|Expat",
    "BSD": r"\bBSD\b|\b0BSD\b",
    "Apache-2.0": r"\bApache",
    "ISC": r"\bISC\b",
    "PSF-2.0": r"\bPSF|Python Software Foundation",
    "MPL-2.0": r"\bMPL|Mozilla Public",
    "Zlib": r"\bZlib\b",
    "CC0-1.0": r"\bCC0",
    "LGPL-3.0-only": r"\bLGPL-3",
}


def rows(heading: str) -> dict[str, str]:
    """The table under a heading: what is named in its first column, and its second."""
    section = re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
    assert section is not None, heading
    return dict(re.findall(r"^\| `([^`]+)` \| ([^|]+?) \|", section[1], re.MULTILINE))


PLAIN, INSIDE = rows("A plain installation"), rows("Inside the wheels")
OPEN3D, CAD, CLUSTER, PLANT = (rows(f"The extra `{name}`") for name in ("open3d", "cad", "cluster", "plant"))


def found(name: str) -> importlib.metadata.Distribution | None:
    try:
        return importlib.metadata.distribution(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def brought_by(lines: Iterable[str]) -> set[str]:
    """Everything that requirements bring, on whatever system, as far as it is installed here or named by what is."""
    waiting, seen = [(Requirement(line), "") for line in lines], set[tuple[str, str]]()
    while waiting:
        requirement, wanted = waiting.pop()
        name = canonicalize_name(requirement.name)
        marker = requirement.marker
        if marker is not None and "extra" in str(marker) and not any(marker.evaluate({"extra": extra}) for extra in (wanted, "")):
            continue
        for extra in {"", *requirement.extras}:
            if (name, extra) not in seen:
                seen.add((name, extra))
                distribution = found(name)
                waiting += [(Requirement(line), extra) for line in (distribution.requires or () if distribution else ())]
    return {name for name, _ in seen}


def told_by(name: str) -> str:
    """What the metadata of a distribution say of its licence, empty where it is not installed here."""
    distribution = found(name)
    if distribution is None:
        return ""
    metadata = distribution.metadata
    classifiers = [text for text in metadata.get_all("Classifier") or () if text.startswith("License ::")]
    words = [text for key in ("License-Expression", "License") for text in metadata.get_all(key) or () if len(text) < 60]
    return " ".join([*words, *classifiers])


def pinned() -> set[str]:
    """Names of the libraries that constraints.txt knows."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return {canonicalize_name(line.partition("==")[0]) for line in lines if "==" in line}


def libraries_inside(names: Iterable[str]) -> Iterator[str]:
    """Shared libraries that wheels bring in folders of their own (Linux), without versions."""
    for name in names:
        distribution = found(name)
        for file in (distribution.files or ()) if distribution else ():
            if file.parts[0].endswith(".libs") or file.name.startswith("libusb-1.0"):
                yield re.sub(r"^libTK.*", "libTK*", re.split(r"[-.]", file.name.replace("libusb-1.0", "libusb"))[0])


@pytest.fixture(autouse=True, scope="module")
def _installed_as_pinned() -> None:
    """Other versions may say other things of themselves: what is listed is what `constraints.txt` installs."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    versions = {str(canonicalize_name(line.partition("==")[0])): line for line in lines if "==" in line and ";" not in line}
    known = [name for name in PLAIN if name in versions and found(name) is not None]
    other = [name for name in known if not Requirement(versions[name]).specifier.contains(importlib.metadata.version(name))]
    if len(other) > len(known) // 4:
        pytest.skip("this environment was not installed by constraints.txt")


def test_everything_that_a_plain_installation_brings_is_listed() -> None:
    """What is pinned for some system only is listed too; what no version for any supported system needs is not."""
    assert brought_by(PROJECT["dependencies"]) & pinned() == set(PLAIN)


def test_everything_that_the_extras_bring_is_listed() -> None:
    assert set(PROJECT["optional-dependencies"]) == {"all", "cad", "cluster", "open3d", "plant", "test", "bench"}, (
        "a new extra needs a table of its own"
    )
    if found("cadquery-ocp-novtk") is not None:
        assert brought_by(PROJECT["optional-dependencies"]["cad"]) & pinned() - set(PLAIN) == set(CAD)
    if found("distributed") is not None:
        assert brought_by(PROJECT["optional-dependencies"]["cluster"]) & pinned() - set(PLAIN) == set(CLUSTER)
    if found("sqlalchemy") is not None:
        assert brought_by(PROJECT["optional-dependencies"]["plant"]) & pinned() - set(PLAIN) == set(PLANT)
    if found("open3d") is None and found("open3d-cpu") is None:
        pytest.skip("Open3D is not installed here")
    assert brought_by(PROJECT["optional-dependencies"]["open3d"]) & pinned() - set(PLAIN) == set(OPEN3D)


@pytest.mark.parametrize("name", sorted({**PLAIN, **OPEN3D, **CAD, **CLUSTER, **PLANT}))
def test_the_licence_that_is_listed_is_the_one_that_is_told(name: str) -> None:
    told, listed = told_by(name), {**PLAIN, **OPEN3D, **CAD, **CLUSTER, **PLANT}[name]
    if not told:
        assert found(name) is None, f"{name} says nothing of its licence"
        return
    families = {family for family, words in FAMILIES.items() if re.search(words, told, re.IGNORECASE)}
    assert families, f"{name} has a licence of another kind: {told}"
    assert all(re.search(FAMILIES[family], listed, re.IGNORECASE) for family in families), (listed, told)


def test_a_plain_installation_brings_no_library_under_the_gpl_or_its_kind() -> None:
    assert {
        name: told for name in brought_by(PROJECT["dependencies"]) if COPYLEFT.search(told := f"{told_by(name)} {PLAIN.get(name)}")
    } == {}


def test_what_is_shipped_with_an_extra_and_is_copyleft_is_under_the_lesser_gpl_alone_and_named() -> None:
    extras = {**OPEN3D, **CAD, **CLUSTER, **PLANT}
    told = {name: found for name, listed in extras.items() if COPYLEFT.search(found := f"{told_by(name)} {listed}")}
    assert set(told) == {"psycopg", "psycopg-binary"}
    assert all("LGPL-3.0-only" in words for words in told.values())


def test_shared_libraries_inside_the_wheels_are_listed_and_what_is_copyleft_is_named() -> None:
    inside = set(libraries_inside([*PLAIN, *OPEN3D, *CAD, *CLUSTER, *PLANT]))
    assert inside - set(INSIDE) == set()
    assert {name for name, licence in INSIDE.items() if COPYLEFT.search(licence)} == {
        "libTK*",
        "libcrypt",
        "libgfortran",
        "libgomp",
        "libkeyutils",
        "libquadmath",
        "libusb",
    }
    assert "GCC exception" in INSIDE["libgfortran"], "without the exception a plain installation would bring the GPL"
