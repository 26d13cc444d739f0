"""docs/machines.md: the program that asks for the verdict and waits, run by a control that stands in for a real one."""

import re
from pathlib import Path

import numpy as np

from cmmlink.answer import CODE_OF, NOT_JUDGED
from cmmlink.answer_file import replace_answer
from drivers import ScanOpened, decoder
from inspection import Verdict
from tests.docs.macro_control import AlarmError, Control, programs_in

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "machines.md").read_text(encoding="utf-8")
ANSWER, ASKING = re.findall(r"```nc\n(.*?)```", PAGE.split("### The answer to the machine\n")[1], re.DOTALL)[:2]
NO_ANSWER, FAILED = 1, 2  # alarms


def answer(code: int, request: int) -> str:
    """The page's answer with another verdict and number."""
    return str(ANSWER).replace("#150=1.", f"#150={code}.").replace("#152=4711.", f"#152={request}.")


def ended(*answers: str, before: int = 41) -> tuple[int, list[str], int]:
    """The alarm of the page's program (0: it passed the part), what it printed, and how long it waited, in seconds.

    answers : what stands there whenever it has waited, one after the other, and the last one from then on
    before  : the number of the request before
    """
    programs, left, waited_s = programs_in(ASKING), list(answers), [0.0]

    def dwell(seconds: float) -> None:
        waited_s[0] += seconds
        programs.update(programs_in(left.pop(0) if len(left) > 1 else left[0]))

    control = Control(programs, lambda start_mm, target_mm: None, np.zeros(3), dwell=dwell)
    control.shared[510] = before
    try:
        control.run(7100)
    except AlarmError as alarm:
        return int(alarm.args[0]), control.printed, round(waited_s[0])
    return 0, control.printed, round(waited_s[0])


def test_the_program_passes_a_part_for_the_verdict_conform_alone() -> None:
    for verdict, code in CODE_OF.items():
        alarm, printed, waited_s = ended(answer(code, 42))
        assert (alarm == 0) is (verdict is Verdict.CONFORM)
        assert (alarm, waited_s) == (0 if verdict is Verdict.CONFORM else FAILED, 1)
        assert printed == ["REQUEST      42", "START", "END"]


def test_the_program_waits_past_what_answers_others_and_gives_up_after_a_minute() -> None:
    assert ended(answer(1, 41), answer(NOT_JUDGED, 0), answer(NOT_JUDGED, 0), answer(1, 42))[::2] == (0, 4)
    assert ended(answer(1, 41))[::2] == (NO_ANSWER, 60)


def test_numbers_of_requests_begin_anew_before_they_are_too_long() -> None:
    assert ended(answer(1, 9_999_999), before=9_999_998)[:2] == (0, ["REQUEST 9999999", "START", "END"])
    assert ended(answer(1, 1), before=9_999_999)[:2] == (0, ["REQUEST       1", "START", "END"])


def test_the_request_that_the_program_prints_is_read(tmp_path: Path) -> None:
    _, printed, _ = ended(answer(1, 42))
    points = ["G801 N1 X0. Y1.5 Z0. R1.5"]
    read = decoder("g800", unit="mm").feed("\r".join([*printed[:2], *points, printed[2], ""]).encode("ascii"))
    assert [arrival.request for arrival in read if isinstance(arrival, ScanOpened)] == [42]
    replace_answer(tmp_path / "O9100.nc", ANSWER.replace("\n", "\r\n").encode("ascii"))
    replace_answer(tmp_path / "O9100.nc", b"")  # what the page shows is known as an answer, and makes way
