"""What an inspection found of a whole surface, as scripts and notebooks hold it: of points just judged, and of a run on record."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.deviations_csv import POINT_WORDS
from cmmlink.exports import surface_document
from cmmlink.from_surface_plan import held_against
from cmmlink.plan import SurfacePlan
from cmmlink.record import RecordedRun, Store, recorded_surface, recorded_surface_plan, unpack_surface
from cmmlink.report import ReportInput, Speech, content_of_surface, draw_surface
from cmmlink.surface_csv import SURFACE_COLUMNS
from cmmlink.surface_rows import SurfaceRows, joined_surface_rows, surface_blocks
from cmmlink.words import Headline
from inspection import NOT_JUDGED, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cmmlink.surface_run import FinishedSurface
    from inspection.surface import NominalSurface

_VERDICTS = {verdict.word: verdict for verdict in Verdict}
_ROWS = 1 << 20


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class InspectedSurface:
    """What an inspection found of a whole surface.

    title    : the part as it is called
    document : everything that was found, with the keys of result.json (docs/results.md)
    nominal  : the surface that the points were held against
    points   : a row for every received point, in the order of arrival: where it lies, its foot, its deviation, its verdict
    plan     : what it was judged by

    `print(found)` says it in one line.
    """

    title: str
    document: Mapping[str, Any]
    nominal: "NominalSurface"
    points: SurfaceRows
    plan: SurfacePlan

    @property
    def verdict(self) -> Verdict:
        """The verdict on the part: CONFORM, UNCERTAIN or NONCONFORM."""
        return _VERDICTS[self.document["verdict"]]

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is that verdict, a sentence each, the most important first; none where the part conforms."""
        return tuple(reason["words"] for reason in self.document["reasons"])

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed about the nominal and the points: these stand beside the verdict."""
        return tuple(self.document["notes"])

    @property
    def headline(self) -> Headline:
        """The verdict in the words of the page and the reports; of a scan that did not come to its end how early it ended."""
        return ReportInput(self.document, self.plan).headline

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """The points as arrays by the names of the columns of deviations.csv, for any library of tables; a rejected one has face 0."""
        rows = self.points
        judged = rows.verdicts != NOT_JUDGED
        numbers = np.column_stack([rows.actual_mm, rows.foot_mm, rows.deviation_mm])
        numbers[~judged] = np.nan
        words = np.array(POINT_WORDS)[np.where(judged, rows.verdicts, len(Verdict) + rows.rejection)]
        return dict(zip(SURFACE_COLUMNS, [np.arange(rows.received), *numbers.T, words, rows.face + 1], strict=True))

    def to_dataframe(self) -> Any:
        """The same as a pandas DataFrame, whose index is the number of the point. Raises ImportError where pandas is not installed."""
        try:
            pandas = import_module("pandas")  # by its name: cmmlink neither needs it nor brings it
        except ImportError:
            raise ImportError("a DataFrame needs pandas; `pip install pandas` brings it") from None
        return pandas.DataFrame(self.to_columns()).set_index("index")

    def plot(self) -> "Figure":
        """Draw the part from four sides, coloured by the zone, and its worst place from near, as a matplotlib Figure."""
        content = content_of_surface(ReportInput(self.document, self.plan), self.nominal, iter([self.points]))
        return draw_surface(content, Speech(self.plan.report.language))

    def __repr__(self) -> str:
        found = self.document
        head = f"<InspectedSurface {self.title}: {self.headline.words}, {found['judged']} of {found['received']} points judged"
        if found["worst"] is None:
            return f"{head}>"
        worst = found["worst"]
        place = ", ".join(f"{worst[axis]:.2f}" for axis in ("x_mm", "y_mm", "z_mm"))
        return f"{head}, worst {worst['deviation_mm']:+.4f} mm at ({place})>"


def inspected_surface(run: "FinishedSurface") -> InspectedSurface:
    """What a finished run of a whole surface found. Raises what kept it from a result."""
    outcome = run.outcome
    problem = outcome.failure or run.refusal
    if problem is not None or outcome.result is None:
        raise problem or ValueError(f"{run.title}: no point was judged")
    rows = joined_surface_rows(surface_blocks(outcome.result, _ROWS))
    return InspectedSurface(run.title, run.result_json(), held_against(run.plan, run.file), rows, run.plan)


def surface_from_record(title: str, store: Store, recorded: RecordedRun) -> InspectedSurface:
    """What a run on record found. It has a result. Raises StoreError where the record was altered or cannot be read."""
    plan = recorded_surface_plan(recorded)
    rows = joined_surface_rows(unpack_surface(record.body) for record in store.records(recorded.run, "deviations"))
    nominal = held_against(plan, recorded_surface(plan, recorded))
    return InspectedSurface(title, surface_document(store, recorded), nominal, rows, plan)
