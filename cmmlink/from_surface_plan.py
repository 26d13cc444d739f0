"""Builds what the plan of a whole surface describes, except its device: the nominal surface and the inspection."""

import hashlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.errors import PlanError
from cmmlink.events import Counts
from cmmlink.from_plan import Problems
from cmmlink.nominal_files.surface_file import SurfaceFile, load_surface, states_its_unit
from cmmlink.plan import SurfacePlan
from cmmlink.surface_json import NominalWords, surface_json
from drivers import PointFileError, read_bytes
from inspection import InspectionResult

if TYPE_CHECKING:
    from inspection.surface import LiveSurface, NominalSurface, SurfaceResult, SurfaceTerms


def check_surface_plan(plan: SurfacePlan, plan_file: Path) -> SurfaceFile:
    """Read the nominal of a plan and check the values that depend on it. Raises PlanError with file, line and key."""
    file, problems = find_surface_problems(plan, plan_file)
    if problems or file is None:
        raise problems[0]
    return file


def find_surface_problems(plan: SurfacePlan, plan_file: Path) -> tuple[SurfaceFile | None, tuple[PlanError, ...]]:
    """The nominal of a plan, and everything that is wrong with the values that depend on it, each with file, line and key."""
    found = Problems(plan_file)
    file = found.attempt("surface.file", lambda: surface_of(plan))
    found.attempt("registration", lambda: terms_of(plan))
    if file is not None:
        found.attempt("probe.tip_radius_mm", lambda: held_against(plan, file))
    return file, tuple(found.problems)


def surface_of(plan: SurfacePlan) -> SurfaceFile:
    """The nominal that a plan names. Who asks for it again has what was read before, as long as the file holds the same bytes."""
    content = _content_of(plan.surface.file)
    if content is None:
        return _load(plan)
    file = _read(_Content(content, lambda: _load(plan)), plan.surface.mm_per_unit, plan.surface.chord_mm)
    if _content_of(plan.surface.file) != content:
        _read.cache_clear()  # it was written meanwhile: which of its contents was read is not known
        return _load(plan)
    return file


class _Content:
    """The content of a file, told from any other by its hash, and what reads it."""

    def __init__(self, sha256: bytes, read: Callable[[], SurfaceFile]) -> None:
        self._sha256, self.read = sha256, read

    def __hash__(self) -> int:
        return hash(self._sha256)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Content) and other._sha256 == self._sha256


@lru_cache(maxsize=1)
def _read(content: _Content, mm_per_unit: float, chord_mm: float | None) -> SurfaceFile:
    """The nominal surface in a file of this content. One of a million triangles takes seconds to read, and a run needs it twice."""
    del mm_per_unit, chord_mm
    return content.read()


def _content_of(path: Path) -> bytes | None:
    """What tells the content of a file from any other; None where it cannot be read, of which whoever reads it says why."""
    with suppress(PointFileError):
        return hashlib.sha256(read_bytes(path)).digest()
    return None


def _load(plan: SurfacePlan) -> SurfaceFile:
    nominal = plan.surface
    chord = nominal.chord_mm
    if states_its_unit(nominal.file):
        if nominal.mm_per_unit != 1.0:
            raise PlanError(f"{nominal.file}: a CAD file states its own unit; leave scale and unit out")
        if chord == 0:
            raise PlanError(f"{nominal.file}: no triangles lie exactly on a trimmed face; expected a chord above 0, or none")
        return load_surface(nominal.file) if chord is None else load_surface(nominal.file, chord_mm=chord)
    return load_surface(nominal.file, nominal.mm_per_unit, chord)


def terms_of(plan: SurfacePlan) -> "SurfaceTerms":
    """What the points of a plan are judged by. Raises PlanError for terms that cannot be."""
    from inspection.surface import RigidMotion, SurfaceTerms  # noqa: PLC0415 - who only checks the text of a plan needs none of it

    placing, start = plan.registration, plan.registration.start
    try:
        return SurfaceTerms(
            plan.zone,
            fit=placing.fit,
            start=None if start is None else RigidMotion(_rotation_near(start.rotation), np.array(start.translation_mm)),
            locked=placing.locked,
            coverage_min=placing.coverage_min,
            gap_max_mm=plan.gap_max_mm,
            gross_mm=placing.gross_mm,
            reject_outliers=placing.reject_outliers,
            edge_allowance_mm=plan.edge_allowance_mm,
            allow_unseen_mm=plan.allow.unseen_mm,
        )
    except ValueError as error:
        raise PlanError(str(error)) from None


def _rotation_near(rows: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """The rotation nearest to one that a person wrote down, with fewer digits."""
    u, _, v = np.linalg.svd(np.array(rows))
    return np.asarray(u @ v)


def live_surface_of(plan: SurfacePlan, file: SurfaceFile, *, provisional: bool = True) -> "LiveSurface":
    """A fresh inspection as a plan describes it. Points that are all there from the start need no provisional verdicts."""
    from inspection.surface import LiveSurface  # noqa: PLC0415 - likewise

    return LiveSurface(held_against(plan, file), terms_of(plan), provisional=provisional)


def rehearse_on(file: SurfaceFile) -> None:
    """Compile what the points of a scan need on a nominal, before the first one comes."""
    from inspection.surface import rehearse_surface  # noqa: PLC0415 - likewise

    rehearse_surface(file.nominal)


def held_against(plan: SurfacePlan, file: SurfaceFile) -> "NominalSurface":
    """What the points of a plan are held against: the nominal, or the surface of ball centres around it."""
    if not plan.probe.tip_radius_mm:
        return file.nominal
    from inspection.surface import BallCentres  # noqa: PLC0415 - likewise

    return BallCentres(file.nominal, plan.probe.tip_radius_mm)


def words_of_nominal(file: SurfaceFile) -> NominalWords:
    """What is said of a nominal surface."""
    from inspection.surface import CloudSurface, TriangleSurface  # noqa: PLC0415 - likewise

    nominal = file.nominal
    kind = "cloud" if isinstance(nominal, CloudSurface) else "triangles" if isinstance(nominal, TriangleSurface) else "patches"
    faces = file.faces if file.source_format in ("step", "iges") else None
    triangles = len(nominal) if isinstance(nominal, TriangleSurface) else None
    return NominalWords(kind, file.source_format, faces, triangles, nominal.nominal_error_mm, nominal.area_mm2)


def notes_on_surface(plan: SurfacePlan, file: SurfaceFile) -> tuple[str, ...]:
    """What was assumed when the nominal was read."""
    return tuple(f"{plan.surface.file.name}: {note}" for note in file.notes)


def notes_of_result(result: "SurfaceResult | None", file: SurfaceFile) -> list[str]:
    """What was assumed when the points were judged, without what is said of the nominal's file already."""
    return [note for note in (result.notes if result is not None else ()) if note not in file.notes]


def document_of_surface(file: SurfaceFile, result: "InspectionResult | SurfaceResult | None", counts: Counts) -> dict[str, Any]:
    """What is told of a result of a nominal, as the record takes it."""
    assert not isinstance(result, InspectionResult)
    return surface_json(result, counts, words_of_nominal(file))
