"""What a stack is inspected with: its surface, the heights of its sections, the nominal of each. All of it can be checked beforehand."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from copy import copy
from pathlib import Path

import numpy as np

from cmmlink.errors import PlanError
from cmmlink.from_plan import asked_of, discretize_file, load_from, profile_of, zone_of
from cmmlink.plan import CtPlan, Discretisation, Plan
from drivers.surface import Open3DMissing, Open3DProcess, SurfaceMesh, axes_of, height_range_mm, read_obj, read_stl
from inspection import Characteristic, NominalProfile, SectionPlane

_MOST_SECTIONS = 100_000
_SAME_HEIGHT_MM = 1e-9


class Open3DOnUse:
    """The process with Open3D. It is started on first use, and ended together with the ExitStack."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self._process: Open3DProcess | None = None

    def __call__(self) -> Open3DProcess:
        """The process, which is started where it is not."""
        if self._process is None:
            self._process = self._stack.enter_context(Open3DProcess())
        return self._process


def read_surface(plan: CtPlan, open3d: Callable[[], Open3DProcess]) -> SurfaceMesh:
    """The surface of a plan in mm. Raises PlanError and MeshError for what cannot be read."""
    path, scale = plan.mesh.file, plan.mesh.mm_per_unit
    suffix = path.suffix.lower()
    if suffix == ".stl":
        return read_stl(path, scale)
    if suffix == ".obj":
        return read_obj(path, scale)
    if suffix != ".ply":
        raise PlanError(f"{path}: no surface file is known by the suffix '{suffix}'; expected .stl, .ply or .obj")
    try:
        return open3d().read(path, scale)
    except Open3DMissing as error:
        raise PlanError(f"{path}: PLY is read by Open3D. {error}. Or export the surface as STL") from None


def heights_of(plan: CtPlan, mesh: SurfaceMesh) -> list[float]:
    """The heights of the sections along the normal, mm. Raises PlanError where there is none, or far too many."""
    where = plan.sections
    if where.every_mm is None:
        return list(where.heights_mm)
    low, high = height_range_mm(mesh, where.normal)
    start = low + where.every_mm / 2 if where.from_mm is None else where.from_mm
    end = high if where.to_mm is None else where.to_mm
    count = int(np.floor((end - start) / where.every_mm + 1e-9)) + 1
    if not 1 <= count <= _MOST_SECTIONS:
        raise PlanError(
            f"a section every {where.every_mm:g} mm from {start:g} to {end:g} mm makes {max(count, 0)}; expected 1 to {_MOST_SECTIONS} "
            f"(the surface spans {low:.3f} to {high:.3f} mm along the normal)"
        )
    return [start + index * where.every_mm for index in range(count)]


def check_own_nominals(plan: CtPlan, heights: Sequence[float]) -> None:
    """Raise PlanError for a nominal of its own at a height where no section is."""
    for at in plan.sections.nominal_at:
        nearest = min(heights, key=lambda height: abs(height - at.height_mm))
        if abs(nearest - at.height_mm) > _SAME_HEIGHT_MM:
            raise PlanError(
                f"{at.file}: a nominal for height {at.height_mm:g} mm, which is none of the sections; the nearest is {nearest:g} mm"
            )


class StackProfiles:
    """The nominal profile of each section; each file is read once."""

    def __init__(self, plan: CtPlan) -> None:
        self._plan = plan
        self._own = {at.height_mm: at.file for at in plan.sections.nominal_at}
        self._profiles: dict[Path, NominalProfile] = {}
        self._asked: dict[Path, tuple[Characteristic, ...]] = {}
        self.notes: list[str] = []
        self._in_space: set[Path] = set()
        where = plan.sections
        self._load(plan.nominal.file, where.heights_mm[0] if where.heights_mm else where.from_mm or 0.0)
        for height, path in self._own.items():
            self._load(path, height)

    @property
    def shortest_mm(self) -> float:
        """The length of the shortest nominal."""
        return min(profile.length_mm for profile in self._profiles.values())

    def at(self, height_mm: float) -> tuple[Path, NominalProfile]:
        """The file of the nominal at a height, and its profile."""
        near = [path for height, path in self._own.items() if abs(height - height_mm) <= _SAME_HEIGHT_MM]
        path = near[0] if near else self._plan.nominal.file
        return path, self._profiles[path]

    def of(self, section: Plan) -> tuple[NominalProfile, tuple[Characteristic, ...]]:
        """The nominal of one section, and its characteristics; a solid is cut anew, and a curve in space has the section's coordinates."""
        path = section.nominal.file
        if path not in self._in_space:
            return self._profiles[path], self._asked[path]
        profile = profile_of(section)
        return profile, asked_of(self._plan, profile)

    def asked_by(self, plan: CtPlan) -> "StackProfiles":
        """The same nominals, with the characteristics of another plan."""
        other = copy(self)
        other._plan = plan
        other._asked = {path: asked_of(plan, profile) for path, profile in self._profiles.items()}
        for profile in self._profiles.values():
            zone_of(plan, profile)
        return other

    def _load(self, path: Path, height_mm: float) -> None:
        nominal, axes = self._plan.nominal, axes_of(self._plan.sections.normal)
        file = load_from(nominal, path, SectionPlane(height_mm * axes.normal, axes.x, axes.normal))
        if file.cut or file.plane is not None:
            self._in_space.add(path)
        if file.cut:
            self.notes.append(f"{path.name}: a solid, which is cut at every section; its notes are of {height_mm:g} mm")
        self.notes += [f"{path.name}: {note}" for note in file.notes]
        self._profiles[path] = discretize_file(file, path, nominal, Discretisation())
        self._asked[path] = asked_of(self._plan, self._profiles[path])
        zone_of(self._plan, self._profiles[path])  # with a U that leaves nothing provable, no section need be cut
