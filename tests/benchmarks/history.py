"""Figures of dated runs, a line of JSON each: kept, held against the run before, and written out as a page."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

DOCS = Path(__file__).resolve().parents[2] / "docs"
HISTORY = DOCS / "performance-history.jsonl"
PAGE = DOCS / "performance.md"
BEGIN, END = "<!-- measured by make bench -->", "<!-- end of what make bench measured -->"


@dataclass(frozen=True, slots=True)
class Figure:
    """What was measured of one wait in one unit.

    median, low, high : of all rounds: the middle one, and the quartiles, which are its scatter
    goal              : what we want to reach, or None
    """

    name: str
    unit: str
    median: float
    low: float
    high: float
    rounds: int
    goal: float | None = None
    limit: str = ""

    @property
    def better_is_more(self) -> bool:
        """Whether a larger figure is a better one: ratios to rivals."""
        return self.unit.startswith("of ")

    @property
    def reached(self) -> bool:
        """Whether the goal is reached; without a goal it is."""
        return self.goal is None or (self.median >= self.goal if self.better_is_more else self.median <= self.goal)


@dataclass(frozen=True, slots=True)
class Run:
    """One run of the benchmark. `growth` has lines of (size, figure) by name."""

    date: str
    commit: str
    machine: str
    processor: str
    figures: tuple[Figure, ...]
    growth: dict[str, list[tuple[float, float]]] = field(default_factory=dict)


def figure_of(name: str, unit: str, values: list[float], goal: float | None, limit: str) -> Figure:
    """The figure of all rounds."""
    low, median, high = (float(f"{value:.4g}") for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return Figure(name, unit, median, low, high, len(values), goal, limit)


def append(run: Run, history: Path = HISTORY) -> None:
    """Add a line."""
    with history.open("a", encoding="utf-8") as file:
        file.write(json.dumps(asdict(run)) + "\n")


def runs(history: Path = HISTORY) -> list[Run]:
    """All runs, the oldest first."""
    if not history.is_file():
        return []
    return [_run(json.loads(line)) for line in history.read_text(encoding="utf-8").splitlines()]


def _run(content: dict[str, object]) -> Run:
    figures, growth = content.pop("figures"), content.pop("growth")
    assert isinstance(figures, list)
    assert isinstance(growth, dict)
    lines = {name: [(float(size), float(value)) for size, value in line] for name, line in growth.items()}
    return Run(**content, figures=tuple(Figure(**figure) for figure in figures), growth=lines)  # type: ignore[arg-type]


def slower(now: Run, before: Run) -> Iterator[str]:
    """A sentence for each figure that got worse by more than the scatter of both runs together."""
    known = {(figure.name, figure.unit): figure for figure in before.figures}
    for figure in now.figures:
        old = known.get((figure.name, figure.unit))
        if old is None:
            continue
        worse = old.median - figure.median if figure.better_is_more else figure.median - old.median
        scatter = (figure.high - figure.low) + (old.high - old.low)
        if worse > max(scatter, 0.05 * old.median):  # a single round has no scatter of its own
            yield f"{figure.name}: {figure.median:g} {figure.unit}, {old.median:g} on {before.date} (scatter {scatter:.2g})"


def previous(now: Run, history: list[Run]) -> Run | None:
    """The last run before this one on the same processor."""
    return next((run for run in reversed(history) if run.processor == now.processor and run != now), None)


def write_page(run: Run, page: Path = PAGE) -> None:
    """Write the table of a run into the page, between its two marks."""
    text = page.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    page.write_text(before + "\n".join([BEGIN, "", *_table(run), "", END]) + after, encoding="utf-8")


def _table(run: Run) -> Iterator[str]:
    yield f"{run.machine} Commit {run.commit}. Earlier runs are in [the history](performance-history.jsonl)."
    yield ""
    yield "| what the user waits for | figure | quartiles | goal | what stands in the way of more |"
    yield "| --- | --- | --- | --- | --- |"
    for figure in run.figures:
        goal = "" if figure.goal is None else f"{figure.goal:g}{' (reached)' if figure.reached else ''}"
        spread = f"{figure.low:g} to {figure.high:g}" if figure.rounds > 1 else "one round"
        yield f"| {figure.name} | {figure.median:g} {figure.unit} | {spread} | {goal} | {figure.limit} |"
    yield ""
    yield "![How the cost grows with points, samples, triangles and minutes](performance-growth.png)"
