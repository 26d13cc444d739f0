"""The nominal of a recorded run, from the file that is on record: the one that the plan names may have changed since, or be gone."""

import hashlib

from cmmlink.from_plan import profile_of
from cmmlink.plan import Plan
from cmmlink.record.reader import RecordedRun
from cmmlink.record.recorded_inputs import with_recorded_file
from cmmlink.record.shapes import plain_name
from inspection import NominalProfile

_DRAWINGS = (".step", ".stp", ".igs", ".iges", ".dxf", ".qif")  # a solid, or a curve in space, is another nominal at every height


def recorded_profile(plan: Plan, recorded: RecordedRun) -> NominalProfile:
    """Discretise the nominal from its recorded file; the one that the plan names may have changed since, or be gone."""
    with with_recorded_file(plan, recorded) as at_hand:
        return profile_of(at_hand)


class Nominals:
    """The nominals of recorded runs; runs by one nominal share it.

    most : how many are kept, the latest; None: all of them
    """

    def __init__(self, most: int | None = None) -> None:
        self._most = most
        self._known: dict[tuple[str, str, str], NominalProfile] = {}

    def of(self, plan: Plan, recorded: RecordedRun) -> NominalProfile:
        """The nominal of a run as a plan reads it: the recorded plan, or that with something changed."""
        own = plan.section.model_dump_json() if plan.nominal.file.suffix.lower() in _DRAWINGS else ""
        read = plan.nominal.model_dump_json(exclude={"file"}) + plan.discretisation.model_dump_json()
        key = (hashlib.sha256(recorded.nominal).hexdigest() + plain_name(recorded.header["nominal"]), read, own)
        if key not in self._known:
            if len(self._known) == self._most:
                del self._known[next(iter(self._known))]
            self._known[key] = recorded_profile(plan, recorded)
        return self._known[key]
