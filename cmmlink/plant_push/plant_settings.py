"""Where the results of a station go: the file plant.yaml beside its records, or a file of SQLite there where nothing is said."""

import os
from pathlib import Path

from cmmlink.errors import PlantError, YamlError
from cmmlink.plan import Settings, read_model
from cmmlink.plant import address_of

SETTINGS_FILE, RESULTS_FILE = "plant.yaml", "plant.sqlite"
_LONGEST = 10_000
_HEAD = "# Where `cmmlink plant push` and the console send the results of every run. No password stands here: see docs/plant.md.\n"


class PlantSettings(Settings):
    """What plant.yaml says.

    address : postgresql://USER@HOST/DATABASE, or the path of a file; None: a file beside the records
    """

    address: str | None = None


def address_for(records: Path) -> str:
    """Where the results of the station with these records go, as the database takes it. Raises PlantError."""
    given = named_address(records)
    if given is None:
        return address_of(records / RESULTS_FILE)
    is_path = "://" not in given
    return address_of(records / given if is_path else given)


def named_address(records: Path) -> str | None:
    """The address in the settings of the station with these records; None where they name none. Raises PlantError."""
    file = records / SETTINGS_FILE
    try:
        text = file.read_text(encoding="utf-8")[:_LONGEST]
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        told = error.strerror if isinstance(error, OSError) else "it is no text (UTF-8)"
        raise PlantError(f"{file}: cannot be read: {told}; `cmmlink plant address ADDRESS` writes it anew") from None
    try:
        return read_model(text, PlantSettings).address
    except YamlError as error:
        raise PlantError(f"{file}: {error}") from None


def keep_address(records: Path, address: str) -> None:
    """Write plant.yaml. Raises PlantError for what is no address, and where it cannot be written."""
    address_of(address)
    file = records / SETTINGS_FILE
    try:
        records.mkdir(parents=True, exist_ok=True)
        new = file.with_name(f"{file.name}.{os.getpid()}")
        new.write_text(f"{_HEAD}address: {_quoted(address)}\n", encoding="utf-8")
        new.replace(file)
    except OSError as error:
        raise PlantError(f"{file}: cannot be written: {error.strerror or error}") from None


def _quoted(address: str) -> str:
    return "'" + address.replace("'", "''") + "'"
