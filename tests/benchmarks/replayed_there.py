"""Replays exported runs, all in one process: what an other machine runs, with what cmmlink needs and nothing of the tests.

    python replayed_there.py FOLDER

FOLDER holds a folder for every exported run. Prints a JSON object a line: the run, how it compares with the recorded one, its hashes, what
of it is not the same, and the versions that are not.
"""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path

from cmmlink.devices import decoder_of
from cmmlink.record import open_evidence, recorded_run, replay_run


def main(folder: Path) -> None:
    """Print the outcome of every run."""
    for exported in sorted(folder.iterdir()):
        with open_evidence(exported, lambda: datetime.now(UTC)) as evidence:
            again = replay_run(evidence.store, recorded_run(evidence.store, evidence.run), decoder_of)
        told = {
            "run": evidence.run,
            "identical": again.identical,
            "same_decision": again.agreement.same_decision,
            "apart": again.agreement.apart,
            "result_sha256": again.agreement.result_sha256,
            "decision_sha256": again.agreement.decision_sha256,
            "differs": [f"{change.key} {change.recorded!r} -> {change.replayed!r}" for change in again.differs],
            "versions": {change.key: change.replayed for change in again.changed},
        }
        sys.stdout.write(json.dumps(told) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
