"""Write the API reference as pages for a browser, from the docstrings of what the front doors offer: `make docs`.

The pages show names, signatures with their types, and the whole docstrings; everything behind the front doors is left out.
"""

import re
import sys
from importlib import import_module
from pathlib import Path

PACKAGES = ("cmmlink", "inspection", "drivers", "simulators")
_TERM = re.compile(r"(?P<names>[A-Za-z_][\w.]*(?:, [A-Za-z_][\w.]*)*)\s*: (?P<meaning>\S.*)")


def write_reference(folder: Path) -> None:
    """Write the pages into a folder."""
    import pdoc  # noqa: PLC0415 - it is there where the pages are written, and not where they are tested

    for package in map(import_module, PACKAGES):
        for name in package.__all__:
            setattr(package, name, getattr(package, name))  # a name is loaded when it is used, and pdoc looks without using it
    pdoc.render.configure(show_source=False, footer_text="cmmlink")
    pdoc.render.env.filters["to_markdown"] = markdown_of
    pdoc.pdoc(*PACKAGES, *(f"!{package}." for package in PACKAGES), output_directory=folder)


def markdown_of(docstring: str) -> str:
    """A docstring as Markdown: what is explained line by line, `name : meaning`, becomes a list, and examples stay as they are."""
    lines: list[str] = []
    in_list = False
    for line in docstring.splitlines():
        term = _TERM.fullmatch(line)
        if term is not None:
            lines += [] if in_list else [""]
            lines.append(f"- `{term['names']}`: {term['meaning']}")
        elif in_list and line.startswith(" "):
            lines.append(f"  {line.strip()}")
        else:
            lines += ["", line] if in_list and line.strip() else [line]
        in_list = term is not None or (in_list and line.startswith(" "))
    return "\n".join(lines)


if __name__ == "__main__":
    write_reference(Path(sys.argv[1]))
