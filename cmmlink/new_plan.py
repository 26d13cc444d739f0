"""A plan made of a few answers, for command line and page alike: what the nominal still leaves open, the plan as text, and its file.

What an answer may be is said once, here; whoever asks shows the question and hands the answer in as text.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path, PurePosixPath
from typing import Any, Literal, get_args

import numpy as np
import yaml

from cmmlink.errors import PlanError, YamlError
from cmmlink.nominal_files import NominalFile, load_nominal, material_side
from cmmlink.plan import CtPlan, Plan, read_model
from drivers import UnitName
from drivers.surface import height_range_mm, read_obj, read_stl
from inspection import Material, NominalError

Open = Literal["unit", "chord", "curve", "ends"]
"""What a nominal file may leave open: its unit, the length of its chord, which of its curves is meant, and whether its ends meet."""

RESULTS = "results/{part}/{serial}_{run}"
NO_RESULTS = ("none", "null")
SURFACES = (".stl", ".ply", ".obj")
POINTS = (".csv", ".txt", ".asc", ".xyz", ".npy", ".dat", ".pts")
MAP_OF_A_CONTROLLER = "generic-ring"

_NAME = re.compile(r"[^\W_.][\w .()+-]*\.ya?ml")
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # names that Windows keeps for devices
_COMMENT_AT = 62
_LONGEST_NAME = 120
_CHORD = (0.9, 1.1)  # widths of a section in units of its chord
_SECTIONS = 10
_USUAL_STEP_MM = 5.0


@dataclass(frozen=True, slots=True)
class NominalReading:
    """How a nominal file is read: what a plan says beside its name. A unit in words, or mm per unit."""

    unit: UnitName | None = None
    scale: float = 1.0
    curve: int | None = None
    layer: str | None = None
    closed: bool | None = None

    def load(self, path: Path) -> NominalFile:
        """Read the file so. Raises NominalError."""
        return load_nominal(path, self.scale, self.closed, self.unit, layer=self.layer, curve=self.curve)


@dataclass(frozen=True, slots=True)
class PlanAnswers:
    """The answers that a plan is made of.

    nominal   : the file, with how it is read
    lower_mm, upper_mm : the tolerance
    source    : where the points come from, as `source_from` gives it
    material  : the side of the material of an open profile
    tip_radius_mm : of the ball whose centres the points are; 0 where they are points of the surface
    """

    part: str
    nominal: Path
    reading: NominalReading
    lower_mm: float
    upper_mm: float
    source: Mapping[str, Any]
    results: str = RESULTS
    material: Material | None = None
    tip_radius_mm: float = 0.0


def open_questions(path: Path, reading: NominalReading) -> tuple[Open, ...]:
    """What of a nominal file has to be asked before it can be read. Raises NominalError for a file that no answer helps."""
    trials: dict[Open, dict[str, Any]] = {"unit": {"unit": "mm"}, "curve": {"curve": 1}, "ends": {"closed": True}}
    said: dict[Open, bool] = {"unit": _is_unit_said(reading), "curve": reading.curve is not None, "ends": reading.closed is not None}
    unsaid = [question for question in trials if not said[question]]
    refusal: NominalError | None = None
    for count in range(len(unsaid) + 1):
        for questions in combinations(unsaid, count):
            try:
                file = replace(reading, **{key: value for question in questions for key, value in trials[question].items()}).load(path)
            except NominalError as error:
                refusal = refusal or error
                continue
            return (*questions, *(("chord",) if _is_in_chords(file, reading) else ()))
    assert refusal is not None
    raise refusal


def _is_unit_said(reading: NominalReading) -> bool:
    return reading.unit is not None or reading.scale != 1.0


def _is_in_chords(file: NominalFile, reading: NominalReading) -> bool:
    """Whether an airfoil file of chord 1 was read as if it were mm."""
    width = float(np.ptp(file.curve.control_points_mm[:, 0]))
    return file.source_format.startswith("uiuc") and not _is_unit_said(reading) and _CHORD[0] <= width <= _CHORD[1]


def reading_from(text: str, reading: NominalReading) -> NominalReading:
    """The reading with a unit that was answered: mm, um, inch, or how many mm a unit of the file is. Raises PlanError."""
    answer = text.strip().lower().removesuffix("mm") if re.fullmatch(r"\s*[\d.]+\s*mm\s*", text) else text.strip().lower()
    unit: UnitName | None = next((known for known in get_args(UnitName) if known == answer), None)
    if unit is not None:
        return replace(reading, unit=unit, scale=1.0)
    scale = _number(answer)
    if scale is None or not 0 < scale < np.inf:
        raise PlanError(f"'{text}': expected mm, um, inch, or how many mm a unit of the file is, like 100")
    return replace(reading, unit=None, scale=scale)


def tolerance_from(text: str) -> tuple[float, float]:
    """The limits in mm from an answer: two numbers, or one that is meant to both sides, like 0.05. Raises PlanError."""
    words = text.replace(";", " ").replace("..", " ").replace("+/-", " ").replace("\u00b1", " ").split()
    numbers = [number for word in words if (number := _number(word)) is not None]
    if len(numbers) == 1 and len(words) == 1 and numbers[0] > 0:
        return -numbers[0], numbers[0]
    if len(numbers) == 2 and len(words) == 2 and numbers[0] < numbers[1]:
        return numbers[0], numbers[1]
    raise PlanError(f"'{text}': expected the lower and the upper limit in mm, like -0.05 0.05, or one number for both sides, like 0.05")


def radius_from(text: str) -> float:
    """The radius of the ball from an answer, 0 for none. Raises PlanError."""
    radius = _number(text.strip().removesuffix("mm"))
    if radius is None or radius < 0:
        raise PlanError(f"'{text}': expected the radius in mm, like 1, or 0")
    return radius


def _number(word: str) -> float | None:
    try:
        number = float(word)
    except ValueError:
        return None
    return number if np.isfinite(number) else None


def source_from(text: str, folder: Path, seen_from: Path = Path()) -> dict[str, Any]:
    """Where the points come from: a file of points, the surface of a CT scan, or a device, as keys of a plan. Raises PlanError.

    text   : a file; or an address (a port like COM3, or host:port), with `modbus` before it where it keeps its points in registers, and
             behind it the format or the register map, and options of the format like range_mm=50
    folder : the folder of the plan, from which files are named
    seen_from : the folder that the name of a file in the text is seen from
    """
    words = text.split()
    file = seen_from / text.strip()
    suffix = file.suffix.lower()
    if suffix in SURFACES:
        return _surface(file, folder)
    if suffix in POINTS:
        return {"device": {"type": "file", "file": name_from(file, folder)}}
    kind = words.pop(0) if words and words[0] in ("serial", "modbus") else "serial"
    if not words:
        raise PlanError(f"'{text}': expected a file of points, a surface (STL, PLY, OBJ), or an address like COM3 or 192.168.1.10:4001")
    address, *rest = words
    named = [word for word in rest if "=" not in word]
    options = {key: _option(value) for key, _, value in (word.partition("=") for word in rest if "=" in word)}
    if len(named) > 1 or (kind == "modbus" and options):
        raise PlanError(f"'{text}': expected an address and one {'register map' if kind == 'modbus' else 'format, then its options'}")
    device: dict[str, Any] = {"type": kind, "address": address}
    if kind == "modbus":
        own = seen_from / named[0] if named and Path(named[0]).suffix.lower() in (".yaml", ".yml") else None
        return {"device": device | {"map": name_from(own, folder) if own else (named or [MAP_OF_A_CONTROLLER])[0]}}
    return {"device": device | ({"format": named[0]} if named else {}) | ({"options": options} if options else {})}


def _surface(path: Path, folder: Path) -> dict[str, Any]:
    """A surface with some ten sections across it along z, a round number of mm apart."""
    every_mm = _USUAL_STEP_MM
    if path.suffix.lower() != ".ply" and path.is_file():  # a PLY is read by Open3D, which takes its time to load
        low, high = height_range_mm(read_stl(path) if path.suffix.lower() == ".stl" else read_obj(path), (0.0, 0.0, 1.0))
        every_mm = _round_step((high - low) / _SECTIONS) if high > low else every_mm
    return {"mesh": {"file": name_from(path, folder)}, "sections": {"normal": [0, 0, 1], "every_mm": every_mm}}


def _round_step(step: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is no larger."""
    power = 10.0 ** np.floor(np.log10(step))
    return float(f"{max(first for first in (1, 2, 5) if first * power <= step * (1 + 1e-9)) * power:.6g}")


def _option(value: str) -> float | int | str:
    number = _number(value)
    return value if number is None else _plain(number)


def name_from(path: Path, folder: Path) -> str:
    """A file as a plan in a folder names it: with a path from there, where the two lie near each other."""
    try:
        near = Path(os.path.relpath(path.resolve(), folder.resolve()))
    except ValueError:  # on another drive of Windows
        return str(path.resolve())
    return str(path.resolve()) if near.parts[:3] == ("..", "..", "..") else str(PurePosixPath(*near.parts))


def material_of(file: NominalFile) -> Material | None:
    """The side of the material that the file itself shows; None where it has to be asked."""
    return material_side(file.curve)


def words_of_nominal(file: NominalFile) -> str:
    """What was understood of a nominal, on one line, for whoever compares it with the drawing."""
    curve = file.curve
    size = np.ptp(curve.point(np.linspace(*curve.domain, 2001)), axis=0)
    start = curve.point(np.array(curve.domain[:1]))[0] + 0.0
    ends = "closed" if curve.closed else "open"
    return f"{ends}, {curve.length_mm:.3f} mm long, {size[0]:.3f} x {size[1]:.3f} mm, begins at ({start[0]:.3f}, {start[1]:.3f})"


def plan_text(answers: PlanAnswers, understood: NominalFile, folder: Path) -> str:
    """The plan, a short text with comments. Raises PlanError where the answers make no plan.

    folder : where the plan will lie, from which it names its files
    """
    nominal = {
        "file": name_from(answers.nominal, folder),
        "layer": answers.reading.layer,
        "curve": answers.reading.curve,
        "unit": answers.reading.unit,
        "scale": None if answers.reading.scale == 1.0 else _plain(answers.reading.scale),
        "closed": answers.reading.closed,
        "material": answers.material,
    }
    surface = "mesh" in answers.source
    lines: list[tuple[str, object, str]] = [
        ("part", {"name": answers.part}, "" if surface else 'and its serial_number: "0042", or cmmlink run --serial 0042'),
        ("nominal", {key: value for key, value in nominal.items() if value is not None}, words_of_nominal(understood)),
        ("tolerance", {"lower_mm": _plain(answers.lower_mm), "upper_mm": _plain(answers.upper_mm)}, "positive is out of material"),
        *([("probe", {"tip_radius_mm": _plain(answers.tip_radius_mm)}, "the points are ball centres")] if answers.tip_radius_mm else []),
        *((key, value, _SOURCE_COMMENTS.get(key, "")) for key, value in answers.source.items()),
        ("out", None if answers.results in NO_RESULTS else answers.results, "a folder for every run; null: none"),
    ]
    head = f"# An inspection plan: `cmmlink check` checks it, `cmmlink {'ct' if surface else 'run'}` carries it out."
    hints = _HINTS[:1] if surface or answers.tip_radius_mm else _HINTS
    text = "\n".join([head, "# `cmmlink plan keys` shows all that may be added.", *(_line(*line) for line in lines), *hints, ""])
    try:
        read_model(text, CtPlan if surface else Plan)
    except YamlError as error:
        raise PlanError(str(error)) from None
    return text


_SOURCE_COMMENTS = {
    "mesh": "read in mm, unless unit says otherwise: um or inch",
    "sections": "along the part's axis in the scan; or heights_mm: [20, 50, 80]",
}
_HINTS = (
    "# tolerance may say uncertainty_mm, the U (95 %) of one deviation: then CONFORM and NOT CONFORM are proven with it (ISO 14253-1)",
    "# probe: {tip_radius_mm: 1.0}    where the points are centres of the ball, and not points of the surface",
)


def _plain(number: float) -> float | int:
    """A whole number without its point."""
    return int(number) if number == int(number) else number


def _line(key: str, value: object, comment: str) -> str:
    """One key with its value and a comment, on one line."""
    spelled = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True)
    line = f"{key}: {spelled.removesuffix('...' + chr(10)).rstrip(chr(10))}"
    return f"{line:<{_COMMENT_AT}}  # {comment}" if comment else line


def refuse_name(folder: Path, name: str, *, overwrite: bool = False) -> Path:
    """The path of a plan in a folder. Raises PlanError for a name that is no plain name of a YAML file, and one that is taken.

    overwrite : whether a plan of this name, if there is one, may be replaced
    """
    if not _NAME.fullmatch(name) or _RESERVED.fullmatch(name) or len(name) > _LONGEST_NAME:
        raise PlanError(f"'{name}': expected a plain name of a file that ends in .yaml, without a folder, like blade.yaml")
    path = folder / name
    if path.is_dir() or (os.path.lexists(path) and not overwrite):
        raise PlanError(f"{path}: is there already; it is replaced only when that is confirmed (--overwrite)")
    return path


def save_plan(folder: Path, name: str, text: str, *, overwrite: bool = False) -> Path:
    """Write a plan into a folder and nowhere else. Returns its path.

    Raises PlanError as `refuse_name` does, and for a folder that cannot be written.
    """
    path = refuse_name(folder, name, overwrite=overwrite)
    try:
        if not overwrite:
            with path.open("xb") as file:
                file.write(text.encode())
            return path
        beside = folder / f".{name}.new"
        beside.write_bytes(text.encode())
        beside.replace(path)  # at once: nobody reads half a plan
    except OSError as error:
        raise PlanError(f"{path}: cannot be written: {error.strerror or error}") from None
    return path
