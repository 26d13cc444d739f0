"""The application: plans, runs, records, reports and the command line. This is its front door for scripts.

    found = inspect("cam-points.csv", nominal="cam.yaml", tolerance=(-0.05, 0.05))
    found.verdict, found.points.deviation_mm, found.to_dataframe(), found.plot()
    open_run("last").document["profile_error_mm"]
    inspect_surface("scan.csv", nominal="part.stp", tolerance=(-0.05, 0.05)).document["regions"]

A run with a device, which is recorded:

    plan = load_plan("blade.yaml")
    profile = profile_of(plan)
    with connect(plan) as device:
        run = carry_out(plan, profile, device, records=None, clock=time.monotonic, now=lambda: datetime.now(UTC), stop=Event())
    run.result_json()["verdict"], inspected_run(run).plot()

A name is loaded when it is used: the command line begins before its libraries are there.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.devices import Connected, connect
    from cmmlink.errors import PlanError, RunError, StoreError
    from cmmlink.from_plan import profile_of
    from cmmlink.inspected import Inspected, inspected_run
    from cmmlink.inspected_surface import InspectedSurface
    from cmmlink.plan import CtPlan, Plan, SurfacePlan, load_ct_plan, load_plan, load_surface_plan
    from cmmlink.run import FinishedRun, carry_out
    from cmmlink.scripting import inspect, nominal_profile, open_run
    from cmmlink.stack import StackOutcome, inspect_stack
    from cmmlink.surface_scripting import inspect_surface
    from cmmlink.version import __version__
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.devices": ("Connected", "connect"),
        "cmmlink.errors": ("PlanError", "RunError", "StoreError"),
        "cmmlink.from_plan": ("profile_of",),
        "cmmlink.inspected": ("Inspected", "inspected_run"),
        "cmmlink.inspected_surface": ("InspectedSurface",),
        "cmmlink.plan": ("CtPlan", "Plan", "SurfacePlan", "load_ct_plan", "load_plan", "load_surface_plan"),
        "cmmlink.run": ("FinishedRun", "carry_out"),
        "cmmlink.scripting": ("inspect", "nominal_profile", "open_run"),
        "cmmlink.stack": ("StackOutcome", "inspect_stack"),
        "cmmlink.surface_scripting": ("inspect_surface",),
        "cmmlink.version": ("__version__",),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "Connected",
    "CtPlan",
    "FinishedRun",
    "Inspected",
    "InspectedSurface",
    "Plan",
    "PlanError",
    "RunError",
    "StackOutcome",
    "StoreError",
    "SurfacePlan",
    "__version__",
    "carry_out",
    "connect",
    "inspect",
    "inspect_stack",
    "inspect_surface",
    "inspected_run",
    "load_ct_plan",
    "load_plan",
    "load_surface_plan",
    "nominal_profile",
    "open_run",
    "profile_of",
]
