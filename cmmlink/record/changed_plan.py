"""The plan of a recorded run with some of its values changed, as `replay --set` asks for it."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import ValidationError

from cmmlink.errors import PlanError, YamlError
from cmmlink.plan import CtPlan, Plan, SurfacePlan, value_of, words_of_allowed

AnyPlan = TypeVar("AnyPlan", Plan, SurfacePlan, CtPlan)

# Keys that have no part in judging, or stand for what is on record itself.
_SETTLED = (
    "buffer_points",
    "cut",
    "device",
    "mesh",
    "nominal.file",
    "surface.file",
    "operator",
    "out",
    "part",
    "records",
    "registration.datum.result",
    "report",
    "sections",
    "serial_number",
    "stack_fit",
)


def with_changes(plan: AnyPlan, tolerance: tuple[float, float] | None, method: str | None, settings: Mapping[str, str]) -> AnyPlan:
    """The plan with another tolerance, another method, and other values of keys. Raises PlanError where that cannot be."""
    document = plan.model_dump()
    if tolerance is not None and plan.tolerance is None:
        raise PlanError("the recorded plan has no tolerance to be changed: its characteristics have limits of their own")
    if tolerance is not None:
        document["tolerance"] |= {"lower_mm": tolerance[0], "upper_mm": tolerance[1]}
    if method is not None:
        document["registration"]["method"] = method
    for key, text in settings.items():
        _set(document, key, text)
    try:
        return type(plan).model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        key, told = ".".join(map(str, first["loc"])), words_of_allowed(first)
        if first["type"] == "extra_forbidden":
            raise PlanError(f"the recorded plan cannot be changed so: {key} is no key of a plan; `cmmlink plan keys` lists them") from None
        if first["type"] == "missing":
            raise PlanError(f"the recorded plan cannot be changed so: {key} is missing; set it as well") from None
        raise PlanError(f"the recorded plan cannot be changed so: {key} is {first['input']!r}; expected {told}") from None


def _set(document: dict[str, Any], key: str, text: str) -> None:
    """Set a dotted key of a plan. Raises PlanError for what has no part in judging, and where there is no such place."""
    settled = next((one for one in _SETTLED if f"{key}.".startswith(f"{one}.")), None)
    if settled is not None:
        raise PlanError(f"{key} cannot be changed: what arrived, and the nominal it was held against, are those on record ({settled})")
    *groups, last = key.split(".")
    here: Any = document
    for group in groups:
        if isinstance(here, dict) and here.get(group) is None:
            here[group] = {}  # whether there is such a group of keys is told with the rest
        here = _within(here, group, key)
    value = _value_of(key, text)
    if isinstance(here, list):
        here[_index(here, last, key)] = value
    elif isinstance(here, dict):
        here[last] = value
    else:
        raise PlanError(f"{key}: there are no keys below {'.'.join(groups)}; `cmmlink plan keys` lists those there are")


def _within(here: Any, group: str, key: str) -> Any:
    if isinstance(here, list | tuple):
        return here[_index(here, group, key)]
    if isinstance(here, dict):
        if isinstance(here[group], tuple):
            here[group] = list(here[group])
        return here[group]
    raise PlanError(f"{key}: there are no keys below {group}; `cmmlink plan keys` lists those there are")


def _index(items: Sequence[Any], name: str, key: str) -> int:
    """The place in a list by its number, from 0 as messages about plans count, or by the name of what stands there."""
    named = [place for place, item in enumerate(items) if isinstance(item, dict) and item.get("name") == name]
    place = int(name) if name.isdecimal() and len(name) < 7 else None
    if named or (place is not None and place < len(items)):
        return named[0] if named else place or 0
    raise PlanError(f"{key}: there is no {name} among {len(items)}; expected its name, or its number from 0")


def _value_of(key: str, text: str) -> Any:
    try:
        return value_of(text)
    except YamlError as error:
        raise PlanError(f"{key}={text}: {error}") from None
