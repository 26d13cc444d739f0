"""The application: plans, runs, records, reports and the command line. This is its front door for scripts.

plan = load_plan(Path("blade.yaml"))
profile = profile_of(plan)
with connect(plan) as device:
run = carry_out(plan, profile, device, records=None, clock=time.monotonic, now=datetime.now, stop=threading.Event())
run.result_json()["verdict"]
"""

from cmmlink.devices import Connected, connect
from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.from_plan import profile_of
from cmmlink.plan import CtPlan, Plan, load_ct_plan, load_plan
from cmmlink.run import FinishedRun, carry_out
from cmmlink.stack import StackOutcome, inspect_stack
from cmmlink.version import __version__

__all__ = [
    "Connected",
    "CtPlan",
    "FinishedRun",
    "Plan",
    "PlanError",
    "RunError",
    "StackOutcome",
    "StoreError",
    "__version__",
    "carry_out",
    "connect",
    "inspect_stack",
    "load_ct_plan",
    "load_plan",
    "profile_of",
]
