"""Where the results of a run go: a folder named by part, serial number and run, and never over another run's files.

A folder of results may hold the placeholders {part}, {serial} and {run}, as in `results/{part}/{serial}_{run}`. What stands in
such a folder from an earlier run is moved aside into a folder of its own before anything is written: nothing is lost, and no old
result stands where the newest is looked for.
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path

PLACEHOLDERS = ("part", "serial", "run")
_PLACEHOLDER = re.compile(r"\{(\w*)\}")
_OF_A_RUN = (
    "result.json", "deviations.csv", "characteristics.csv", "zone.json", "uncertainty.csv", "profile.png", "profile.svg", "report.pdf",
    "sections.csv", "stack.png", "stack.svg",
    "result.qif", "result.dfq", "result.xlsx", "result.csv", "result-characteristics.csv", "result-points.csv",
)  # fmt: skip
_SECTIONS = "section-*_*mm"
_LONGEST_NAME = 80
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # names of devices on Windows


def check_placeholders(folder: Path) -> None:
    """Raise ValueError, which says what is allowed, where a folder holds a placeholder that there is not."""
    unknown = [name for name in _PLACEHOLDER.findall(str(folder)) if name not in PLACEHOLDERS]
    if unknown:
        raise ValueError("a folder, with no other placeholders than {part}, {serial} and {run}")


def folder_of(pattern: Path, *, part: str, serial_number: str, run: str) -> Path:
    """The folder of one run: its placeholders filled in as safe names, none of which leads to another folder.

    Where a part has no serial number, {serial} is left out together with the underscore behind it.
    """
    if not serial_number.strip():
        pattern = Path(str(pattern).replace("{serial}_", ""))
    names = {"part": safe_name(part), "serial": safe_name(serial_number), "run": safe_name(run)}
    return Path(_PLACEHOLDER.sub(lambda found: names.get(found[1], found[0]), str(pattern)))


def fixed_part(pattern: Path) -> Path:
    """The part of a folder that is there before a run is: everything above its first placeholder."""
    fixed = Path(pattern.anchor)
    for name in pattern.parts[1 if pattern.anchor else 0 :]:
        if any(placeholder in PLACEHOLDERS for placeholder in _PLACEHOLDER.findall(name)):
            break
        fixed /= name
    return fixed


def safe_name(text: str) -> str:
    """A text as one name of a file on every system: letters, digits, dots, hyphens and underscores."""
    name = "".join(sign if sign.isalnum() or sign in "-_." else "_" for sign in text.strip())[:_LONGEST_NAME].strip(".")
    if not name:
        return "none"
    return f"_{name}" if _RESERVED.fullmatch(name) else name


def make_room(folder: Path) -> Path | None:
    """Move what an earlier run left in a folder into a folder of its own below it; returns that one, None where nothing stood there."""
    earlier = list(_results_in(folder))
    if not earlier:
        return None
    aside = _free_folder(folder / _name_of_earlier(folder / "result.json"))
    aside.mkdir()
    for path in earlier:
        path.rename(aside / path.name)
    return aside


def _results_in(folder: Path) -> Iterator[Path]:
    yield from (path for name in _OF_A_RUN if (path := folder / name).exists())
    yield from (path for path in sorted(folder.glob(_SECTIONS)) if path.is_dir())


def _name_of_earlier(result: Path) -> str:
    """The name for an earlier result: its serial number and run, or when it was measured, as far as it says so."""
    try:
        said = json.loads(result.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        said = {}
    told = [said.get("serial_number"), said.get("run") or said.get("measured_at")] if isinstance(said, dict) else []
    return safe_name("_".join(str(value) for value in told if value) or "earlier")


def _free_folder(wanted: Path) -> Path:
    """The folder wanted, or one beside it with a number behind its name."""
    folder, number = wanted, 1
    while folder.exists():
        number += 1
        folder = wanted.with_name(f"{wanted.name}-{number}")
    return folder
