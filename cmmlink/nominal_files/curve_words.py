"""What the check of a nominal curve says: the refusal of one that crosses itself, and notes of where it is hollow."""

from inspection import CurveCheck, NominalError

_MOST_PLACES = 6


def refuse_crossings(check: CurveCheck) -> None:
    """Raise NominalError, naming the places, for a curve that crosses itself: it has no inside there, and deviations no sign."""
    if not check.crossings:
        return
    places = [f"({c.x_mm:.6g}, {c.y_mm:.6g}) at stations {c.first_mm:.6g} and {c.second_mm:.6g} mm" for c in check.crossings]
    raise NominalError(
        f"the curve crosses or touches itself at {_listed(places)}; expected sides that keep apart: look at the points there, "
        "their order and their digits"
    )


def notes_of(check: CurveCheck) -> list[str]:
    """Notes of the changes of curvature and of the tightest hollow; none for a curve that is convex throughout."""
    changes = [f"{station:.6g}" for station in check.sign_changes_mm]
    notes = []
    if len(changes) == 1:
        notes.append(f"the curvature changes its sign once, at station (mm) {changes[0]}")
    elif changes:
        notes.append(f"the curvature changes its sign {len(changes)} times, at stations (mm) {_listed(changes)}")
    if check.hollow:
        hollow = check.hollow
        place = f"station {hollow.station_mm:.6g} mm, ({hollow.x_mm:.6g}, {hollow.y_mm:.6g})"
        notes.append(f"the tightest hollow has a radius of {hollow.radius_mm:.4g} mm, at {place}: a larger ball does not reach it")
    return notes


def _listed(items: list[str]) -> str:
    """Return the first few items with commas between them, and how many more there are."""
    shown, more = items[:_MOST_PLACES], len(items) - _MOST_PLACES
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")
