"""Commands on what was recorded: list, show, judge again."""

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cmmlink.commands.exit_codes import EXIT_OF, NO_RECORD, UNUSABLE, fail, say
from cmmlink.commands.options import Json, Out, Records, RunName, RunOrFolder, records_folder, settings_in, who_asks
from cmmlink.commands.output import now, print_json, terminal
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError, RunError, YamlError
from cmmlink.version import RESULT_SCHEMA
from cmmlink.words import answer_words, headline_of, judgement_words, local_words, printable, section_words, utc_words
from inspection import Method, Verdict

if TYPE_CHECKING:
    from cmmlink.record import Evidence, RecordedRun, Replay, Store, SurfaceReplay

VerdictSought = Literal["conform", "nonconform", "uncertain", "none"]
SortKey = Literal["started", "part", "serial_number", "operator", "plan_file", "state", "verdict"]

_DETAILS = ("run", "started", "ended", "state", "message", "verdict", "part", "serial_number", "operator", "device", "chain_sha256")
_DAYS = ["%Y-%m-%d"]
_LONGEST_HEADLINE = len("INTERRUPTED AT 99 %")


def runs(
    part: Annotated[str, typer.Option(metavar="TEXT", help="Only runs of parts whose name holds this.")] = "",
    serial: Annotated[str, typer.Option(metavar="TEXT", help="Only serial numbers that hold this.")] = "",
    operator: Annotated[str, typer.Option(metavar="TEXT", help="Only operators whose name holds this.")] = "",
    plan: Annotated[str, typer.Option(metavar="TEXT", help="Only plans whose file name holds this.")] = "",
    verdict: Annotated[VerdictSought | None, typer.Option(help="Only this verdict; none: ended early, or no verdict.")] = None,
    since: Annotated[datetime | None, typer.Option(formats=_DAYS, help="Only runs of this day or later.")] = None,
    until: Annotated[datetime | None, typer.Option(formats=_DAYS, help="Only runs of this day or earlier.")] = None,
    sort: Annotated[SortKey, typer.Option(help="What the list is sorted by; runs alike stay in the order of time.")] = "started",
    records: Records = None,
    as_json: Json = False,
) -> int:
    """List the recorded runs, all or those that are looked for."""
    from cmmlink.record import RunSearch, list_runs

    days = [None if day is None else day.date() for day in (since, until)]
    search = RunSearch(part, serial, operator, plan, verdict or "", *days)
    found = list_runs(records_folder(records), now, deciding=True, search=search)
    found.sort(key=lambda entry: str(entry[sort] or "").casefold())
    if as_json:
        from cmmlink.result_keys import RunLine

        optional = ("stack", "decided_by")
        print_json({"runs": [{key: entry[key] for key in RunLine.model_fields if key not in optional or entry[key]} for entry in found]})
        return 0
    for entry in found:
        received = "-" if entry["received"] is None else entry["received"]
        head = f"{entry['run']}  {_local(entry['started']):<25}  {entry['state']:<11}  {_headline(entry):<{_LONGEST_HEADLINE}}"
        decided = f"  decided by {entry['decided_by']}" if entry["decided_by"] else ""
        _say(f"{head}  {received:>9} points  {_part_in(entry)}{decided}")
    if not found:
        sought = "no such run was recorded" if search != RunSearch() else "no run was recorded yet"
        _say(f"{sought} in {records_folder(records)}")
    return 0


def _headline(entry: Mapping[str, Any]) -> str:
    """The verdict of a run on record, or how early it ended, in the words of the page and the summary."""
    verdict = Verdict[entry["verdict"].upper()] if entry["verdict"] else None
    return headline_of(verdict, entry["state"], entry.get("coverage")).words


def _part_in(entry: Mapping[str, Any]) -> str:
    return " ".join(filter(None, [entry["part"], entry["serial_number"], section_words(entry.get("stack"))]))


def _local(recorded: str | None) -> str:
    """A recorded moment as people of this place read it."""
    return local_words(datetime.fromisoformat(recorded)) if recorded else "-"


def show(name: RunName, records: Records = None, as_json: Json = False) -> int:
    """Show one recorded run."""
    from cmmlink.record import describe, find_run, open_to_read

    with open_to_read(records_folder(records), now) as store:
        found = describe(store, find_run(store, name))
    if as_json:
        print_json(found)
        return 0
    _say(f"{_headline(found)}   {_part_in(found)}".rstrip())
    for key in _DETAILS:
        if found[key] and (key != "verdict" or found["state"] == "complete"):
            value = _local(found[key]) if key in ("started", "ended") else found[key]
            _say(f"{key:<14} {value}{' (simulated)' if key == 'device' and found['simulated'] else ''}")
    for note in found.get("notes", ()):
        _say(f"note: {note}")
    for key in ("software", "recorded"):
        _say(f"{key:<14} {', '.join(f'{name} {value}' for name, value in found[key].items() if value)}")
    if (signature := found["signature"]) is not None:
        _say(f"{'signed':<14} by the key {signature['key_id']}")
    _say_answer(found)
    for told in found["anchors"]:
        _say(f"{'anchor':<14} {told['place']}: {'not told, ' + told['problem'] if told['problem'] else 'told'}")
    if (origin := found["origin"]) is not None:
        _say(f"{'origin':<14} merged {_local(origin['merged'])} from {origin['file']}, its chain there {origin['chain_sha256']}")
    for judged in found["derived"]:
        _say(f"{'judged again':<14} {judgement_words(judged)}")
    for event in found["events"]:
        told = ", ".join(f"{name} {value}" for name, value in event.items() if name not in ("event", "time_s", "after_points"))
        _say(f"  {event['time_s'] - found['clock_s']:9.3f} s  after {event['after_points']} points: {event['event']} {told}")
    _say("\n" + found["plan"].rstrip())
    return 0


def _say_answer(found: Mapping[str, Any]) -> None:
    """Say what a machine tool was told of a run, or that the records do not say so, though the plan asks for an answer."""
    if found["answer"] is not None:
        _say(f"{'answer':<14} {answer_words(found['answer'])}")
    elif found["state"] != "running" and "answer" in found["plan"] and "answer: null" not in found["plan"].splitlines():
        from cmmlink.plan import texts_of

        with suppress(YamlError):
            if "answer.file" in texts_of(found["plan"]):
                _say(f"{'answer':<14} none is on record, though the plan asks for one: whether the machine was told is not known")


def _say(text: str) -> None:
    """Print what stands in the records; nothing there may steer the terminal."""
    typer.echo(printable(text))


def replay(
    name: RunOrFolder,
    tolerance: Annotated[tuple[float, float] | None, typer.Option(metavar="LO HI", help="Judge with another tolerance, mm.")] = None,
    method: Annotated[Method | None, typer.Option(help="Judge with another method.")] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Judge with another value of any key of the plan; as often as wanted."),
    ] = None,
    reason: Annotated[
        str | None, typer.Option("--reason", metavar="TEXT", help="Why: what was found is then kept in the records, chained to the run.")
    ] = None,
    operator: Annotated[
        str | None, typer.Option("--operator", metavar="O", help="Who judges again.", show_default="the user of this computer")
    ] = None,
    out: Out = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Judge a recorded run once more; with nothing changed the result is the same to the last bit.

    With --set, --tolerance or --method it is another judgement. The record of the run stays as it is; with a --reason, which --set asks
    for, the new judgement is added to the records with who, when and why, and `cmmlink show` tells it.

    FOLDER is what `cmmlink export RUN --out FOLDER` wrote, on this computer or another. Its hashes are recomputed, and it needs no records
    here: `cmmlink merge FOLDER` adds it to them.
    """
    from cmmlink.devices import decoder_of
    from cmmlink.record import keep_judgement, open_to_record, recorded_run, replay_run, replay_surface, seal_of
    from cmmlink.result_json import number

    changes = settings_in(settings or ())
    if changes and not (reason or "").strip():
        raise PlanError("--set judges a recorded run anew: expected --reason TEXT, which is kept with the judgement")
    if reason is not None and not (changes or tolerance or method):
        raise PlanError("--reason is for a judgement with something changed; expected --set, --tolerance or --method beside it")
    folder = records_folder(records)
    with ExitStack() as opened:
        store, run, evidence = _run_or_evidence(opened, name, folder)
        recorded = recorded_run(store, run)
        if reason is not None and evidence is not None:
            raise PlanError(f"{name}: a judgement with a --reason is kept in the records; add this run to them first: cmmlink merge {name}")
        if reason is not None and recorded.end is None:
            raise PlanError(f"run {recorded.run} has no end yet: it can be judged again when it has")
        with progress(f"judging run {recorded.run} again"):
            judge = replay_surface if recorded.is_of_surface else replay_run
            again: Replay | SurfaceReplay = judge(store, recorded, decoder_of, tolerance=tolerance, method=method, settings=changes)
    kept = None
    if reason is not None:
        with open_to_record(folder, now) as store:
            seal = seal_of(store, station=None, key=again.plan.records.key)
            kept = keep_judgement(store, recorded, again, who=who_asks(operator), why=reason.strip(), now=now(), seal=seal)
        for note in seal.notes:
            say(note.replace("the run is", "the judgement is"))
    document = {"schema": RESULT_SCHEMA, **again.result_json} | {
        "replay_of": recorded.run,
        "chain_sha256": recorded.chain_sha256 if evidence is None else evidence.chain_sha256,
        "identical": again.agreement.identical,
        "same_decision": again.agreement.same_decision,
        "apart": None if again.agreement.apart is None else number(again.agreement.apart),
        "result_sha256": again.agreement.result_sha256,
        "decision_sha256": again.agreement.decision_sha256,
    }
    document |= {"ending": again.outcome.ending, "measured_at": utc_words(datetime.fromisoformat(recorded.header["started"]))}
    notes = (*again.notes, *([] if evidence is None else [evidence.words]))
    document |= {"notes": list(notes)}
    document |= {"changed": [asdict(change) for change in again.changed], "differs": [asdict(change) for change in again.agreement.differs]}
    document |= {"derived": kept}
    if out is not None:
        _write_replay(out, again, document, recorded)
    if as_json:
        print_json(document)
    else:
        _print_replay(again, recorded.run, document, notes)
        if kept is not None:
            _say(f"kept as record {kept['record']}, chained to run {recorded.run}: {kept['who']}, {kept['why']}")
    if again.agreement.identical is False and not again.changed and not again.agreement.holds:
        return fail(f"run {recorded.run}: nothing was changed, yet the result is not the recorded one", NO_RECORD)
    return UNUSABLE if again.outcome.result is None else EXIT_OF[again.outcome.result.verdict]


def _write_replay(out: Path, again: "Replay | SurfaceReplay", document: dict[str, Any], recorded: "RecordedRun") -> None:
    from cmmlink.from_surface_plan import held_against
    from cmmlink.record import Replay
    from cmmlink.report import input_of_replay, write_results, write_surface

    report = input_of_replay(again, document, recorded)
    with progress(f"writing results to {out}"):
        if isinstance(again, Replay):
            title = f"{recorded.header['part']}, run {recorded.run} replayed"
            write_results(out, document, again.outcome.result, again.profile, title, report=report)
        else:
            write_surface(out, report, again.outcome.result, held_against(again.plan, again.file))


def _run_or_evidence(opened: ExitStack, name: str, folder: Path) -> tuple["Store", str, "Evidence | None"]:
    """The records that hold the run of a name, its id, and what it was exported to where the name is that of a folder. Raises RunError.

    A run of the records comes before a folder of the same name; what has a slash in it is a folder.
    """
    from cmmlink.record import find_run, open_evidence, open_to_read

    if not any(sign in name for sign in (os.sep, os.altsep) if sign):
        try:
            store = opened.enter_context(open_to_read(folder, now))
            return store, find_run(store, name), None
        except RunError:
            if not Path(name).is_dir():
                raise
    evidence = opened.enter_context(open_evidence(Path(name), now))
    return evidence.store, evidence.run, evidence


def _print_replay(again: "Replay | SurfaceReplay", run_id: str, document: Mapping[str, Any], notes: Sequence[str]) -> None:
    from cmmlink.record import Replay
    from cmmlink.report import print_summary, print_surface_summary

    heading = f"run {run_id}, judged again"
    if isinstance(again, Replay):
        print_summary(terminal(), again.outcome.result, again.outcome.counts, heading, again.outcome.ending, notes)
    else:
        print_surface_summary(terminal(), document, heading, notes)
    for title, changes in (("changed", again.changed), ("differs", again.agreement.differs)):
        for change in changes:
            typer.echo(f"{title}: {change.key} {change.recorded} -> {change.replayed}")
    if again.agreement.identical is None:
        typer.echo(f"run {run_id} has no recorded result to compare with")
    elif again.agreement.identical:
        typer.echo(f"identical to the recorded result of run {run_id}, to the last bit")
        typer.echo(f"SHA-256 of the result and of every deviation: {again.agreement.result_sha256}")
    else:
        typer.echo(again.agreement.words)
    typer.echo(f"SHA-256 of what was decided: {again.agreement.decision_sha256}")
