"""All mistakes of a plan at once, whatever kind of plan it is, each with a line that would be right."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel

from cmmlink.errors import PlanError, YamlError
from cmmlink.plan.examples import example_of
from cmmlink.plan.scan import Plan
from cmmlink.plan.surface import CtPlan
from cmmlink.plan.whole_surface import SurfacePlan
from cmmlink.plan.yaml_model import mistakes_in, texts_of
from drivers import PointFileError, RegisterMap, read_text

_FILES = ("nominal.file", "device.file", "device.format.sample", "mesh.file", "report.logo", "surface.file")


@dataclass(frozen=True, slots=True)
class PlanMistake:
    """What is wrong, with its line, and a line that would be right; the latter is empty where a key has only to go."""

    words: str
    example: str = ""


def kind_of(text: str) -> type[Plan] | type[SurfacePlan] | type[CtPlan] | type[RegisterMap]:
    """Which kind of file a text is. Raises YamlError.

    A plan of a CT surface has a mesh, that of a scan of a whole surface has a surface, a register map has a pattern, and a scan none of it.
    """
    keys = {line.partition(":")[0].rstrip() for line in text.splitlines() if line[:1].isalpha()}
    if "surface" in keys:
        return SurfacePlan
    return CtPlan if "mesh" in keys else RegisterMap if "pattern" in keys and "part" not in keys else Plan


def kind_of_plan(path: Path) -> type[Plan] | type[SurfacePlan] | type[CtPlan] | type[RegisterMap]:
    """Which kind of file it is that stands there. Raises PlanError where it cannot be read."""
    try:
        return kind_of(read_text(path))
    except PointFileError as error:
        raise PlanError(str(error)) from None


def find_mistakes(path: Path) -> tuple[PlanMistake, ...]:
    """Everything that is wrong with the text of a plan or a register map; none where it can be read.

    Where something is wrong, files that it names and that are not there are among it. Raises PlanError where the file is no text with keys.
    """
    try:
        text = read_text(path)
        model = kind_of(text)
        mistakes = mistakes_in(text, model)
        absent = tuple(_absent_files(text, path.parent, model)) if mistakes else ()
    except PointFileError as error:
        raise PlanError(str(error)) from None
    except YamlError as error:
        raise PlanError(f"{path}: {error}") from None
    told = [(mistake.line, str(mistake), example_of(mistake.model, mistake.key) if mistake.model else "") for mistake in mistakes]
    return tuple(PlanMistake(words, example) for _, words, example in sorted([*told, *absent], key=lambda one: one[0]))


def _absent_files(text: str, folder: Path, model: type[BaseModel]) -> Iterator[tuple[int, str, str]]:
    """Line and words for each file that a plan names, seen from its folder, and that is not there."""
    if model is RegisterMap:
        return
    texts = texts_of(text)
    grows = texts.get("device.type", (0, ""))[1] == "lines"  # its file may come with the first line that is printed
    for key, (line, name) in texts.items():
        if key in _FILES and not (grows and key == "device.file") and name.strip() and not (folder / name.strip()).is_file():
            yield line, f"line {line}: {key}: {folder / name.strip()}: no such file", ""
