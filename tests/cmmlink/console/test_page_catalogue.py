"""What the station tells the page: the page's catalogues have it in every language, and they hold nothing that nobody tells."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CONSOLE = ROOT / "cmmlink" / "console"
LANGUAGES = sorted(path.stem for path in CONSOLE.glob("*.po"))
TOLD = re.compile(r'^#\. told by the program\nmsgid (".*")(?:\nmsgid_plural (".*"))?$', re.MULTILINE)
PLACE = re.compile(r"\{[^{}]*\}")
BETWEEN = re.compile(r"\{[^{}]*\}|[;:,] | and | when |^check ")  # what messages are put together of may stand apart in the source


def text_of(node: ast.expr) -> str | None:
    """A text that stands in the source, with {} where a value comes in; None where it comes from elsewhere."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return None


def told_to_operators() -> Iterator[str]:
    """Every refusal, and every alarm's title and detail, that stands as a text in the console."""
    for path in sorted(CONSOLE.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
            arguments = node.args[:1] if name == "Refused" else node.args[1:3] if name == "raise_alarm" else []
            yield from (text for argument in arguments if (text := text_of(argument)) is not None and re.search("[a-z]{2}", text))


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_refusal_and_alarm_is_in_the_catalogue(language: str) -> None:
    catalogue = json.loads((CONSOLE / "static" / f"{language}.json").read_text(encoding="utf-8"))
    known = {PLACE.sub("{}", text) for text in catalogue}
    pieces = {piece for text in known for piece in text.split("; ")}
    told = set(told_to_operators())
    assert len(told) > 20, "the refusals and alarms were not found"
    assert {
        text for text in told if text not in known and not all(piece in known | pieces | {"{}"} for piece in re.split("; |: ", text))
    } == set()


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_catalogue_holds_nothing_that_nobody_tells(language: str) -> None:
    """Every text said to be told by the program stands in its source, in the order of its fixed words."""
    sources = "\n".join(
        re.sub(r'["\']\s*\n\s*f?["\']', "", path.read_text(encoding="utf-8"))  # a text that is written in pieces
        for room in ("cmmlink", "drivers", "inspection")
        for path in sorted((ROOT / room).rglob("*.py"))
    ).casefold()
    texts = [
        json.loads(one)
        for found in TOLD.finditer((CONSOLE / f"{language}.po").read_text(encoding="utf-8"))
        for one in found.groups()
        if one
    ]
    assert len(texts) > 100
    words = {text: [part.strip(" '.") for part in BETWEEN.split(text)] for text in texts}
    assert [text for text, parts in words.items() if not all(part.casefold() in sources for part in parts)] == []
