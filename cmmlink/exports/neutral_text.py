"""Text on its way into the cells of a spreadsheet: whatever a name holds, it stays text there.

A cell that begins with =, + or -, with @, or with a tab or a line's end may be taken for a formula, and a formula may start programs and
send what stands beside it elsewhere. So a ' is set before it. Where a semicolon divides cells, as in half of Europe, a text may begin a
new one: there the same holds behind a semicolon.
"""

import re

from cmmlink.words import printable

MOST_LETTERS = 16_000  # a cell of a spreadsheet holds 32,767 units of UTF-16, and a sign may be two
_SIGNS = "=+@\uff1d\uff0b\uff20"  # the last three are their wide forms, which some versions take for the same
_MINUS = "\\-\uff0d"
_AT_START = re.compile(rf"^(?=\s*[{_SIGNS}{_MINUS}])")
_NEW_CELL = re.compile(rf"(;[\s\"']*)(?=[{_SIGNS}{_MINUS}])")  # quotes that the first cell began with count for nothing in a new one


def neutral(text: str) -> str:
    """The text as a cell holds it: on one line, nothing in it that steers anything, and never a formula."""
    line = printable(text.replace("\r\n", " ").replace("\n", " "))
    line = _NEW_CELL.sub(r"\1'", _AT_START.sub("'", line))
    return line if len(line) <= MOST_LETTERS else f"{line[: MOST_LETTERS - 3]}..."
