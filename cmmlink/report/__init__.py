"""What a finished run leaves behind, one file per kind of output. This is the front door of the package.

Pictures are drawn by matplotlib, which is loaded when the first one is.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.report.certificate_pdf import write_certificate
    from cmmlink.report.comparison_picture import write_comparison_picture
    from cmmlink.report.curves_picture import write_curves_picture
    from cmmlink.report.folder import prepare, write_results, write_run
    from cmmlink.report.judged_scan import JudgedScan, scan_of, scan_on_record
    from cmmlink.report.live_table import LiveTable
    from cmmlink.report.nominal_picture import write_nominal_picture
    from cmmlink.report.nominal_text import text_picture
    from cmmlink.report.pdf import write_report
    from cmmlink.report.picture import ProfilePictures
    from cmmlink.report.picture_content import content_of
    from cmmlink.report.picture_processes import Pictures
    from cmmlink.report.recorded_report import input_of_replay, input_on_record
    from cmmlink.report.recorded_stack import stack_on_record
    from cmmlink.report.recorded_surface_report import picture_on_record, surface_on_record
    from cmmlink.report.report_input import ReportInput, input_of_surface, places_in, regions_in, with_settings, zone_in
    from cmmlink.report.section_pictures import SectionPictures
    from cmmlink.report.speech import Speech
    from cmmlink.report.stack_folder import write_stack
    from cmmlink.report.stack_pdf import write_stack_report
    from cmmlink.report.study_pdf import write_study
    from cmmlink.report.study_text import study_document, study_lines
    from cmmlink.report.surface_folder import write_surface, write_surface_run
    from cmmlink.report.surface_pdf import write_surface_report
    from cmmlink.report.surface_picture import draw_surface
    from cmmlink.report.surface_report import content_of_surface
    from cmmlink.report.surface_terminal import print_surface_summary
    from cmmlink.report.terminal import STYLE_OF, STYLES, print_characteristics, print_summary
    from cmmlink.report.trend_picture import write_trend_picture
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.report.certificate_pdf": ("write_certificate",),
        "cmmlink.report.comparison_picture": ("write_comparison_picture",),
        "cmmlink.report.folder": ("prepare", "write_results", "write_run"),
        "cmmlink.report.judged_scan": ("JudgedScan", "scan_of", "scan_on_record"),
        "cmmlink.report.live_table": ("LiveTable",),
        "cmmlink.report.picture": ("ProfilePictures",),
        "cmmlink.report.picture_content": ("content_of",),
        "cmmlink.report.picture_processes": ("Pictures",),
        "cmmlink.report.curves_picture": ("write_curves_picture",),
        "cmmlink.report.nominal_picture": ("write_nominal_picture",),
        "cmmlink.report.nominal_text": ("text_picture",),
        "cmmlink.report.pdf": ("write_report",),
        "cmmlink.report.recorded_report": ("input_of_replay", "input_on_record"),
        "cmmlink.report.recorded_surface_report": ("picture_on_record", "surface_on_record"),
        "cmmlink.report.recorded_stack": ("stack_on_record",),
        "cmmlink.report.report_input": ("ReportInput", "input_of_surface", "places_in", "regions_in", "with_settings", "zone_in"),
        "cmmlink.report.section_pictures": ("SectionPictures",),
        "cmmlink.report.stack_folder": ("write_stack",),
        "cmmlink.report.stack_pdf": ("write_stack_report",),
        "cmmlink.report.speech": ("Speech",),
        "cmmlink.report.study_pdf": ("write_study",),
        "cmmlink.report.study_text": ("study_document", "study_lines"),
        "cmmlink.report.surface_picture": ("draw_surface",),
        "cmmlink.report.surface_report": ("content_of_surface",),
        "cmmlink.report.surface_folder": ("write_surface", "write_surface_run"),
        "cmmlink.report.surface_pdf": ("write_surface_report",),
        "cmmlink.report.surface_terminal": ("print_surface_summary",),
        "cmmlink.report.terminal": ("STYLE_OF", "STYLES", "print_characteristics", "print_summary"),
        "cmmlink.report.trend_picture": ("write_trend_picture",),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "STYLES",
    "STYLE_OF",
    "JudgedScan",
    "LiveTable",
    "Pictures",
    "ProfilePictures",
    "ReportInput",
    "SectionPictures",
    "Speech",
    "content_of",
    "content_of_surface",
    "draw_surface",
    "input_of_replay",
    "input_of_surface",
    "input_on_record",
    "picture_on_record",
    "places_in",
    "prepare",
    "print_characteristics",
    "print_summary",
    "print_surface_summary",
    "regions_in",
    "scan_of",
    "scan_on_record",
    "stack_on_record",
    "study_document",
    "study_lines",
    "surface_on_record",
    "text_picture",
    "with_settings",
    "write_certificate",
    "write_comparison_picture",
    "write_curves_picture",
    "write_nominal_picture",
    "write_report",
    "write_results",
    "write_run",
    "write_stack",
    "write_stack_report",
    "write_study",
    "write_surface",
    "write_surface_report",
    "write_surface_run",
    "write_trend_picture",
    "zone_in",
]
