"""A known pose as a plan gives it: by numbers, or as that of an earlier recorded run, such as the first part of a fixture."""

import hashlib
import json
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from cmmlink.plan.yaml_model import Settings, Text
from drivers import PointFileError, read_bytes


class Datum(Settings):
    """A known pose: the motion that brings section coordinates onto the nominal."""

    rotation_deg: float = Field(default=0.0, description="the rotation about the section's origin, counterclockwise")
    translation_mm: tuple[float, float] = Field(default=(0.0, 0.0), description="the translation after the rotation")
    result: Path | None = Field(
        default=None,
        description="in place of both, the result.json of an earlier recorded run, such as that of the first part of a fixture: its pose "
        "is taken over. The nominal must be the same, and so must the fixture and the section's plane",
    )
    run: Text | None = Field(default=None, description="that run; it is filled in, with the pose, when the plan is read")
    chain_sha256: Text | None = Field(default=None, description="the hash of that run's last record; it is filled in likewise")

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        by_numbers = bool(self.model_fields_set & {"rotation_deg", "translation_mm"})
        if (self.run is None) != (self.chain_sha256 is None) or (self.run is not None and self.result is None):
            raise ValueError("result alone: run and chain_sha256 are filled in")
        if self.result is not None and by_numbers and self.run is None:
            raise ValueError("either result, or rotation_deg and translation_mm")
        return self

    @property
    def words(self) -> str | None:
        """Where the pose comes from, where it was not given by numbers."""
        if self.run is None:
            return None
        return (
            f"the datum is the pose of run {self.run} (chain {self.chain_sha256}), taken over from {self.result}; "
            "how uncertain that pose is was not stated, and U holds none of it"
        )

    def taken_over(self, nominal: Path) -> "Datum":
        """The datum with the pose of the run that it names. Raises ValueError for a result that gives no pose for this nominal."""
        if self.result is None or self.run is not None:
            return self
        found = _result(self.result)
        name = self.result.name
        if not isinstance(found.get("run"), str) or not isinstance(found.get("chain_sha256"), str):
            raise ValueError(f"{name} is of no recorded run: what is taken over must be on record")
        if found.get("ending") != "complete" or not found.get("complete"):
            raise ValueError(f"{name} is of a run that did not come to its end")
        pose = found.get("registration")
        if not isinstance(pose, dict) or not pose.get("converged") or pose.get("other_poses"):
            raise ValueError(f"{name} has no pose that settled and is the only one that fits")
        try:
            same = hashlib.sha256(read_bytes(nominal)).hexdigest() == found.get("nominal_sha256")
        except PointFileError as error:
            raise ValueError(str(error)) from None
        if not same:
            raise ValueError(f"{name} was measured against another nominal than {nominal.name}, or against another state of that file")
        told = {"rotation_deg": pose["rotation_deg"], "translation_mm": tuple(pose["translation_mm"])}
        return Datum.model_validate({**told, "result": self.result, "run": found["run"], "chain_sha256": found["chain_sha256"]})


def _result(path: Path) -> dict[str, Any]:
    """The object in a result.json. Raises ValueError for a file that is none."""
    try:
        found = json.loads(read_bytes(path))
    except PointFileError as error:
        raise ValueError(str(error)) from None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ValueError(f"{path.name} is no result.json of a run")
    return found
