"""What to do about a results database that cannot be used: one sentence behind what the library says of it."""

from pathlib import Path

from cmmlink.errors import PlantError

_ANOTHER = "`cmmlink plant address ADDRESS` names another"
_FILE_REMEDIES = {
    "not a database": f"it is some other file, or damaged; {_ANOTHER}",
    "locked": "another program keeps it busy; try again when that has ended",
    "unable to open": f"this account has to be allowed to read and write it and its folder; or {_ANOTHER}",
    "readonly": f"this account has to be allowed to write it; or {_ANOTHER}",
    "full": "make room on its disk",
}
_SERVER_REMEDIES = {
    "authentication failed": "the password belongs into ~/.pgpass, as HOST:PORT:DATABASE:USER:PASSWORD",
    "no password supplied": "the password belongs into ~/.pgpass, as HOST:PORT:DATABASE:USER:PASSWORD",
    "does not exist": f"have it made on the server; or {_ANOTHER}",
    "permission denied": "its user has to be allowed to make and to change tables in it",
    "connect": f"the server has to run and to be reached from this computer; {_ANOTHER}",
    "resolve": f"the server has to be known by that name to this computer; {_ANOTHER}",
}


def remedy(told: str, *, of_server: bool) -> str:
    """What to do about an error in the words of the library, to stand behind them; empty where nobody knows."""
    known = _SERVER_REMEDIES if of_server else _FILE_REMEDIES
    found = next((words for sign, words in known.items() if sign in told), "")
    return f"; {found}" if found else ""


def require_place(file: Path, *, is_made: bool) -> None:
    """Raise PlantError where a file of results can neither be opened nor made.

    is_made : whether it is made where it is not there yet
    """
    if file.is_dir():
        raise PlantError(f"{file}: is a folder; expected a file of results, like {file / 'plant.sqlite'}; {_ANOTHER}")
    if not file.parent.is_dir():
        raise PlantError(f"{file}: there is no folder {file.parent}; make it, or bring it back, or {_ANOTHER}")
    if not is_made and not file.exists():
        raise PlantError(f"{file}: nothing was pushed there yet: `cmmlink plant push` sends the recorded runs; {_ANOTHER}")
