"""What every format is written from: one measured part, with what was found of each of its sections.

A scan is a part with one section; the stack of a CT surface has many. It is the same whether it was just measured or is read from its
record.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cmmlink.plan import CtPlan, Plan
from cmmlink.run import FinishedRun
from cmmlink.stack import SectionOutcome, StackOutcome, surface_words
from inspection import JudgedRows

Blocks = Callable[[], Iterable[JudgedRows]]


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredSection:
    """One section of a part.

    document  : what was found of it, with the keys of result.json
    blocks    : gives the rows of its points piece by piece, as often as it is called; none where nothing was judged
    height_mm : where a surface was cut; None of a scan
    """

    document: Mapping[str, Any]
    blocks: Blocks
    height_mm: float | None = None

    @property
    def words(self) -> str:
        """Which section of a stack it is; empty of a scan."""
        return "" if self.height_mm is None else f"section at {self.height_mm:.3f} mm"


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPart:
    """A part that was measured.

    document : the whole as result.json holds it
    identity : `part`, `serial_number`, `operator`, `device`, `simulated`, `measured_at`, `ending`, `verdict`, `notes`, and of a recorded
               one `run`, `chain_sha256`, `plan_sha256`, `nominal_sha256`, `software`; what is not known is not there, or None
    of_stack : the characteristics that all sections have together
    """

    document: Mapping[str, Any]
    identity: Mapping[str, Any]
    plan: Plan | CtPlan
    sections: Sequence[MeasuredSection]
    of_stack: Sequence[Mapping[str, Any]] = ()

    @property
    def run(self) -> str:
        """The id of the recorded run; empty where nothing was recorded."""
        return self.identity.get("run") or ""

    @property
    def chain_sha256(self) -> str:
        """The hash of the record; empty where there is none."""
        return self.identity.get("chain_sha256") or ""

    def text(self, key: str) -> str:
        """What the identity says under a key; empty where it says nothing."""
        return str(self.identity.get(key) or "")


def part_of_run(run: FinishedRun) -> MeasuredPart:
    """The part of a run that has just ended."""
    document, result = run.result_json(), run.outcome.result
    return part_of_document(document, run.plan, result.blocks if result is not None else no_blocks)


def part_of_document(document: Mapping[str, Any], plan: Plan, blocks: Blocks, height_mm: float | None = None) -> MeasuredPart:
    """The part of a run of which result.json says this."""
    return MeasuredPart(document, document, plan, [MeasuredSection(document, blocks, height_mm)])


def part_of_stack(stack: StackOutcome, plan: CtPlan) -> MeasuredPart:
    """The part whose surface was cut into a stack of sections; its hash is that of the last one, which covers those before."""
    document = stack.result_json()
    identity = {
        "part": plan.part.name,
        "serial_number": plan.part.serial_number,
        "device": surface_words(plan),
        "simulated": False,
        **{key: document[key] for key in ("measured_at", "ending", "verdict", "notes")},
    }
    recorded = [section.evidence for section in stack.sections if section.evidence is not None]
    if recorded:
        last = recorded[-1]
        identity |= {"run": last.run, "chain_sha256": last.chain_sha256, "plan_sha256": last.plan_sha256, "software": dict(last.software)}
    return MeasuredPart(document, identity, plan, [_section_of(section) for section in stack.sections], document["characteristics"])


def no_blocks() -> Iterable[JudgedRows]:
    """The rows of a run of which nothing was judged."""
    return ()


def _section_of(section: SectionOutcome) -> MeasuredSection:
    result = section.run.result
    return MeasuredSection(section.result_json(), result.blocks if result is not None else no_blocks, section.slice.height_mm)
