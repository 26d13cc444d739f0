"""What a plan says of its results: where they go, and in which formats beside those of every run."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from cmmlink.plan.formats import FormatName
from cmmlink.plan.yaml_model import Settings
from cmmlink.result_folder import check_placeholders

OUT = "where the results go: a folder, null, or a mapping with folder and formats; null: no results are written"


def _with_known_placeholders(folder: Path) -> Path:
    check_placeholders(folder)
    return folder


class Results(Settings):
    """Where the results of a run go, and what is written beside result.json, tables, pictures and report."""

    folder: Annotated[Path, AfterValidator(_with_known_placeholders)] | None = Field(
        default=Path("results/{part}/{serial}_{run}"),
        description="the folder, like results/{part}/{serial}_{run}, seen from the plan; null: no results are written. What an earlier run "
        "left in the same folder is moved aside, never overwritten",
    )
    formats: tuple[FormatName, ...] = Field(
        default=(),
        description="further formats of the results, like [qif, xlsx]: qif (QIF 3.0), dfq (Q-DAS), xlsx (Excel), csv; json is result.json",
    )

    def with_path_from(self, folder: Path) -> "Results":
        """Give the same with its folder absolute, seen from a folder."""
        return self.model_copy(update={"folder": folder / self.folder}) if self.folder is not None else self


def _as_mapping(given: object) -> object:
    """A folder alone, or null, as the mapping that it is short for."""
    return given if isinstance(given, (dict, Results)) else {"folder": given}


ResultsOrFolder = Annotated[Results, BeforeValidator(_as_mapping, json_schema_input_type=Results | Path | None)]
NO_RESULTS = Results(folder=None)
