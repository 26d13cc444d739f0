"""Every format by its name, and which of them hold one part a file."""

from collections.abc import Callable, Mapping, Sequence

from cmmlink.exports.csv_tables import write_csv
from cmmlink.exports.dfq import write_dfq
from cmmlink.exports.measured_part import MeasuredPart
from cmmlink.exports.qif import write_qif
from cmmlink.exports.result_document import write_json
from cmmlink.exports.workbook import write_xlsx
from cmmlink.plan import FormatName
from cmmlink.result_files import NewFiles

Write = Callable[[Sequence[MeasuredPart], NewFiles, str], None]

_OF_MANY: Mapping[FormatName, Write] = {"dfq": write_dfq, "xlsx": write_xlsx, "csv": write_csv}
_OF_ONE: Mapping[FormatName, Write] = {"qif": write_qif, "json": write_json}


def write_exports(parts: Sequence[MeasuredPart], formats: Sequence[FormatName], files: NewFiles, stem: str) -> None:
    """Write parts in each of the formats, as STEM.FORMAT; where there are many, a format for one has a file RUN.FORMAT for each.

    Raises PlanError where runs cannot be added to a file that is there, OSError where a file cannot be written.
    """
    for name in dict.fromkeys(formats):
        if name in _OF_MANY:
            _OF_MANY[name](parts, files, stem)
        else:
            for part in parts:
                _OF_ONE[name]([part], files, stem if len(parts) == 1 else part.run)
