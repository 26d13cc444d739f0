"""An archive judged again: any number of recorded runs by a changed plan, in many processes. This is the front door."""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.archive.cluster import Cluster
    from cmmlink.archive.judging import judge_runs
    from cmmlink.archive.keeping import Keeper
    from cmmlink.archive.processes import Here, Processes
    from cmmlink.archive.rejudging import Rejudged, rejudge
    from cmmlink.archive.rows import COLUMNS, Row
    from cmmlink.archive.scheduling import Workers, judge_all
    from cmmlink.archive.tasks import MOST_RUNS, Failure, Outcome, RunAsked, Task
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.archive.cluster": ("Cluster",),
        "cmmlink.archive.judging": ("judge_runs",),
        "cmmlink.archive.keeping": ("Keeper",),
        "cmmlink.archive.processes": ("Here", "Processes"),
        "cmmlink.archive.rejudging": ("Rejudged", "rejudge"),
        "cmmlink.archive.rows": ("COLUMNS", "Row"),
        "cmmlink.archive.scheduling": ("Workers", "judge_all"),
        "cmmlink.archive.tasks": ("MOST_RUNS", "Failure", "Outcome", "RunAsked", "Task"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "COLUMNS",
    "MOST_RUNS",
    "Cluster",
    "Failure",
    "Here",
    "Keeper",
    "Outcome",
    "Processes",
    "Rejudged",
    "Row",
    "RunAsked",
    "Task",
    "Workers",
    "judge_all",
    "judge_runs",
    "rejudge",
]
