"""What a worker does: it judges the runs of a task again, one after another, from the file of records that the task names.

A worker keeps the nominals that it built, for the runs of an archive share a few. What it finds depends on the record and the settings
alone: not on the worker, the task, or the order.
"""

import platform
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from cmmlink.archive.tasks import Failure, Outcome, RunAsked, Task
from cmmlink.devices import decoder_of
from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.plan import Plan, SurfacePlan
from cmmlink.record import (
    Nominals,
    RecordedRun,
    Replay,
    Store,
    SurfaceReplay,
    judgement_of,
    means_of,
    recorded_plan,
    recorded_run,
    recorded_surface_plan,
    replay_run,
    replay_surface,
    software,
    with_changes,
)
from cmmlink.stack_again import StackAgain, judge_stack_again, settings_of_section
from drivers import DeviceError, PointFileError
from inspection import InspectionError

_NOMINALS = 16  # that a worker keeps: of ten thousand points each holds some megabytes


def judge_runs(task: Task) -> list[Outcome]:
    """Judge the runs of a task again. What cannot be judged is answered with the reason, and keeps none of the others from it."""
    node = platform.node()
    if not task.file.is_file():
        why = Failure("no-record", f"{task.file}: there is no such file on {node}; every worker has to read the archive by this path")
        return [Outcome(one.run, failure=why, node=node) for one in task.runs]
    try:
        with Store(task.file.parent, writing=False, epoch_s=_never, name=task.file.name) as store:
            return [_outcome(store, task, one, node) for one in task.runs]
    except StoreError as error:  # the file as a whole; what is wrong with one run is told of that
        return [Outcome(one.run, failure=Failure("no-record", str(error)), node=node) for one in task.runs]


def _outcome(store: Store, task: Task, asked: RunAsked, node: str) -> Outcome:
    try:
        recorded = recorded_run(store, asked.sections[-1] if asked.sections else asked.run)
        if recorded.chain_sha256 != asked.chain_sha256:
            raise StoreError(f"{store.path}: run {recorded.run} is there with another content on {node}")
        if asked.sections:
            return _stack_outcome(store, task, asked, node)
        settings = settings_of_section(task.settings) if recorded.header.get("stack") else task.settings
        plan = _changed_plan(recorded, settings)
        means = means_of(plan.effective_yaml(), software())
        if means in asked.known:
            return Outcome(asked.run, known=means, node=node)
        again: Replay | SurfaceReplay
        if isinstance(plan, SurfacePlan):
            again = replay_surface(store, recorded, decoder_of, settings=settings)
        else:
            profile = _nominals().of(plan, recorded)
            again = replay_run(store, recorded, decoder_of, settings=settings, profile=profile)
        return Outcome(asked.run, judgement_of(recorded, again), node=node, is_same=not settings)
    except Exception as error:  # whatever it is, the others are judged all the same
        return Outcome(asked.run, failure=_failure(error), node=node)


def _stack_outcome(store: Store, task: Task, asked: RunAsked, node: str) -> Outcome:
    """What a stack is by the recorded plan and by the changed one. What it is on record follows from its sections, as it did then."""
    sections = [recorded_run(store, run) for run in asked.sections]
    before = judge_stack_again(store, sections, _nominals())
    if before.lost:
        told = f"with nothing changed, {len(before.lost)} sections are not what is on record, the first of them run {before.lost[0]}"
        raise RunError(f"stack {asked.run}: {told}; another version of cmmlink judged them")
    after = judge_stack_again(store, sections, _nominals(), task.settings)
    return Outcome(asked.run, node=node, stack=(_stack_words(before), _stack_words(after)))


def _stack_words(found: StackAgain) -> dict[str, Any]:
    """What a row tells of a stack: its sections count together as one more characteristic."""
    of_stack = [{"name": one["name"], "verdict": one["verdict"]} for one in found.characteristics]
    reasons = [reason for one in found.characteristics for reason in one["reasons"]]
    sections = {"name": "sections", "verdict": found.sections.word}
    return {"verdict": found.verdict.word, "characteristics": [sections, *of_stack], "reasons": reasons[:1]}


def _changed_plan(recorded: RecordedRun, settings: Mapping[str, str]) -> Plan | SurfacePlan:
    if recorded.is_of_surface:
        return with_changes(recorded_surface_plan(recorded), None, None, settings)
    return with_changes(recorded_plan(recorded), None, None, settings)


@cache
def _nominals() -> Nominals:
    return Nominals(_NOMINALS)


def _failure(error: Exception) -> Failure:
    if isinstance(error, StoreError):
        return Failure("no-record", str(error))
    if isinstance(error, PlanError | RunError | InspectionError | PointFileError | DeviceError | OSError | MemoryError):
        return Failure("unusable", str(error) or "this computer has too little memory left for it")
    return Failure("defect", f"a defect of cmmlink, please report it: {error!r}")


def _never() -> float:
    raise AssertionError("a worker writes no records")


def require_settings(store: Store, runs: Sequence[str], settings: dict[str, str]) -> None:
    """Raise PlanError where not one of the runs has a plan that can be changed so: then it is the settings that are wrong."""
    refused: PlanError | None = None
    for run in runs:
        try:
            recorded = recorded_run(store, run)
            _changed_plan(recorded, settings_of_section(settings) if recorded.header.get("stack") else settings)
        except PlanError as error:
            refused = refused or error
        except (StoreError, RunError):  # which is told of this run, when its turn comes
            continue
        else:
            return
    if refused is not None:
        raise refused
