"""A plan made of what was given one by one: by the options of a command, or by the arguments of a call."""

from collections.abc import Mapping
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from cmmlink.errors import PlanError
from cmmlink.plan.yaml_model import words_of_allowed

Model = TypeVar("Model", bound=BaseModel)


def plan_given_by(model: type[Model], settings: Mapping[str, object], name_of: Mapping[str, str]) -> Model:
    """Validate a plan that is made of options or arguments. Raises PlanError, which names the one that is wrong.

    name_of : maps a key of the plan, or a group of keys, to the option or argument that sets it; other keys have their own name
    """
    try:
        return model.model_validate(settings)
    except ValidationError as failure:
        problem = failure.errors()[0]
        place = ".".join(str(part) for part in problem["loc"])
        if problem["type"] == "extra_forbidden":
            raise PlanError(f"{place}: this is no key of a plan; `cmmlink plan keys` lists those there are") from None
        name = next((name for key, name in name_of.items() if f"{place}.".startswith(f"{key}.")), place or "the options")
        if problem["type"] == "missing":
            raise PlanError(f"{name} is missing") from None
        value = problem["input"]
        found = f" is {value:g}" if isinstance(value, int | float) and not isinstance(value, bool) else ""
        raise PlanError(f"{name}{found}: expected {words_of_allowed(problem)}") from None
