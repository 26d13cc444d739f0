"""What a run depends on and its record keeps: the plan, the nominal's file and the software, as they were when it began."""

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from typing import TYPE_CHECKING, Any

from cmmlink.errors import PlanError
from cmmlink.version import __version__

if TYPE_CHECKING:
    from cmmlink.plan import Plan, SurfacePlan


@dataclass(frozen=True, slots=True)
class RunInputs:
    """Everything that a run depends on and that its record keeps: the effective plan as YAML, the nominal's file, the software versions.

    plan_file : the name of the plan's file, empty where the plan was made without one
    stack : of a section of a surface its place in its stack and what the stack rests on; None of every other run
    """

    plan: str
    nominal_name: str
    nominal: bytes
    software: Mapping[str, str]
    stack: Mapping[str, Any] | None = None
    plan_file: str = ""

    @classmethod
    def of(cls, plan: "Plan | SurfacePlan", stack: Mapping[str, Any] | None = None) -> "RunInputs":
        """The inputs of a plan as they are at this moment. The user's own register maps become part of the plan. Raises PlanError.

        A map is kept as it was understood, with every default filled in, because a later version may read the same file differently.
        """
        from cmmlink.plan import map_of, with_own_maps  # noqa: PLC0415 - who reads records needs no plans

        try:
            device = with_own_maps(plan.device, lambda own: map_of(own).model_dump(mode="json"))
        except ValueError as error:
            raise PlanError(f"device: {error}") from None
        plan = plan.model_copy(update={"device": device})
        try:
            nominal = plan.nominal_file.read_bytes()
        except OSError as error:
            raise PlanError(f"{plan.nominal_file}: cannot be read: {error.strerror or error}") from error
        return cls(plan.effective_yaml(), plan.nominal_file.name, nominal, software(), stack, plan.file_name)


def software() -> dict[str, str]:
    """Versions of everything that a result depends on."""
    system = {"cmmlink": __version__, "python": platform.python_version(), "machine": f"{platform.system()} {platform.machine()}"}
    return system | {package: _version(package) for package in ("numpy", "scipy", "numba")}


@cache
def _version(package: str) -> str:
    """The version of a package, which is looked up among all that is installed: once, for every section of a stack asks."""
    return metadata.version(package)
