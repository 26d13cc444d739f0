"""How a run ended, and why, in sentences for whoever looks at it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from cmmlink.events import Ending
from cmmlink.surface_rows import SurfaceRows
from inspection import JudgedRows, Verdict

_EARLY = {
    "aborted": "no verdict: the scan was aborted",
    "interrupted": "no verdict: the scan was interrupted",
    "running": "no verdict yet: the scan is going on",
}


@dataclass(frozen=True, slots=True, eq=False)
class Ended:
    """How a run ended: its ending, why there is no result, the result as the command line prints it, and what gives its rows, by pieces.

    A run on record may be one that another process still records: then it is running.
    """

    ending: Ending | Literal["running"]
    message: str
    result: Mapping[str, Any]
    blocks: Callable[[], Iterable[JudgedRows | SurfaceRows]] | None


def reasons_of(ended: Ended, verdict: Verdict | None) -> list[str]:
    """Why a run ended as it did; what stands under the headline comes first, then every further reason.

    verdict : None where nothing could be measured
    """
    result = ended.result
    told = result.get("reasons", ())  # older records hold none
    reasons = [reason["words"] for reason in told if reason["kind"] not in ("incomplete", "aborted")]
    if not result["received"]:
        return [ended.message if ended.ending == "interrupted" and ended.message else "no point was received"]
    if ended.ending != "complete":
        out = result["out_of_tolerance"]
        until = f"; {count_words(out) if out else 'none'} out until then" if verdict is not None else ""
        return [*([ended.message] if ended.message else []), _EARLY[ended.ending] + until, *reasons]
    if verdict is None:
        return [ended.message or "no part found"]
    if verdict is Verdict.CONFORM:
        return [f"all {count_words(result['judged'])} within tolerance"]
    return reasons or [f"{count_words(result['out_of_tolerance'])} out of tolerance"]


def count_words(points: int) -> str:
    """A number of points in words."""
    return f"{points:,} point{'s' if points != 1 else ''}"
