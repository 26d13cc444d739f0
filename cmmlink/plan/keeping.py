"""What a plan says of its records: where they are kept, who signs the runs, and which places outside are told how the records end."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from cmmlink.plan.yaml_model import Settings, Text

RECORDS = (
    "where runs are recorded: a folder, null, or a mapping with folder, key, anchor, timestamp and station; null: the user's own folder. "
    "A console keeps all its runs in one folder"
)


def _as_several(given: object) -> object:
    """One place as a list of one."""
    return [given] if isinstance(given, (str, Path)) else given


class RecordKeeping(Settings):
    """Where the runs are recorded, and what makes sure that no record is written anew afterwards."""

    folder: Path | None = Field(default=None, description="the folder of the run records; null: the user's own")
    key: Path | None = Field(
        default=None,
        description="the file of a private key that somebody else keeps, as on a stick, which signs the runs while it is there; null: the "
        "station's own, which is made beside the records at the first run",
    )
    anchor: Annotated[tuple[Path, ...], BeforeValidator(_as_several, json_schema_input_type=Path | tuple[Path, ...])] = Field(
        default=(),
        description="a file outside this computer, or several, to which a line with the hash of every run is added, like "
        "//server/share/heads.txt; one that cannot be reached is told at the next run",
    )
    timestamp: Annotated[str, Field(pattern=r"^https?://[!-~]+$", max_length=500)] | None = Field(
        default=None,
        description="the address of an authority that stamps the hash of every run with the time (RFC 3161), like https://tsa.example; "
        "one that cannot be reached is asked at the next run",
    )
    station: Text | None = Field(
        default=None, description="the name of the station in the records and in the lines of anchor; null: the name of this computer"
    )

    @property
    def places(self) -> tuple[str, ...]:
        """Every place outside that is told how a run ended."""
        return (*map(str, self.anchor), *filter(None, [self.timestamp]))

    def with_path_from(self, folder: Path) -> "RecordKeeping":
        """Give the same with its paths absolute, seen from a folder."""
        update: dict[str, Any] = {"anchor": tuple(folder / place for place in self.anchor)}
        update |= {"folder": folder / self.folder} if self.folder is not None else {}
        update |= {"key": folder / self.key} if self.key is not None else {}
        return self.model_copy(update=update)


def _as_mapping(given: object) -> object:
    """A folder alone, or null, as the mapping that it is short for."""
    return given if isinstance(given, (dict, RecordKeeping)) else {"folder": given}


RecordsOrFolder = Annotated[RecordKeeping, BeforeValidator(_as_mapping, json_schema_input_type=RecordKeeping | Path | None)]
