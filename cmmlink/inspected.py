"""What an inspection found, as scripts and notebooks hold it: the same for points that were just judged and for a run on record."""

import base64
import html
import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.csv_rows import Texts
from cmmlink.deviations_csv import COLUMNS, point_columns
from cmmlink.report import JudgedScan, ProfilePictures, content_of, places_in, regions_in, scan_of, scan_on_record, zone_in
from cmmlink.words import Headline, headline_of
from inspection import JudgedRows, NominalProfile, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cmmlink.run import FinishedRun

_VERDICTS = {verdict.word: verdict for verdict in Verdict}
_DOTS_PER_INCH = 110  # of the picture in a notebook
_CELLS = (
    ("points", "{judged:d} of {received:d} judged, {rejected:d} rejected, {lost:d} lost"),
    ("deviation", "{min_deviation_mm:+.4f} .. {max_deviation_mm:+.4f} mm"),
    ("out of tolerance", "{out_of_tolerance:d} points"),
    ("profile error", "{profile_error_mm:.4f} mm (2 x largest), zone error {zone_error_mm:.4f} mm, rms {rms_mm:.4f} mm"),
    ("covered", "{coverage:.1%}, largest gap {largest_gap_mm:.3f} mm"),
    ("fit", "{fit}, method {method}"),
)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Inspected:
    """What an inspection found of a part.

    title    : the part as it is called
    document : everything that was found, with the keys of result.json (docs/results.md)
    profile  : the nominal that the points were held against
    points   : a row for every received point, in the order of arrival: where it lies, its foot, its deviation, its verdict

    In a notebook it shows itself as a table and a picture. `print(found)` says it in one line.
    """

    title: str
    document: Mapping[str, Any]
    profile: NominalProfile
    points: JudgedRows
    scan: JudgedScan = field(repr=False)

    @property
    def verdict(self) -> Verdict:
        """The verdict on the part: CONFORM, UNCERTAIN or NONCONFORM."""
        return _VERDICTS[self.document["verdict"]]

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is that verdict, a sentence each, the most important first; none where the part conforms."""
        return tuple(reason["words"] for reason in self.document.get("reasons", ()))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed about the nominal and the points: these stand beside the verdict."""
        return tuple(self.document["notes"])

    @property
    def headline(self) -> Headline:
        """The verdict in the words of the page and the reports; of a scan that did not come to its end how early it ended."""
        return headline_of(self.verdict, self.document["ending"], self.document["coverage"])

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """The points as arrays by the names of the columns of deviations.csv, for any library of tables."""
        index, numbers, words = point_columns(self.points, 0)
        assert isinstance(index, np.ndarray)
        assert isinstance(numbers, np.ndarray)
        assert isinstance(words, Texts)
        named = zip(COLUMNS, (index, *numbers.T, np.array(words.words)[words.codes]), strict=True)
        return dict(named)

    def to_dataframe(self) -> Any:
        """The same as a pandas DataFrame, whose index is the number of the point. Raises ImportError where pandas is not installed."""
        try:
            pandas = import_module("pandas")  # by its name: cmmlink neither needs it nor brings it
        except ImportError:
            raise ImportError("a DataFrame needs pandas; `pip install pandas` brings it") from None
        return pandas.DataFrame(self.to_columns()).set_index("index")

    def plot(self) -> "Figure":
        """Draw the profile with its magnified deviations, and the strip of deviations along it, as a matplotlib Figure.

        `found.plot().savefig("part.png")` writes it.
        """
        regions, places = regions_in(self.document), places_in(self.document)
        content = content_of(self.scan, self.profile, self.title, self.document["ending"], regions=regions, places_mm=places)
        return ProfilePictures().draw(content)

    def __repr__(self) -> str:
        found = self.document
        head = f"<Inspected {self.title}: {self.headline.words}, {found['judged']} of {found['received']} points judged"
        if found["worst"] is None:
            return f"{head}>"
        worst = found["worst"]
        return f"{head}, worst {worst['deviation_mm']:+.4f} mm at station {worst['station_mm']:.2f} mm>"

    def _repr_html_(self) -> str:
        """The table and the picture that a notebook shows. What stands in the names of parts and files is text, never markup."""
        rows = [(name, told.format_map(self.document)) for name, told in _CELLS if self.document["worst"] is not None]
        rows += [("why", reason) for reason in self.reasons] + [("note", note) for note in self.notes]
        cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(told)}</td></tr>" for name, told in rows)
        head = f"<b>{html.escape(self.headline.words)}</b>&nbsp; {html.escape(self.title)}"
        return f"<div>{head}<table>{cells}</table>{self._picture()}</div>"

    def _picture(self) -> str:
        if self.document["worst"] is None:
            return ""
        kept = io.BytesIO()
        self.plot().savefig(kept, format="png", dpi=_DOTS_PER_INCH)
        alt = f"the deviations of {self.title} along the profile"
        return f'<img alt="{html.escape(alt)}" src="data:image/png;base64,{base64.b64encode(kept.getvalue()).decode()}">'


def inspected_run(run: "FinishedRun") -> Inspected:
    """What a finished run found. Raises what kept it from a result."""
    outcome = run.outcome
    problem = outcome.failure or run.refusal
    if problem is not None or outcome.result is None:
        raise problem or ValueError(f"{run.title}: no point was judged")
    result = outcome.result
    return Inspected(run.title, run.result_json(), run.profile, result.rows_at(slice(None)), scan_of(result))


def inspected_on_record(title: str, document: Mapping[str, Any], profile: NominalProfile, blocks: Iterable[JudgedRows]) -> Inspected:
    """What a run on record found: its document as result.json has it, and the rows of its points, piece by piece."""
    rows = joined_rows(blocks)
    return Inspected(title, document, profile, rows, scan_on_record(document, zone_in(document["tolerance"]), lambda: [rows]))


def joined_rows(blocks: Iterable[JudgedRows]) -> JudgedRows:
    """The rows of blocks that follow one another, in one."""
    columns = [(b.actual_mm, b.foot_mm, b.station_mm, b.deviation_mm, b.verdicts, b.rejection) for b in blocks]
    actual, foot, station, deviation, verdicts, rejection = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    return JudgedRows(actual, foot, station, deviation, verdicts, rejection)
