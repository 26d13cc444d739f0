"""How every plan is spelled in full, and the name of the file that it was read from."""

import json
from functools import lru_cache
from typing import Self

import yaml
from pydantic import PrivateAttr

from cmmlink.plan.yaml_model import Settings


class Spelled(Settings):
    """A plan of any kind."""

    _file_name: str = PrivateAttr("")

    @property
    def file_name(self) -> str:
        """The name of the file that the plan was read from; empty where it was made without one."""
        return self._file_name

    def named(self, file_name: str) -> Self:
        """The same plan, read from a file of this name."""
        plan = self.model_copy()
        plan._file_name = file_name
        return plan

    def effective_yaml(self) -> str:
        """Spell the plan with every default filled in and every path absolute; as a plan it means the same."""
        return "".join(_spelled(key, json.dumps(value)) for key, value in self.model_dump(mode="json").items())


@lru_cache(maxsize=64)
def _spelled(key: str, value_json: str) -> str:
    """One key of a plan as YAML. The sections of a stack share all but one of theirs, and to spell twenty characteristics takes 10 ms."""
    return yaml.safe_dump({key: json.loads(value_json)}, sort_keys=False, allow_unicode=True)
