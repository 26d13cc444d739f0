"""What a plant learns from many runs: its results database, control charts, capability of a process and studies of gauges.

This is the front door.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.plant.capability_indices import Capability, CapabilityIndex, capability
    from cmmlink.plant.control_charts import ControlChart, ControlCharts, individuals_charts, mean_range_charts
    from cmmlink.plant.database_address import address_of, is_server, without_password, words_of
    from cmmlink.plant.drift import Drift, DriftingStretch, drift_of
    from cmmlink.plant.gauge_studies import CrossedStudy, StationStudy, TypeOneStudy, crossed_study, station_study, type_one_study
    from cmmlink.plant.profile_strip import STRIP_PARTS, ProfileStrip, strip_of
    from cmmlink.plant.result_rows import PartCharacteristic, ProfileStrips, ResultSeries, RunFound, StoredEvent, StoredRun, StoredValue
    from cmmlink.plant.results_database import ResultsDatabase, month_of
    from cmmlink.plant.study_file import Reference, StudiedCharacteristic, Study, StudyRun, read_study, study_text
    from cmmlink.plant.study_findings import BudgetOfU, SourceOfU, StudyFinding, StudyFindings, budget_of, findings_of
    from cmmlink.plant.trend import FEWEST_BEFORE_ALARM, FORM_TYPES, Trend, alarm_words, broken_words, new_violations, trend_of
    from cmmlink.plant.western_electric import ControlLimits, RuleViolation
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.plant.capability_indices": (
            "Capability",
            "CapabilityIndex",
            "capability",
        ),
        "cmmlink.plant.control_charts": (
            "ControlChart",
            "ControlCharts",
            "individuals_charts",
            "mean_range_charts",
        ),
        "cmmlink.plant.database_address": (
            "address_of",
            "is_server",
            "without_password",
            "words_of",
        ),
        "cmmlink.plant.drift": (
            "Drift",
            "DriftingStretch",
            "drift_of",
        ),
        "cmmlink.plant.gauge_studies": (
            "CrossedStudy",
            "StationStudy",
            "TypeOneStudy",
            "crossed_study",
            "station_study",
            "type_one_study",
        ),
        "cmmlink.plant.profile_strip": (
            "STRIP_PARTS",
            "ProfileStrip",
            "strip_of",
        ),
        "cmmlink.plant.result_rows": (
            "PartCharacteristic",
            "ProfileStrips",
            "ResultSeries",
            "RunFound",
            "StoredEvent",
            "StoredRun",
            "StoredValue",
        ),
        "cmmlink.plant.results_database": (
            "ResultsDatabase",
            "month_of",
        ),
        "cmmlink.plant.study_file": ("Reference", "StudiedCharacteristic", "Study", "StudyRun", "read_study", "study_text"),
        "cmmlink.plant.study_findings": ("BudgetOfU", "SourceOfU", "StudyFinding", "StudyFindings", "budget_of", "findings_of"),
        "cmmlink.plant.trend": (
            "FEWEST_BEFORE_ALARM",
            "FORM_TYPES",
            "Trend",
            "alarm_words",
            "broken_words",
            "new_violations",
            "trend_of",
        ),
        "cmmlink.plant.western_electric": (
            "ControlLimits",
            "RuleViolation",
        ),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "FEWEST_BEFORE_ALARM",
    "FORM_TYPES",
    "STRIP_PARTS",
    "BudgetOfU",
    "Capability",
    "CapabilityIndex",
    "ControlChart",
    "ControlCharts",
    "ControlLimits",
    "CrossedStudy",
    "Drift",
    "DriftingStretch",
    "PartCharacteristic",
    "ProfileStrip",
    "ProfileStrips",
    "Reference",
    "ResultSeries",
    "ResultsDatabase",
    "RuleViolation",
    "RunFound",
    "SourceOfU",
    "StationStudy",
    "StoredEvent",
    "StoredRun",
    "StoredValue",
    "StudiedCharacteristic",
    "Study",
    "StudyFinding",
    "StudyFindings",
    "StudyRun",
    "Trend",
    "TypeOneStudy",
    "address_of",
    "alarm_words",
    "broken_words",
    "budget_of",
    "capability",
    "crossed_study",
    "drift_of",
    "findings_of",
    "individuals_charts",
    "is_server",
    "mean_range_charts",
    "month_of",
    "new_violations",
    "read_study",
    "station_study",
    "strip_of",
    "study_text",
    "trend_of",
    "type_one_study",
    "without_password",
    "words_of",
]
