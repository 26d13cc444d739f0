"""A simulated control that waits for its answer: it takes a whole program for its own request alone, and releases for CONFORM alone."""

from pathlib import Path

import pytest

from simulators.answers import LOOK_S, await_answer, variables_set_by
from simulators.settings import settings_from

ANSWER = "O9100 (CMMLINK ANSWER)\r\n(RUN 7)\r\n#150={code}.\r\n#151=-.0231 (WORST DEVIATION MM)\r\n#152={request}. (REQUEST)\r\nM99\r\n"


def waited(file: Path, *programs: str, request: int = 42, within_s: float = 1.0) -> str:
    """What the control does where these programs stand there, one after the other, whenever it has looked."""
    now_s, left = [0.0], list(programs)

    def sleep(seconds: float) -> None:
        now_s[0] += seconds
        if left:
            file.write_text(left.pop(0), encoding="ascii", newline="")

    return await_answer(file, request, within_s, lambda: now_s[0], sleep)


@pytest.mark.parametrize(
    ("code", "does"),
    [
        (1, "CONFORM, worst deviation -0.0231: the part is released"),
        (2, "NOT CONFORM, worst deviation -0.0231: the machine stops"),
        (3, "NOT PROVEN, worst deviation -0.0231: the machine stops"),
        (9, "NOT JUDGED, worst deviation -0.0231: the machine stops"),
        (0, "verdict 0, worst deviation -0.0231: the machine stops"),
    ],
)
def test_a_part_is_released_for_one_verdict_alone(code: int, does: str, tmp_path: Path) -> None:
    assert waited(tmp_path / "O9100.nc", ANSWER.format(code=code, request=42)) == f"request 42: {does}"


def test_a_control_waits_past_answers_to_other_requests(tmp_path: Path) -> None:
    programs = (ANSWER.format(code=1, request=41), ANSWER.format(code=9, request=0), ANSWER.format(code=2, request=42))
    assert waited(tmp_path / "O9100.nc", *programs) == "request 42: NOT CONFORM, worst deviation -0.0231: the machine stops"


def test_a_control_stops_where_no_answer_to_its_request_comes(tmp_path: Path) -> None:
    file = tmp_path / "O9100.nc"
    assert waited(file, within_s=2 * LOOK_S) == "request 42: no answer within 0.1 s: the machine stops"
    stale = ANSWER.format(code=1, request=41)
    assert waited(file, stale) == "request 42: no answer within 1 s; what stands there answers request 41: the machine stops"


@pytest.mark.parametrize(
    "program",
    [
        "",
        "#150=1.\r\n#152=42.\r\nM99\r\n",
        ANSWER.format(code=1, request=42).removesuffix("M99\r\n"),
        ANSWER.format(code=1, request=42).replace("(RUN 7)", "G0 X0."),
        ANSWER.format(code=1, request=42).replace("=42.", "="),
    ],
)
def test_what_is_no_whole_program_is_not_taken(program: str, tmp_path: Path) -> None:
    assert variables_set_by(program) is None
    assert "no answer within 1 s: the machine stops" in waited(tmp_path / "O9100.nc", program)


def test_numbers_are_read_as_controls_read_them() -> None:
    assert variables_set_by("O1\n#1=1.\n#2=-0.5 (MM)\n#3=.25\n#4=7\nM99") == {1: 1.0, 2: -0.5, 3: 0.25, 4: 7.0}


@pytest.mark.parametrize("number", ["0", "10000000", "x", "9" * 5000])
def test_a_request_that_no_control_can_make_is_refused(number: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        settings_from(["--address", "pty", "--path", "points.csv", "--request", number], "simulate")
    assert f"--request: expected a whole number from 1 to 9999999, got {number!r}" in capsys.readouterr().err
