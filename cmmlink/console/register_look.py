"""A look into the registers of a Modbus device while they change, and the map that is made of what was seen there.

Nothing is written to the device, and nothing is read of it while the station does anything else.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from cmmlink.console.job import Job
from cmmlink.console.refused import Refused, without_folders
from cmmlink.console.register_words import KeepMap, LookAtRegisters, MapSaved, RegisterRow, RegisterTable
from cmmlink.devices import PARITIES, ModbusPlace, source_of_survey
from cmmlink.errors import PlanError
from cmmlink.new_map import FIELDS, MapAnswers, map_text, mm_per_unit_from, place_from
from cmmlink.new_plan import refuse_name, save_plan
from cmmlink.plan import find_mistakes
from drivers import KINDS, TABLES, WORD_ORDERS, DeviceError, RegisterSurvey, ScanSource, registers_of, stored_number

Choice = TypeVar("Choice", bound=str)

MAPS = "maps"  # the folder beside the plans that keeps them: there they are not taken for plans
_PAUSE_S = 0.4  # between two readings
_LONGEST_S = 300.0  # so that a look that was forgotten keeps nobody from measuring
_LONGEST_NAME = 120
_FASTEST = 10_000_000  # baud
_COLUMNS = tuple((kind, order) for kind in KINDS for order in WORD_ORDERS[: registers_of(kind)])
_HEADS = tuple((kind, order if registers_of(kind) > 1 else "") for kind, order in _COLUMNS)
_NONE = RegisterTable("none", "", "", "", _HEADS, ())


class RegisterLook:
    """The look that goes on, or the last one. `state` is replaced as a whole by the job's thread; readers wait for nobody."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.state = _NONE

    def begin(self, asked: LookAtRegisters) -> Callable[[Job], None]:
        """Begin another look. Returns what a job has to do for it. Raises Refused."""
        try:
            table = _one_of(asked.table, TABLES, "table")
            survey = RegisterSurvey(table, asked.first, asked.count, device=asked.address)
            source = source_of_survey(_place_of(asked), survey, _PAUSE_S)
        except (PlanError, ValueError) as error:
            raise Refused(str(error)) from None
        self.state = replace(_NONE, state="reading", message="connecting", address=asked.address, table=table)
        return lambda job: self._look(job, source, survey)

    def _look(self, job: Job, source: ScanSource, survey: RegisterSurvey) -> None:
        began_s, done, ending = self._clock(), 0, "stopped"
        try:
            job.attach(source)
            for _ in source.arrivals():
                if survey.done > done:
                    done = survey.done
                    self.state = replace(self.state, message="", rows=tuple(_rows_of(survey)))
                if self._clock() - began_s > _LONGEST_S:
                    ending = f"stopped after {_LONGEST_S / 60:g} minutes; read again to go on"
                    break
        except DeviceError as error:
            self.state = replace(self.state, state="failed", message=without_folders(str(error)))
        except Exception as error:  # in a thread of its own nobody else would hear of a defect
            self.state = replace(self.state, state="failed", message=f"defect in the program: {error!r}")
        else:
            self.state = replace(self.state, state="over", message=ending)
        finally:
            source.stop()


def keep_map(asked: KeepMap, folder: Path) -> MapSaved:
    """Save a map in the folder of maps beside the plans, and check it as `cmmlink check` does; or say what is wrong, and save nothing."""
    name = asked.name.strip()
    name = name if name.lower().endswith((".yaml", ".yml")) else f"{name}.yaml"
    maps, taken = folder / MAPS, False
    try:
        text = map_text(_answers_of(asked))
        refuse_name(maps, name, overwrite=True)
        if maps.is_symlink():
            raise PlanError(f"the folder {MAPS} beside the plans leads elsewhere: expected a folder")
        maps.mkdir(exist_ok=True)
        taken = os.path.lexists(maps / name) and not asked.replace
        path = save_plan(maps, name, text, overwrite=asked.replace)
        mistakes = find_mistakes(path)
    except PlanError as error:
        return MapSaved(problem=without_folders(str(error)), taken=taken)
    return MapSaved(f"{MAPS}/{path.name}", "; ".join(mistake.words for mistake in mistakes))


def _answers_of(asked: KeepMap) -> MapAnswers:
    """What a map is made of. Raises PlanError."""
    places = {field: getattr(asked, field).strip() for field in FIELDS}
    device = asked.device.strip()
    if not device or not device.isprintable() or len(device) > _LONGEST_NAME:
        raise PlanError(f"the device needs a name that is printable and at most {_LONGEST_NAME} characters long")
    return MapAnswers(
        device,
        _one_of(asked.table, TABLES, "table"),
        _one_of(asked.word_order, WORD_ORDERS, "word order"),
        {field: place_from(text, field) for field, text in places.items() if text},
        mm_per_unit_from(asked.scale),
    )


def _place_of(asked: LookAtRegisters) -> ModbusPlace:
    """Where to look. Raises PlanError."""
    if not 0 <= asked.device_id <= 255:
        raise PlanError(f"device id {asked.device_id}: expected 0 to 255")
    if not 0 < asked.baud_rate <= _FASTEST:
        raise PlanError(f"baud rate {asked.baud_rate}: expected more than 0")
    return ModbusPlace(asked.address.strip(), asked.device_id, asked.baud_rate, _one_of(asked.parity, PARITIES, "parity"))


def _one_of(given: str, known: Sequence[Choice], what: str) -> Choice:
    """The one of the known words that was given. Raises PlanError."""
    for word in known:
        if word == given:
            return word
    raise PlanError(f"{what} {given!r}: expected one of {', '.join(known)}")


def _rows_of(survey: RegisterSurvey) -> Iterator[RegisterRow]:
    """The registers in words, those that the device does not have without any."""
    for at in range(survey.first, survey.first + survey.count):
        if at not in survey.words:
            yield RegisterRow(at, "", ())
            continue
        numbers = (stored_number(survey.words, at, kind, order) for kind, order in _COLUMNS)
        yield RegisterRow(at, f"{survey.words[at]:04x}", tuple(map(_spelled, numbers)))


def _spelled(number: int | float | None) -> str:
    return "" if number is None else f"{number:.7g}" if isinstance(number, float) else str(number)
