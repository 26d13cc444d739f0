"""Every example runs and prints what it says that it prints."""

import io
import runpy
from contextlib import redirect_stdout
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples"
SCRIPTS = sorted([*EXAMPLES.glob("[0-9]*.py"), *EXAMPLES.glob("[0-9]*/*.py")])


def promised(script: Path) -> list[str]:
    """The lines that stand indented below `It prints:` in the docstring."""
    _, _, rest = script.read_text(encoding="utf-8").partition("It prints:\n\n")
    return [line.removeprefix("    ") for line in rest.partition('"""')[0].splitlines() if line.strip()]


def test_there_is_an_example_of_every_kind() -> None:
    assert [path.relative_to(EXAMPLES).parts[0][:2] for path in SCRIPTS] == ["01", "02", "03", "04", "05", "06"]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.relative_to(EXAMPLES).parts[0])
def test_an_example_prints_what_it_says(script: Path) -> None:
    with redirect_stdout(io.StringIO()) as out:
        runpy.run_path(str(script), run_name="__main__")
    assert promised(script)
    assert out.getvalue().splitlines() == promised(script)
