"""The command that checks what a result states of every placement of a part, by code of its own."""

import json
from pathlib import Path
from typing import Annotated

import typer

from cmmlink.commands.exit_codes import NO_RECORD
from cmmlink.commands.options import Json
from cmmlink.commands.output import print_json
from cmmlink.errors import PlanError

_PROVES = "Checked from the points, the pose and the nominal in the file alone; that they are those of the part is what the record proves."


def verify_zone(
    file: Annotated[Path, typer.Argument(metavar="zone.json", help="The proofs of zones that a run has written.")],
    as_json: Json = False,
) -> int:
    """Check the minimum zones and least consumptions of a result without the code that found them.

    It is shown anew that no rigid motion brings the named points into a smaller zone, or into a smaller share of a zone that varies. Exit
    status 0 only where all is as stated.
    """
    from cmmlink.zone_check import check_zones

    try:
        stated = json.loads(file.read_bytes())
    except OSError as error:
        raise PlanError(f"{file}: {error.strerror or error}") from None
    except (ValueError, RecursionError):  # no text, no JSON, or JSON without end
        raise PlanError(f"{file}: is no JSON; expected the zone.json that a run wrote beside its result") from None
    try:
        found = check_zones(stated)
    except ValueError as error:
        raise PlanError(f"{file}: {error}") from None
    sound = all(not zone.problem for zone in found)
    if as_json:
        zones = [{"name": zone.name, "verified": not zone.problem, "problem": zone.problem, "boxes": zone.boxes} for zone in found]
        print_json({"verified": sound, "zones": zones})
    else:
        for zone in found:
            typer.echo(zone.words)
        typer.echo(_PROVES)
    return 0 if sound else NO_RECORD
