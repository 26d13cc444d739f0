"""What stands in a table in place of a number: words for nothing, and the error values of spreadsheets and of old runtimes."""

import re

_WORDS = (
    "null|none|nil|n[./]?\\s?a\\.?|void|undef(?:ined)?|invalid|missing|err(?:or)?|fehler|ung\u00fcltig|ovr|ovf|over(?:flow|range)|"
    "out of range"
)
_NO_NUMBER = re.compile(rf"|-+|\*+|\?+|\.+|[+-]?nan(?:\(\w*\))?|{_WORDS}", re.IGNORECASE)
# #N/A, #NV and the like for no value; #VALUE!, #WERT!, #NAME? and their like in every language; 1.#QNAN of old C libraries. The sign
# `#` may else begin a remark, so only what stands for a whole field is one of them.
_ERROR_VALUE = re.compile(
    r"(?<![^\s;,|\"])(?:#(?:N/?A|NV|N/D|\u041d/\u0414)!?|#[\u00a1\u00bf]?(?:DIV/0|[^\W\d_]{2,})[!?]|[+-]?1[.,]#(?:[QS]NAN|IND|INF)\d*)"
    r"(?![^\s;,|\"])",
    re.IGNORECASE,
)


def is_no_number(field: str) -> bool:
    """Tell whether a field says that there is no number."""
    return _NO_NUMBER.fullmatch(field) is not None


def name_errors(line: str) -> str:
    """Write nan in place of error values, where a line has several fields."""
    return _ERROR_VALUE.sub("nan", line) if "#" in line and len(re.split(r"[;,|\s]+", line.strip())) > 1 else line
