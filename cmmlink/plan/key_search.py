"""The keys of all plans as a person looks them up in a terminal: all of them, a group, or one, with an example."""

import difflib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

from pydantic import BaseModel

from cmmlink.errors import PlanError
from cmmlink.plan.examples import example_at
from cmmlink.plan.reference import REQUIRED, groups_of
from cmmlink.plan.scan import Plan
from cmmlink.plan.surface import CtPlan
from cmmlink.plan.whole_surface import SurfacePlan

_KINDS: Mapping[str, type[BaseModel]] = {"a scan": Plan, "a CT surface": CtPlan, "a whole surface": SurfacePlan}
_TAG = re.compile(r" \(type: (\S+)\)")


@dataclass(frozen=True, slots=True)
class KeyEntry:
    """One key of a plan.

    name    : dotted, like tolerance.lower_mm
    of_type : the type of the mapping that it belongs to, where several may stand there, like serial
    plans   : the kinds of plans that have it
    """

    name: str
    of_type: str
    takes: str
    default: str
    meaning: str
    example: str
    plans: tuple[str, ...]

    @property
    def lines(self) -> Iterator[str]:
        """The entry for a terminal."""
        kind = f"  (type: {self.of_type})" if self.of_type else ""
        only = "" if len(self.plans) == len(_KINDS) else f"; in plans of {' and of '.join(self.plans)} only"
        default = "required" if self.default == REQUIRED else f"default {self.default}"
        yield f"{self.name}{kind}"
        yield f"    {self.takes}; {default}{only}"
        yield f"    {self.meaning}"
        if self.example:
            yield f"    for example  {self.example}"


@lru_cache(maxsize=1)
def all_keys() -> tuple[KeyEntry, ...]:
    """Every key of every plan, in the order of the reference."""
    found: dict[tuple[str, str, str], KeyEntry] = {}
    for kind, model in _KINDS.items():
        for group in groups_of(model):
            tag = _TAG.search(group.path)
            bases, of_type = _TAG.sub("", group.path).replace("[]", "").split(", "), tag[1] if tag else ""
            for base, key in product(bases, group.keys):
                name = f"{base}.{key.name}".lstrip(".")
                other = found.get((name, of_type, key.meaning))
                plans = (*(other.plans if other else ()), kind)
                takes, default = (text.replace("`", "") for text in (key.takes, key.default))
                example = example_at(model, name, of_type)
                found[name, of_type, key.meaning] = KeyEntry(name, of_type, takes, default, key.meaning, example, plans)
    return tuple(found.values())


def keys_named(text: str) -> tuple[KeyEntry, ...]:
    """The key of that name, or all of a group, or every key whose last word it is. Raises PlanError, with names that are close."""
    wanted = re.sub(r"\[\d*\]", "", text.strip().lower())
    keys = all_keys()
    within = [key for key in keys if key.name == wanted or key.name.startswith(f"{wanted}.")]
    found = within or [key for key in keys if key.name.rpartition(".")[2] == wanted]
    if found:
        return tuple(found)
    names = sorted({key.name for key in keys} | {key.name.rpartition(".")[2] for key in keys})
    close = difflib.get_close_matches(wanted, names, n=3)
    hint = f"did you mean {' or '.join(close)}? " if close else ""
    raise PlanError(f"no plan has a key {text}; {hint}`cmmlink plan keys` lists them all")
