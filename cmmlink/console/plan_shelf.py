"""The plans of a station: those that its folder holds now, new ones, and that of the demonstration once it was asked for."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cmmlink.console.choice import Choice, check_choice
from cmmlink.console.form_answers import PlanSaved, Understood
from cmmlink.console.plan_form import PlanForm, save_form, understand_nominal
from cmmlink.console.refused import Refused, answer_errors
from cmmlink.console.register_look import keep_map
from cmmlink.console.register_words import KeepMap, MapSaved
from cmmlink.console.station_setup import StationSetup

DEMO = "demonstration"  # no plan of a folder has this name, for it does not end in .yaml


@dataclass(frozen=True, slots=True)
class Listed:
    """Names of the plans that there are, and why they could not be listed."""

    plans: tuple[str, ...] = ()
    ct_plans: tuple[str, ...] = ()
    problem: str = ""


class PlanShelf:
    """Finds, checks and saves plans. Reads folders, which may be far away: whoever asks waits. Holds no lock."""

    def __init__(self, setup: StationSetup) -> None:
        self._setup = setup
        self._shows_demo = False

    @property
    def can_make_plans(self) -> bool:
        """Whether there is a folder that a new plan is saved in."""
        return self._setup.folder is not None

    @property
    def can_run_demo(self) -> bool:
        """Whether there is a demonstration."""
        return self._setup.demo is not None

    def listed(self) -> Listed:
        """Look which plans there are now."""
        try:
            surfaces = self._setup.ct_plans() if self._setup.inspect_surface else {}
            return Listed(tuple(sorted(self._plans())), tuple(sorted(surfaces)))
        except OSError as error:
            return Listed(problem=str(error))

    def check(self, name: str) -> Choice:
        """Check a plan with everything it names, short of the device. Raises Refused where there is none of this name."""
        with answer_errors():
            file = self._plans().get(name)
        if file is None:
            raise Refused(f"there is no plan {name!r} at this station")
        return check_choice(name, file)

    def surface_plan(self, name: str) -> Path:
        """The file of a plan of a CT surface. Raises Refused where there is none of this name."""
        with answer_errors():
            file = self._setup.ct_plans().get(name)
        if file is None:
            raise Refused(f"there is no CT plan {name!r} at this station")
        return file

    def show_demo(self) -> None:
        """Have the plan of the demonstration among the others from now on. Raises Refused where there is none."""
        if self._setup.demo is None:
            raise Refused("this station has no demonstration")
        self._shows_demo = True

    def understand(self, answers: Mapping[str, str], content: bytes) -> Understood:
        """Read a nominal that a page hands in, for a new plan. Raises Refused."""
        return understand_nominal(PlanForm.of(answers), content, self._folder())

    def save(self, answers: Mapping[str, str], content: bytes) -> PlanSaved:
        """Save a new plan and the nominal that a page hands in; or say what is wrong, and save nothing. Raises Refused."""
        return save_form(PlanForm.of(answers), content, self._folder(), overwrite=answers.get("replace") == "yes")

    def keep_map(self, asked: KeepMap) -> MapSaved:
        """Save a register map beside the plans, or say what is wrong. Raises Refused."""
        return keep_map(asked, self._folder())

    def _folder(self) -> Path:
        if self._setup.folder is None:
            raise Refused("this station has no folder of plans: start it with cmmlink console FOLDER")
        return self._setup.folder

    def _plans(self) -> Mapping[str, Path]:
        demo = {DEMO: self._setup.demo} if self._shows_demo and self._setup.demo else {}
        return {**self._setup.plans(), **demo}
