"""A new plan made on the page: what is understood of a nominal that is handed in, and a plan that is saved from the answers.

The page is a stranger to this computer's files: what it hands in is saved under plain names in the folder of the station's plans, and
what its answers name lies there as well. The questions and what may be an answer are those of `cmmlink plan new`.
"""

import os
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, TypeVar, get_args

import numpy as np

from cmmlink.console.form_answers import FieldName, FormMistake, PlanSaved, Understood
from cmmlink.console.refused import without_folders
from cmmlink.errors import PlanError
from cmmlink.new_plan import (
    NO_RESULTS,
    POINTS,
    RESULTS,
    SURFACES,
    NominalReading,
    Open,
    PlanAnswers,
    material_of,
    open_questions,
    plan_text,
    radius_from,
    reading_from,
    refuse_name,
    save_plan,
    source_from,
    tolerance_from,
)
from cmmlink.nominal_files import NominalFile, curves_in, known_suffixes
from cmmlink.result_folder import safe_name
from cmmlink.scan_check import mistakes_of
from drivers import PointFileError, read_bytes
from inspection import InspectionError, Material

Answer = TypeVar("Answer")

_NOMINALS = "nominals"  # the folder beside the plans that keeps what was handed in; a nominal may end in .yaml as plans do
_LONGEST_ANSWER = 300
_LONGEST_PLAN = 200_000
_MOST_NAMESAKES = 100
_MOST_CURVES, _MOST_FILES = 50, 50
_DRAWN, _MEASURED = 600, 2001  # points along the curve
_UNUSABLE = (PlanError, InspectionError, PointFileError, ValueError, ArithmeticError)
_FIELD_OF: Mapping[str, FieldName] = {
    "part": "part", "tolerance": "tolerance", "device": "source", "mesh": "source", "sections": "source", "probe": "radius",
    "out": "results",
}  # fmt: skip
_MISSING: Mapping[Open, FormMistake] = {
    "unit": FormMistake("unit", "the file does not say its unit: expected mm, um, inch, or how many mm a unit is"),
    "chord": FormMistake("unit", "the file is in units of its chord: expected how long the chord is in mm, like 100"),
    "curve": FormMistake("curve", "the file holds several curves: expected the one that is the nominal"),
    "ends": FormMistake("ends", "the ends of the profile nearly meet: expected closed or open"),
}
_NO_SIDE = FormMistake("side", "the profile is open: expected the side that the material is on, seen along the arrow")
_NO_TOLERANCE = "expected the lower and the upper limit in mm, like -0.05 0.05, or one number for both sides, like 0.05"
_NO_SOURCE = "expected a file of points, a surface (STL, PLY, OBJ), or an address like COM3 or 192.168.1.10:4001"


@dataclass(slots=True)
class PlanForm:
    """The answers of the page as it sent them, and what was wrong with them.

    nominal : the name of the file that was handed in
    """

    nominal: str
    answers: Mapping[str, str]
    mistakes: list[FormMistake] = field(default_factory=list)

    @classmethod
    def of(cls, query: Mapping[str, str]) -> "PlanForm":
        """The form that a request holds; longer answers than anybody types are cut off, and then refused."""
        answers = {name: query.get(name, "").strip()[: _LONGEST_ANSWER + 1] for name in get_args(FieldName) if name != "nominal"}
        return cls(query.get("nominal", "").strip(), answers)

    def take(self, name: FieldName, understand: Callable[[str], Answer], missing: str = "") -> Answer | None:
        """The answer in a field as it is understood; None where it cannot be, and where there is none, which is a mistake if missing."""
        text = self.answers[name]
        if not text:
            if missing:
                self.mistakes.append(FormMistake(name, missing))
            return None
        try:
            if len(text) > _LONGEST_ANSWER or not text.isprintable():
                raise PlanError(f"expected printable text of at most {_LONGEST_ANSWER} characters")
            return understand(text)
        except _UNUSABLE as error:
            self.mistakes.append(FormMistake(name, without_folders(str(error))))
            return None

    def reading(self) -> NominalReading:
        """How the nominal is to be read, as far as it was answered."""
        reading = self.take("unit", lambda text: reading_from(text, NominalReading())) or NominalReading()
        curve, ends = self.take("curve", _curve_from), self.take("ends", _ends_from)
        return NominalReading(reading.unit, reading.scale, curve, None, ends)


def _curve_from(text: str) -> int:
    if not re.fullmatch(r"[0-9]{1,6}", text) or not int(text):
        raise PlanError(f"'{text}': expected the number of a curve, the longest being 1")
    return int(text)


def _ends_from(text: str) -> bool:
    if text not in ("closed", "open"):
        raise PlanError(f"'{text}': expected closed or open")
    return text == "closed"


def _side_from(text: str) -> Material:
    side: Material | None = next((known for known in get_args(Material) if known == text), None)
    if side is None:
        raise PlanError(f"'{text}': expected left or right")
    return side


def understand_nominal(form: PlanForm, content: bytes, folder: Path) -> Understood:
    """What is understood of a nominal that was handed in, with the answers that there are, and what it leaves open.

    folder : of the station's plans, whose files of points are offered
    """
    reading = form.reading()
    with _handed_in(form.nominal, content) as path:
        try:
            asked = open_questions(path, reading)
            file = _on_trial(reading, asked).load(path)
            curves = curves_in(path, reading.scale, reading.unit)
        except _UNUSABLE as error:
            return Understood(problem=_words_of(error, path), mistakes=tuple(form.mistakes))
    points = file.curve.point(np.linspace(*file.curve.domain, _DRAWN))
    size = np.ptp(file.curve.point(np.linspace(*file.curve.domain, _MEASURED)), axis=0)
    stem = _stem_of(form.nominal)
    return Understood(
        mistakes=tuple(form.mistakes),
        asks=(*asked, *(() if material_of(file) else ("side",))),
        curves=tuple((curve.number, curve.words) for curve in curves[:_MOST_CURVES]) if len(curves) > 1 else (),
        closed=file.curve.closed,
        turns_left=material_of(file) == "left",
        length_mm=file.curve.length_mm,
        size_mm=(float(size[0]), float(size[1])),
        unit_known="unit" not in asked and "chord" not in asked,
        source_format=file.source_format,
        notes=tuple(map(without_folders, file.notes)),
        points_mm=tuple((float(x), float(y)) for x, y in points),
        part=stem,
        name=f"{stem}.yaml",
        files=tuple(_points_in(folder)),
    )


def _on_trial(reading: NominalReading, asked: tuple[Open, ...]) -> NominalReading:
    """The reading with something in the place of every open answer, so that there is a curve to look at."""
    unit, curve = ("mm" if "unit" in asked else reading.unit), (1 if "curve" in asked else reading.curve)
    return NominalReading(unit, reading.scale, curve, reading.layer, True if "ends" in asked else reading.closed)


def _points_in(folder: Path) -> list[str]:
    """Names of the files of points and surfaces beside the plans."""
    return [path.name for path in sorted(folder.iterdir()) if path.suffix.lower() in (*POINTS, *SURFACES)][:_MOST_FILES]


def save_form(form: PlanForm, content: bytes, folder: Path, *, overwrite: bool) -> PlanSaved:
    """Save the plan that the answers make, and the nominal that was handed in, into the folder of the plans, if both can be used.

    overwrite : whether a plan of this name, if there is one, may be replaced

    Nothing is left in the folder, and no plan is replaced, where anything is wrong.
    """
    name = form.take("name", lambda text: _plan_name(text, folder), "expected a name for the plan, like blade.yaml") or ""
    taken = bool(name) and os.path.lexists(folder / name)
    if taken and not overwrite:
        form.mistakes.append(FormMistake("name", f"{name} is there already; it is replaced only when that is confirmed here"))
    with _handed_in(form.nominal, content) as path, ExitStack() as undo:
        made = _answers(form, path, folder)
        if made is None or form.mistakes:
            return PlanSaved(taken=taken, mistakes=tuple(form.mistakes))
        answers, understood = made
        try:
            kept = _keep_nominal(folder, form.nominal, content, undo)
            text = plan_text(replace(answers, nominal=kept), understood, folder)
            mistakes = _mistakes_in(text, folder, name)
            if not mistakes:
                save_plan(folder, name, text, overwrite=overwrite)
                undo.pop_all()
        except PlanError as error:
            mistakes = (_beside_field(str(error)),)
        except OSError as error:
            mistakes = (FormMistake("name", f"it cannot be saved: {error.strerror or error}"),)
    return PlanSaved("" if mistakes else name, "mesh" in answers.source, taken, mistakes)


def _answers(form: PlanForm, nominal: Path, folder: Path) -> tuple[PlanAnswers, NominalFile] | None:
    """The answers that make a plan, and the nominal as they read it; None where one is missing or none: the form says which."""
    reading, side = form.reading(), form.take("side", _side_from)
    part = form.take("part", str, "expected the name of the part")
    limits = form.take("tolerance", tolerance_from, _NO_TOLERANCE)
    source = form.take("source", lambda text: _source_from(text, folder), _NO_SOURCE)
    radius = form.take("radius", radius_from) or 0.0
    results = form.take("results", lambda text: text if text in NO_RESULTS else _name_inside(text, folder)) or RESULTS
    try:
        asked = open_questions(nominal, reading)
        form.mistakes += [_MISSING[question] for question in asked]
        if asked:
            return None
        understood = reading.load(nominal)
    except _UNUSABLE as error:
        form.mistakes.append(FormMistake("nominal", _words_of(error, nominal)))
        return None
    if material_of(understood) is not None:
        side = None
    elif side is None:
        form.mistakes.append(_NO_SIDE)
    if part is None or limits is None or source is None:
        return None
    return PlanAnswers(part, nominal, reading, *limits, source, results, side, radius), understood


def _plan_name(text: str, folder: Path) -> str:
    """The name of a plan in the folder, which may replace nothing but a plan. Raises PlanError."""
    name = text if text.lower().endswith((".yaml", ".yml")) else f"{text}.yaml"
    path = refuse_name(folder, name, overwrite=True)
    if os.path.lexists(path) and not (path.is_file() and _is_plan(path)):
        raise PlanError(f"{name} is there already and is no plan: expected another name")
    return name


def _is_plan(path: Path) -> bool:
    """Whether a file has the keys that every plan has."""
    lines = read_bytes(path, _LONGEST_PLAN).splitlines()
    return {b"part", b"nominal"} <= {line.partition(b":")[0].rstrip() for line in lines}


def _source_from(text: str, folder: Path) -> dict[str, Any]:
    """Where the points come from; a file that is named lies in the folder of the plans. Raises PlanError."""
    words = text.split()
    whole = Path(text).suffix.lower() in (*POINTS, *SURFACES)
    for name in [text] if whole else [word for word in words if word.lower().endswith((".yaml", ".yml"))]:
        _name_inside(name, folder)
    return source_from(text, folder, folder)


def _name_inside(name: str, folder: Path) -> str:
    """The name of a file or a folder in the folder of the plans. Raises PlanError for one that lies anywhere else."""
    ways = PurePosixPath(name), PureWindowsPath(name)
    leaves = any(way.is_absolute() or way.anchor or ".." in way.parts for way in ways)
    if leaves or not (folder / name).resolve().is_relative_to(folder.resolve()):
        raise PlanError(f"'{name}': expected a name in the folder of the plans, without another folder above it")
    return name


def _words_of(error: Exception, path: Path) -> str:
    """What is wrong with a nominal that was handed in; the file that it lies in for a moment is nothing to the page."""
    return without_folders(str(error).replace(f"{path}: ", "").replace(str(path), "the file"))


def _stem_of(nominal: str) -> str:
    """A nominal's name without suffix and folder, as a name that every system takes."""
    return safe_name(Path(re.split(r"[\\/]", nominal)[-1]).stem).lstrip("_-.") or "part"


def _keep_nominal(folder: Path, nominal: str, content: bytes, undo: ExitStack) -> Path:
    """Keep what was handed in among the nominals, under a name that no other content has. Raises PlanError, OSError.

    undo : takes it away again, if it was not there before
    """
    place, stem, suffix = folder / _NOMINALS, _stem_of(nominal), _suffix_of(nominal)
    if place.is_symlink():
        raise PlanError(f"the folder {_NOMINALS} beside the plans leads elsewhere: expected a folder")
    place.mkdir(exist_ok=True)
    for number in range(1, _MOST_NAMESAKES):
        path = place / f"{stem}{'' if number == 1 else f'-{number}'}{suffix}"
        try:
            with path.open("xb") as file:
                undo.callback(path.unlink)
                file.write(content)
            return path
        except FileExistsError:
            if path.is_file() and not path.is_symlink() and path.read_bytes() == content:
                return path
    raise PlanError(f"{_MOST_NAMESAKES} files of this name are kept already: expected another name of the file")


def _mistakes_in(text: str, folder: Path, name: str) -> tuple[FormMistake, ...]:
    """What `cmmlink check` finds wrong with a plan in the folder, each beside the field that it belongs to."""
    draft = folder / f".{name}.draft"
    try:
        draft.write_text(text, encoding="utf-8", newline="\n")
        found = mistakes_of(draft)
    finally:
        draft.unlink(missing_ok=True)
    return tuple(_beside_field(mistake.words) for mistake in found)


def _beside_field(words: str) -> FormMistake:
    """What is wrong with a plan, without the line that it stands in: who fills the form sees no lines."""
    told = without_folders(words)
    found = re.search(r"\bline \d+: (([a-z_]+).*)", told, re.DOTALL)
    return FormMistake(_FIELD_OF.get(found[2], "nominal"), found[1]) if found else FormMistake("nominal", told)


@contextmanager
def _handed_in(nominal: str, content: bytes) -> Iterator[Path]:
    """A nominal as a file of its own, for as long as it is read. Of its name it keeps the suffix alone, which is the format."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"nominal{_suffix_of(nominal)}"
        path.write_bytes(content)
        yield path


def _suffix_of(nominal: str) -> str:
    """The suffix of a nominal's name, if it is one of a known format; else one that no format has."""
    return next((known for known in known_suffixes() if nominal.lower().endswith(known)), ".unknown")
