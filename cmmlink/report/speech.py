"""The language of a report: its words, from one catalogue a language, and the way numbers are written in it.

A catalogue is a gettext file (.po) beside this one, whose keys are the English texts. A text with places in braces also translates the
sentences that the inspection made of it, with what stood in those places.
"""

import ast
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from cmmlink.plan import LanguageName

_FOLDER = Path(__file__).parent
_PLACE = re.compile(r"\\{(\w+)\\}")
_NAMED = re.compile(r"\{\w+\}")
_OF_FILE = re.compile(r"([^:]*\.\w+): (.+)")  # a note that begins with the name of the file that it is about
_NO_NUMBER = "\u2013"


class Speech:
    """Speaks one language."""

    def __init__(self, language: LanguageName = "en") -> None:
        self.language = language
        self._catalogue = {} if language == "en" else read_catalogue(_FOLDER / f"{language}.po")
        told_most = sorted(self._catalogue, key=lambda text: -len(_NAMED.sub("", text)))  # a name at its beginning makes no other sentence
        self._patterns = [(pattern_of(text), self._catalogue[text]) for text in told_most if "{" in text]

    def __call__(self, text: str, /, **values: object) -> str:
        """A text of ours in this language, with the values in their places; in English where the catalogue does not have it."""
        said = self._catalogue.get(text) or text
        return said.format(**values) if values else said

    def sentence(self, told: str) -> str:
        """A sentence that another part of the program made, in this language as far as the catalogue knows of what it was made."""
        if told in self._catalogue:
            return self._catalogue[told]
        for pattern, said in self._patterns:
            if found := pattern.fullmatch(told):
                return said.format(**{name: self._part(name, value) for name, value in found.groupdict().items()})
        of_file = _OF_FILE.fullmatch(told)
        return told if of_file is None else f"{of_file[1]}: {self.sentence(of_file[2])}"

    def _part(self, name: str, told: str) -> str:
        """What stood in a place of a sentence. A direction is words with numbers in them; else it is one text, or a name and numbers."""
        said = self.sentence(told) if name == "direction" else self._catalogue.get(told)
        return self.figures(told) if said is None or said == told else said

    def number(self, value: float | None, form: str = ".4f") -> str:
        """A number as people of this language read it; a dash where there is none."""
        if value is None:
            return _NO_NUMBER
        written = format(value, form)
        return self.figures(written if any(sign in written for sign in "123456789") else format(0.0, form))  # never -0.0000

    def figures(self, written: str) -> str:
        """The figures of a written number as people of this language read them."""
        return re.sub(r"(?<=\d)\.(?=\d)", ",", written) if self.language == "de" else written

    def texts(self) -> Mapping[str, str]:
        """Everything that the catalogue holds; nothing for English."""
        return dict(self._catalogue)


@cache
def read_catalogue(path: Path) -> Mapping[str, str]:
    """The texts of a gettext catalogue with their translations."""
    found: dict[str, str] = {}
    entry = {"msgid": "", "msgstr": ""}
    key = "msgid"
    for line in [*path.read_text(encoding="utf-8").splitlines(), 'msgid ""']:
        word, _, quoted = line.partition(" ") if line.startswith("msg") else (key, "", line)
        if word == "msgid" and quoted is not line:
            found[entry["msgid"]] = entry["msgstr"]
            entry = {"msgid": "", "msgstr": ""}
        key = word
        if quoted.startswith('"'):
            entry[key] += ast.literal_eval(quoted)
    found.pop("", None)  # what the catalogue says of itself
    return found


def pattern_of(text: str) -> re.Pattern[str]:
    """What finds the sentences that were made of a text with places in braces."""
    return re.compile(_PLACE.sub(r"(?P<\1>.+?)", re.escape(text)))
