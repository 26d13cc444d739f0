"""The command that shows whether records were altered, who signed them, and whether anything of them was cut off."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.exit_codes import NO_RECORD, fail
from cmmlink.commands.options import Json, Records, records_folder
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError, RunError
from cmmlink.words import printable

if TYPE_CHECKING:
    from cmmlink.record import Head, Store

_MOST_TOLD = 5
_PROVES = (
    "This shows that the file fits together as it is. It does not show a file that was written anew, hashes and all, or whose last runs "
    "were cut off: a key that you were given (--key), an anchor (--anchors), or a result that was kept elsewhere (--against) does."
)
_PROVES_SIGNED = (
    "Whoever may write the file but has not the key could not have written these runs anew. Whether later ones were cut off, an anchor "
    "shows (--anchors), or a result that was kept elsewhere (--against)."
)
_PROVES_AGAINST = (
    "The result of run {run} and the records agree: nothing up to the end of that run was changed, cut off or added since the result was "
    "written. What was recorded later is not covered by it."
)
_PROVES_OF_MERGED = (
    "The result of run {run} and the records agree: the run was merged from another station, and nothing of it was changed since the "
    "result was written there. The other records are not covered by it."
)
_KNOWN = {
    "given": "which you gave",
    "station": "this station's, as station.pub beside the records has it",
    "handed over": "an earlier or later one of this station, as both keys have signed",
    "another": "which is none that is known here: compare it with what `cmmlink key show` says at the station that measured",
    "evidence": "which stands in the evidence itself: compare it with one that you were given, or give that with --key",
}


def verify(
    name: Annotated[str | None, typer.Argument(metavar="[RUN]", help="One run; without it all records.")] = None,
    key: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE_OR_HEX", help="A public key that you were given, or its id: no other counts. As often as wanted."),
    ] = None,
    anchors: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="An anchor, which holds how the records ended. As often as wanted.")
    ] = None,
    against: Annotated[
        Path | None, typer.Option(metavar="result.json", help="Hold a result file against all records, which its hash covers.")
    ] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Show whether a record was altered, who signed it, and whether anything of it was cut off.

    Told apart are: intact and signed, signed by another key, intact but unsigned, altered, and cut off after an anchored head. A chain
    alone has no key: whoever may write the file can write it anew, hashes and all. Exit status 0 only where nothing was altered or cut
    off and, with --key, where every run is signed by a key that was given.
    """
    from cmmlink.record import check_chain, disagreements, heads_in, open_to_read, origin_of, read_result, trust_in

    result = None if against is None else read_result(against)
    keys = _public_keys(key or ())
    heads = None if anchors is None else [head for file in anchors for head in heads_in(file)]
    with open_to_read(records_folder(records), now, close_interrupted=False) as store:
        run = _run_named(store, name, heads or ()) if name else None
        if result is not None and run not in (None, result["run"]):
            raise PlanError(f"{against}: it is the result of run {result['run']}, not of run {run}")
        asked = None if result is not None else run
        with progress("recomputing the hashes"):
            found = trust_in(store, check_chain(store, asked), asked, keys, heads)
        if result is not None:
            told = [] if found["altered"] else disagreements(store, result)
            origin = None if told or found["altered"] else origin_of(store, result["run"])
            taken_over = origin is not None and origin.chain_sha256 == result["chain_sha256"]
            found["against"] = {"run": result["run"], "disagreements": told, "taken_over": taken_over}
    if as_json:
        print_json(found)
    problem = _problem(found, bool(keys))
    if problem:
        return NO_RECORD if as_json else fail(problem, NO_RECORD)
    if not as_json:
        for line in _words(found):
            typer.echo(printable(line))
    return 0


def _public_keys(given: Sequence[str]) -> list[str]:
    if not given:
        return []
    from cmmlink.record import public_key_given  # this loads the library of signatures

    return [public_key_given(one) for one in given]


def _run_named(store: "Store", name: str, heads: Sequence["Head"]) -> str | None:
    """The id of the run that a name means; None, which asks for all, where the run is not there but stands in an anchor."""
    from cmmlink.record import find_run

    try:
        return find_run(store, name)
    except RunError:
        if any(head.run == name for head in heads):
            return None
        raise


def _problem(found: Mapping[str, Any], keys_given: bool) -> str:
    """What makes that the records, or a result, do not stand as they were written; nothing where they do."""
    if found["state"] == "cut off":
        lost = found["anchors"]["missing"]
        return (
            f"cut off after an anchored head: {_named(lost)} stood at the end of the records when the anchor was written, and "
            f"{'is' if len(lost) == 1 else 'are'} not in them: deleted, or an older backup stands in their place. Where two folders of one "
            "computer are anchored in one file, give each a name of its own (the key records.station of a plan)"
        )
    if found["altered"]:
        return str(found["first"]["message"])
    against = found.get("against")
    if against and against["disagreements"]:
        told = against["disagreements"]
        more = len(told) - _MOST_TOLD
        return "; ".join(told[:_MOST_TOLD]) + (f"; and {more} more" if more > 0 else "")
    if keys_given and found["state"] != "intact and signed":
        return f"{found['state']}: " + "; ".join(_signature_words(found))
    return ""


def _words(found: Mapping[str, Any]) -> list[str]:
    """What was found of records that nobody altered, and what that proves."""
    lines = [f"nothing was altered: {found['records']} records, chain {found['chain_sha256']}", f"{found['state']}: "]
    lines[1] += "; ".join(_signature_words(found))
    lines += _stamp_words(found["timestamps"])
    anchors = found["anchors"]
    if anchors is not None:
        lines.append(_anchor_words(anchors))
    against = found.get("against")
    if against:
        lines.append((_PROVES_OF_MERGED if against["taken_over"] else _PROVES_AGAINST).format(run=against["run"]))
    elif anchors is None or not anchors["heads"]:
        lines.append(_PROVES_SIGNED if found["state"] == "intact and signed" else _PROVES)
    return lines


def _signature_words(found: Mapping[str, Any]) -> list[str]:
    """Who signed how many runs, and which are not signed."""
    from drivers import count_of

    told = found["signatures"]
    words = [f"{count_of(one['runs'], 'run')} signed by the key {one['key_id']}, {_KNOWN[one['known_as']]}" for one in told["keys"]]
    if told["unsigned"]:
        words.append(f"{_named(told['unsigned'])} not signed: whoever may write the file could have written that anew")
    return words or ["there is no run"]


def _stamp_words(stamps: Sequence[Mapping[str, str]]) -> list[str]:
    if not stamps:
        return []
    last = stamps[-1]
    check = f"openssl ts -verify -digest {last['chain_sha256']} -in timestamp.tsr -CAfile CERTIFICATE"
    return [
        f"time stamps: {len(stamps)}, the last of run {last['run']}, which its authority says it saw at {last['stamped']}; of what "
        f"`cmmlink export` writes, `{check}` shows whether it does"
    ]


def _anchor_words(anchors: Mapping[str, Any]) -> str:
    from drivers import count_of

    others = ", ".join(f"{station} ({heads})" for station, heads in anchors["others"].items())
    beside = f"; heads of other stations in it: {others}" if others else ""
    if not anchors["heads"]:
        return f"the anchor holds no head of these records{beside}"
    heads = count_of(anchors["heads"], "head")
    return f"not cut off: as {heads} of the anchor say, the last that of run {anchors['last']}; what came later is not covered{beside}"


def _named(runs: Sequence[str]) -> str:
    more = f" and {len(runs) - _MOST_TOLD} more" if len(runs) > _MOST_TOLD else ""
    return f"{'run' if len(runs) == 1 else 'runs'} {', '.join(runs[:_MOST_TOLD])}{more}"
