"""The page on adding a device, walked: its files are added to a copy of the tree, and pass their tests and the checks there."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "add-a-device.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^`(\S+\.py)`\n\n```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
COPIED = ("drivers", "simulators", "tests")


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what the page adds files to; the rest stays where it is, or the inspection would be compiled anew."""
    tree = tmp_path_factory.mktemp("tree")
    for name in COPIED:
        shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("node_modules", "corpus"))
    shutil.copy(ROOT / "pyproject.toml", tree)
    for name, text in FILES.items():
        assert not (tree / name).exists()
        (tree / name).write_text(text, encoding="utf-8")
    return tree


def ended(tree: Path, *arguments: str) -> tuple[int, str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tree), str(ROOT)])}
    command = [sys.executable, "-m", *arguments]
    done = subprocess.run(command, cwd=tree, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return done.returncode, done.stdout


def test_the_page_has_the_four_files() -> None:
    assert [Path(name).parts[:-1] for name in FILES] == [
        ("drivers", "codecs"),
        ("simulators", "devices"),
        ("tests", "drivers", "codecs"),
        ("tests", "integration"),
    ]


def test_the_files_of_the_page_pass_their_tests(tree: Path) -> None:
    code, said = ended(tree, "pytest", "-q", "-p", "no:cacheprovider", *(name for name in FILES if name.startswith("tests")))
    assert code == 0, said
    assert re.search(r"\b7 passed", said), said


@pytest.mark.parametrize("check", [("check",), ("format", "--check")])
def test_the_files_of_the_page_pass_the_checks(tree: Path, check: tuple[str, ...]) -> None:
    code, said = ended(tree, "ruff", *check, "--no-cache", *FILES)
    assert code == 0, said
