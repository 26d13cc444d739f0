"""What an operator is told of the registration and of the verdict, from the result of a run or from what there is before it."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cmmlink.characteristic_rows import CharacteristicRow, worst_words
from cmmlink.endings import Ended, reasons_of
from cmmlink.result_json import number
from cmmlink.run_state import RegistrationState, VerdictState
from cmmlink.words import Headline, headline_of
from inspection import LiveUpdate, Verdict

if TYPE_CHECKING:  # who shows sections alone loads nothing of surfaces
    from inspection.surface import SurfaceUpdate


def registration_shown(ended: Ended | None, update: "LiveUpdate | SurfaceUpdate | None") -> RegistrationState:
    """How far the registration is: that of the result, or while there is none that of the newest points."""
    found = ended.result["registration"] if ended else None
    if found is not None and ended is not None and ended.ending == "complete":
        return RegistrationState("settled", 0.0, _other_poses(found))
    if found is not None:
        return RegistrationState("provisional", None, _other_poses(found))  # more points would have moved it
    if update is None:
        return RegistrationState("seeking", None, 0)
    can_move_mm = update.can_move_mm if isinstance(update, LiveUpdate) else math.nan
    return RegistrationState(update.state, 0.0 if update.state == "settled" else number(can_move_mm), 0)


def _other_poses(found: Mapping[str, Any]) -> int:
    """How many other poses fit as well: a section names them, a surface counts them."""
    return int(found["rivals"]) if "rivals" in found else len(found.get("other_poses", ()))


def verdict_at_end(ended: Ended, rows: Sequence[CharacteristicRow]) -> VerdictState:
    """The verdict of a run that has come to its end, with its reasons and the characteristic that is the worst."""
    result = ended.result
    found = Verdict[result["verdict"].upper()] if result["registration"] and result["received"] else None
    early = ended.ending != "complete" and result["received"] > 0
    headline = headline_of(found, ended.ending, result["coverage"]) if early else headline_of(found)
    why, *further = reasons_of(ended, found)
    of = "" if early or found is None else worst_words(rows)
    return verdict_state(headline, not early, why, further, of)


def verdict_state(headline: Headline, final: bool, why: str, further: Sequence[str] = (), of: str = "") -> VerdictState:
    """The words of a verdict, whether they are the last ones, the reasons, and what they are about."""
    return VerdictState(headline.words, headline.shape, final, why, of, tuple(further))
