"""Results as other programs take them: one file a format, all written from the same measured part. This is the front door."""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.exports.formats import write_exports
    from cmmlink.exports.measured_part import MeasuredPart, part_of_run, part_of_stack
    from cmmlink.exports.recorded_part import document_on_record, judged_rows, part_on_record, sound_run
    from cmmlink.exports.recorded_surface import surface_document, write_surfaces
    from cmmlink.exports.single_table import write_table
    from cmmlink.exports.trend_workbook import write_trend_workbook
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.exports.measured_part": ("MeasuredPart", "part_of_run", "part_of_stack"),
        "cmmlink.exports.recorded_part": ("document_on_record", "judged_rows", "part_on_record", "sound_run"),
        "cmmlink.exports.recorded_surface": ("surface_document", "write_surfaces"),
        "cmmlink.exports.formats": ("write_exports",),
        "cmmlink.exports.single_table": ("write_table",),
        "cmmlink.exports.trend_workbook": ("write_trend_workbook",),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "MeasuredPart",
    "document_on_record",
    "judged_rows",
    "part_of_run",
    "part_of_stack",
    "part_on_record",
    "sound_run",
    "surface_document",
    "write_exports",
    "write_surfaces",
    "write_table",
    "write_trend_workbook",
]
