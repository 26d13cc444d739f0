"""The table of a run in the terminal while the run goes on. What draws it is loaded for those who look on."""

from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn
from rich.table import Table

from cmmlink.report.terminal import STYLE_OF
from cmmlink.run_state import RunState
from cmmlink.run_view import RunView
from cmmlink.words import POSE_MOVES

_REPAINTS_PER_S = 8


class LiveTable:
    """A table of a run on the screen, for as long as it is entered as a context. It paints the newest state of the run's view."""

    def __init__(self, console: Console, view: RunView) -> None:
        self._view = view
        self._progress = Progress(TextColumn("{task.description}"), BarColumn(bar_width=40), MofNCompleteColumn(), console=console)
        self._bar: TaskID = self._progress.add_task("points", total=None)
        self._live = Live(console=console, get_renderable=self._paint, refresh_per_second=_REPAINTS_PER_S, transient=True)

    def __enter__(self) -> "LiveTable":
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Clear the table, also when the run ended with an error."""
        self._live.stop()

    def _paint(self) -> Group:
        state = self._view.state()
        self._progress.update(self._bar, completed=state.received, total=state.expected)
        table = Table.grid(padding=(0, 3))
        for name, words in _table_rows(state).items():
            table.add_row(name, words)
        return Group(table, self._progress)


def _table_rows(state: RunState) -> dict[str, str]:
    worst, registration = state.worst, state.registration
    style = STYLE_OF[state.verdict.shape]
    return {
        "part": escape(" ".join(filter(None, [state.part, state.serial_number]))),
        "device": escape(f"{'SIMULATED, ' if state.simulated else ''}{state.device}"),
        "link": escape(": ".join(filter(None, [state.link, state.link_detail]))),
        "points": f"{state.received} received, {state.judged} judged, {state.rejected} rejected, {state.lost} lost",
        "rate": f"{state.rate_per_s:.0f} points/s",
        "registration": registration.state + (f", {POSE_MOVES}" if registration.state == "provisional" else ""),
        "worst": "" if worst is None else f"{worst.deviation_mm:+.4f} mm at station {worst.station_mm:.1f} mm",
        "verdict": f"[{style}]{state.verdict.word}[/]: {escape(state.verdict.why)}",
    }
