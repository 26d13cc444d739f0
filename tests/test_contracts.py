"""What the project promises to itself: exported names, layout, walls, and pages that say what is so."""

import ast
import contextlib
import importlib
import io
import re
import subprocess
import sys
import textwrap
import tomllib
from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import cmmlink
import inspection
from cmmlink.plan.own_maps import map_of
from cmmlink.plan.scan import load_plan
from cmmlink.plan.surface import load_ct_plan
from cmmlink.plan.whole_surface import load_surface_plan
from tests.cmmlink.command import cmmlink as cmmlink_command

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("inspection", "drivers", "simulators", "cmmlink")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))
PROMISED_NAMES = [
    "NurbsCurve",
    "NominalProfile",
    "Deviations",
    "Registration",
    "RigidTransform",
    "ToleranceZone",
    "Verdict",
    "LiveInspection",
    "discretize",
    "deviations",
    "register_coarse",
    "register_fine",
    "register",
    "fit_minimum_zone",
]
GRAB_BAGS = {"utils", "util", "helpers", "helper", "common", "base", "manager", "types", "misc", "core"}
LIBRARIES_IN_ONE_FILE = {
    "distributed": {"cmmlink/archive/cluster.py"},
    "dask": set(),
    "serial": {"drivers/links/serial_scanner.py"},
    "numba": {"inspection/kernels/compiling.py"},
    "ezdxf": {"cmmlink/nominal_files/dxf.py"},
    "OCP": {"drivers/cad/occt_reader.py", "drivers/cad/occt_faces.py"},
    "xlsxwriter": {"cmmlink/exports/workbook.py"},
}


def tracked() -> list[Path]:
    """Files that are kept, relative to the top; outside a checkout those that are there."""
    with contextlib.suppress(OSError, subprocess.CalledProcessError):
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        return [Path(line) for line in listed.splitlines()]
    return [path.relative_to(ROOT) for path in ROOT.rglob("*") if path.is_file() and ".venv" not in path.parts]


@cache
def imported_by(path: Path) -> set[str]:
    """Top-level names of the modules that a file imports anywhere in it."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    return {name.partition(".")[0] for name in names}


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_inspection_exports_what_is_promised() -> None:
    assert set(PROMISED_NAMES) <= set(inspection.__all__)
    assert all(callable(getattr(inspection, name)) for name in PROMISED_NAMES)


FRONT_DOORS = [path for path in SOURCES if path.name == "__init__.py" and "_PLACES" in path.read_text(encoding="utf-8")]


def test_the_packages_that_a_command_may_do_without_load_their_names_when_they_are_used() -> None:
    doors = {relative(path.parent) for path in FRONT_DOORS}
    ours = ("archive", "exports", "plan", "plant", "plant_push", "qualification", "record", "reference", "report")
    rooms = {"cmmlink", *(f"cmmlink/{room}" for room in ours)}
    inside = {"inspection", "inspection/kernels", "inspection/kernels/surfaces", "inspection/surface"}
    assert doors == rooms | inside | {"drivers"}


@pytest.mark.parametrize("door", FRONT_DOORS, ids=lambda path: relative(path.parent))
def test_a_front_door_gives_what_type_checkers_see(door: Path) -> None:
    package = ".".join(door.parent.relative_to(ROOT).parts)
    module = importlib.import_module(package)
    (checked,) = (node for node in ast.parse(door.read_text(encoding="utf-8")).body if isinstance(node, ast.If))
    seen = {
        alias.name: f"{package}.{alias.name}" if node.module == package else node.module  # the second is a file that is given whole
        for node in checked.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert {name: place for place, names in module._PLACES.items() for name in names} == seen
    assert sorted(module.__all__) == sorted(seen)
    assert [name for name in seen if not hasattr(module, name)] == []
    files = {path.stem for path in door.parent.iterdir()}  # an imported file hides what a front door gives by the same name
    assert {name for name, place in seen.items() if name in files and place != f"{package}.{name}"} == set()
    with pytest.raises(AttributeError, match="no attribute 'nothing_like_it'"):
        getattr(module, "nothing_like_it")  # noqa: B009 - type checkers know that it is not there


def test_the_three_libraries_import_none_of_ours() -> None:
    for package in ("inspection", "drivers", "simulators"):
        others = set(PACKAGES) - {package}
        assert {relative(path): found for path in sorted((ROOT / package).rglob("*.py")) if (found := imported_by(path) & others)} == {}


def test_only_the_command_line_knows_simulators() -> None:
    assert [relative(path) for path in SOURCES if not path.is_relative_to(ROOT / "simulators") and "simulators" in imported_by(path)] == [
        "cmmlink/commands/setup.py"
    ]


@pytest.mark.parametrize("library", LIBRARIES_IN_ONE_FILE)
def test_a_hard_library_is_imported_in_its_own_file_only(library: str) -> None:
    assert {relative(path) for path in SOURCES if library in imported_by(path)} <= LIBRARIES_IN_ONE_FILE[library]


def test_libraries_never_print_and_never_exit() -> None:
    for path in SOURCES:
        if path.is_relative_to(ROOT / "inspection") or path.is_relative_to(ROOT / "drivers"):
            names = {node.id for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Name)}
            assert not names & {"print", "exit", "quit", "SystemExit"}, relative(path)


def test_no_grab_bags() -> None:
    assert [relative(path) for path in SOURCES + TESTS if path.stem in GRAB_BAGS or path.parent.name in GRAB_BAGS] == []


def test_names_of_test_files_are_unique() -> None:
    names = Counter(path.name for path in TESTS if path.name.startswith("test_"))
    assert [name for name, count in names.items() if count > 1] == []


def test_the_top_level_holds_what_the_layout_says_and_nothing_else() -> None:
    top = {path.parts[0] for path in tracked() if not path.parts[0].startswith(".")}
    documents = {"README.md", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE"}
    assert top <= {"pyproject.toml", "constraints.txt", "Makefile", *documents, *PACKAGES, "tests", "docs"}
    assert top >= {"pyproject.toml", "Makefile", "LICENSE", *PACKAGES, "tests"}


# The letters that may stand beside ASCII: units and signs in messages and on pages, and the Greek of the maths.
LETTERS = set("µ°±×²³·−äöüÄÖÜßéèàπθφκαβγδεσω▲✓✕")


def test_sources_are_ascii_but_for_signs_of_units_and_maths() -> None:
    strange = {
        relative(path): found
        for path in SOURCES + TESTS
        if (found := {c for c in path.read_text(encoding="utf-8") if ord(c) > 127} - LETTERS)
    }
    assert strange == {}


def test_the_version_stands_in_one_place() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = settings["project"]
    assert project["dynamic"] == ["version"]
    assert settings["tool"]["hatch"]["version"]["path"] == "cmmlink/version.py"
    assert re.fullmatch(r"\d+\.\d+\.\d+", cmmlink.__version__)
    assert project["scripts"] == {"cmmlink": "cmmlink.__main__:main"}


def test_every_library_that_is_imported_is_declared() -> None:
    """A fresh installation has what is declared and nothing else."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    imports_of = {
        "PyYAML": "yaml",
        "pyserial": "serial",
        "open3d-cpu": "open3d",
        "libusb-package": "libusb_package",
        "cadquery-ocp-novtk": "OCP",
        "XlsxWriter": "xlsxwriter",
    }
    lines = project["dependencies"] + [
        line for extra in ("open3d", "cad", "cluster", "plant") for line in project["optional-dependencies"][extra]
    ]
    declared = {re.split(r"[<>=!~\[; ]", line, maxsplit=1)[0] for line in lines}
    known = {imports_of.get(name, name) for name in declared} | set(sys.stdlib_module_names) | set(PACKAGES)
    brought = {"pydantic_core": "pydantic", "llvmlite": "numba", "anyio": "starlette", "h11": "uvicorn"}  # which these cannot do without
    undeclared = {
        relative(path): found
        for path in SOURCES
        if (found := {name for name in imported_by(path) if name and brought.get(name, name) not in known})
    }
    assert undeclared == {}


@pytest.mark.parametrize(("file", "extras"), [("constraints.txt", ("cad", "open3d", "test", "bench")), (".ci/lowest.txt", ("test",))])
def test_the_versions_that_are_installed_lie_within_the_ranges_that_are_declared(file: str, extras: tuple[str, ...]) -> None:
    """`make upgrade` writes both files anew."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = settings["project"]
    lines = [*settings["build-system"]["requires"], *settings["dependency-groups"]["build"], *project["dependencies"]]
    lines += [line for extra in extras for line in project["optional-dependencies"][extra]]
    pinned = [Requirement(line) for line in (ROOT / file).read_text(encoding="utf-8").splitlines()]
    here = {one.name: str(one.specifier).removeprefix("==") for one in pinned if one.marker is None or one.marker.evaluate()}
    wanted = [one for one in map(Requirement, lines) if one.marker is None or one.marker.evaluate()]
    assert [str(one) for one in wanted if not one.specifier.contains(here[canonicalize_name(one.name)], prereleases=True)] == []


PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
WALKED = ROOT / "docs" / "add-a-device.md"  # its Python files are added to a copy of the tree by a test of their own


def blocks(language: str, pages: Sequence[Path] = PAGES) -> list[tuple[str, str]]:
    """The blocks of a language in the pages, each with the name of its page; those in lists are indented."""
    pattern = re.compile(rf"^( *)```{language}\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
    return [(relative(page), textwrap.dedent(text)) for page in pages for _, text in pattern.findall(page.read_text(encoding="utf-8"))]


def test_the_readme_has_examples_of_every_kind() -> None:
    assert all(blocks(language, [ROOT / "README.md"]) for language in ("python", "yaml", "sh"))


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_the_links_of_a_page_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\(([^)\s#]+)[^)]*\)", page.read_text(encoding="utf-8"))
    assert [target for target in targets if not target.startswith("https://") and not (page.parent / target).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_the_files_that_a_page_names_are_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    made = set(re.findall(r"^`(\S+\.py)`$", text, re.MULTILINE)) if page == WALKED else set()
    named = set(re.findall(rf"(?:\b|`)((?:{'|'.join([*PACKAGES, 'tests', 'docs'])})/[\w./-]*\w)", text))
    assert sorted(name for name in named - made if not (ROOT / name).exists()) == []


@pytest.mark.parametrize(("page", "text"), blocks("yaml"))
def test_the_plans_and_maps_of_a_page_can_be_read(page: str, text: str, tmp_path: Path) -> None:
    file = tmp_path / "given.yaml"
    file.write_text(text, encoding="utf-8")
    if text.startswith("device: {"):  # one device a line, as it would stand in a plan
        for device in re.split(r"^(?=device:)", text, flags=re.MULTILINE)[1:]:
            file.write_text(f"part: {{name: a}}\nnominal: {{file: b}}\ntolerance: {{lower_mm: 0, upper_mm: 1}}\n{device}", encoding="utf-8")
            load_plan(file)
    elif text.startswith("device:"):
        map_of(file)
    elif "\nmesh:" in text:
        load_ct_plan(file)
    elif "\nsurface:" in text:
        load_surface_plan(file)
    else:
        load_plan(file)


def test_pages_call_commands_that_exist_with_options_they_have() -> None:
    text = "".join(text for _, text in blocks("sh"))
    calls = re.findall(r"\bcmmlink ((?:(?:plan|plant|study) )?[a-z]+) ?([^`#\n]*)", text)
    assert {"run", "inspect", "ct", "replay"} <= {command for command, _ in calls}
    for command in {command for command, _ in calls}:
        described = cmmlink_command(*command.split(), "--help")
        assert described.code == 0, command
        used = {option for other, arguments in calls if other == command for option in re.findall(r"--[a-z-]+", arguments)}
        assert [option for option in used if option not in described.out] == [], command


@pytest.mark.parametrize(("page", "text"), blocks("python", [page for page in PAGES if page != WALKED]))
def test_the_python_of_a_page_prints_what_it_says(page: str, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a block prints stands in it as comments: behind `print(...)`, or in lines of their own after it."""
    monkeypatch.chdir(ROOT)
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(text, page, "exec"), {"__name__": "page"})
    said = [line.partition("# ")[2].strip() for line in text.splitlines() if "print(" in line or line.startswith("# ")]
    assert [line.strip() for line in out.getvalue().splitlines()] == [line for line in said if line]
