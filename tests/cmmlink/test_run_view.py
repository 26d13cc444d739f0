"""The newest state of a run: what it says, and that nobody waits for it."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest

from cmmlink.events import Answered, Arrived, Counts, Evaluated, Judged, ProvenOut, RunFinished, RunStarted
from cmmlink.extremes import Extremes, PointsVersion
from cmmlink.run_context import RunContext
from cmmlink.run_state import AnswerState
from cmmlink.run_view import RunView
from drivers import Arrival, LinkDown, LinkUp, PointBatch, ScanClosed, ScanOpened
from inspection import LiveUpdate, NominalProfile, NurbsCurve, State, ToleranceZone, Verdict, discretize
from tests.cmmlink.test_characteristic_rows import CHORD, OUT, PROVEN

UNSEEN = PointsVersion(-1, 0)
NOON = datetime(2026, 11, 22, 12)


@pytest.fixture(scope="module")
def profile() -> NominalProfile:
    return discretize(NurbsCurve.interpolate(np.array([[0.0, 0.0], [50.0, 10.0], [100.0, 0.0], [150.0, 5.0]])), material="left")


class Played:
    """A view whose clock and events the test plays."""

    def __init__(self, profile: NominalProfile, base: int | None = 0, *, answers: bool = False) -> None:
        self.now_s = 100.0
        self.profile = profile
        zone = ToleranceZone(-0.05, 0.05, 0.01)
        context = RunContext("7", "blade.yaml", profile, zone, 0.95, 5000, NOON, base=base, answers=answers)
        self.view = RunView(context, lambda: self.now_s, lambda: NOON)
        self.view(RunStarted("blade", "B-1", "Ada", "COM3", False))

    def arrive(self, arrival: Arrival) -> None:
        self.view(Arrived(self.now_s, arrival))

    def judge(self, first: int, deviation_mm: list[float], state: State = "provisional", received: int | None = None) -> None:
        count = first + len(deviation_mm)
        counts = Counts(received=count if received is None else received, judged=count)
        self.view(Judged(self.now_s, 0.02, self.update(first, deviation_mm, state), counts))

    def update(self, first: int, deviation_mm: list[float], state: State = "provisional") -> LiveUpdate:
        m = len(deviation_mm)
        station = np.linspace(0, self.profile.length_mm, m)
        deviation = np.array(deviation_mm)
        foot = np.column_stack([station, np.zeros(m)])
        actual = foot + np.column_stack([np.zeros(m), deviation])
        verdicts = np.select([np.abs(deviation) > 0.06, np.abs(deviation) > 0.04], [2, 1], 0).astype(np.int8)
        return LiveUpdate(state, first, first + m, actual, foot, station, deviation, verdicts, 0.003, None)


@pytest.fixture
def played(profile: NominalProfile) -> Played:
    return Played(profile)


def points(count: int) -> PointBatch:
    return PointBatch(np.arange(count), np.zeros(count), np.zeros((count, 3)))


def test_phases_follow_the_device_and_the_operator(played: Played) -> None:
    view = played.view
    assert (view.state().phase, view.state().verdict.why) == ("preparing", "preparing the inspection")
    view.await_device()
    assert (view.state().phase, view.state().link) == ("starting", "connecting")
    played.arrive(ScanOpened("scanner", "S-9", 400))
    state = view.state()
    assert (state.phase, state.link, state.device, state.expected) == ("measuring", "up", "scanner S-9", 400)
    played.arrive(LinkDown("unplugged"))
    assert (view.state().link, view.state().link_detail) == ("down", "unplugged")
    played.arrive(LinkUp(0.5))
    assert (view.state().link, view.state().link_detail) == ("up", "back after 0.5 s")
    view.end_soon()
    played.arrive(points(3))
    assert view.state().phase == "ending", "what still arrives does not make it measure again"
    played.arrive(ScanClosed(None))
    assert view.state().link == "closed"
    assert not view.over
    view(RunFinished("complete", None, Counts(received=3, rejected=3), "the points do not fit"))
    assert view.over
    state = view.state()
    assert (state.phase, state.ending, state.message) == ("finished", "complete", "the points do not fit")
    assert (state.verdict.word, state.verdict.final, state.verdict.why) == ("NOT MEASURED", True, "the points do not fit")


def test_rate_and_sign_of_life_fade_when_nothing_comes(played: Played) -> None:
    for step in range(11):
        played.now_s = 100.0 + 0.1 * step
        played.arrive(points(100))
        played.judge(100 * step, [0.0] * 100)
    assert played.view.state().rate_per_s == pytest.approx(1000.0)
    assert played.view.state().streaming
    played.now_s += 4.0
    assert played.view.state().rate_per_s == pytest.approx(250.0)
    assert not played.view.state().streaming


def test_verdict_so_far_counts_what_is_out_and_begins_anew_with_the_points(played: Played) -> None:
    played.arrive(ScanOpened("scanner", "S-9", 3))
    played.judge(0, [0.0, 0.2, -0.03])
    state = played.view.state()
    assert (state.verdict.word, state.verdict.shape, state.out_of_tolerance) == ("LOOKS OUT", "not-proven", 1)
    assert state.verdict.why == "1 point so far, not proven"
    assert state.worst is not None
    assert (state.worst.deviation_mm, state.worst.verdict) == (0.2, "nonconform")
    assert (state.worst.x_mm, state.worst.y_mm) == pytest.approx((played.profile.length_mm / 2, 0.2))
    before = played.view.newest_points
    played.judge(0, [0.0, 0.01, -0.03], "settled")
    state = played.view.state()
    assert (state.out_of_tolerance, state.registration.state, state.verdict.word) == (0, "settled", "NOT PROVEN")
    assert state.worst is not None
    assert state.worst.deviation_mm == -0.03
    assert played.view.newest_points.generation == before.generation + 1
    assert len(played.view.points_since(before)[0].bins) == 3


def test_red_is_said_only_of_what_is_proven(played: Played) -> None:
    played.arrive(ScanOpened("scanner", "S-9", 4))
    played.judge(0, [0.0, 0.2, -0.03])
    assert played.view.state().verdict.shape == "not-proven"
    played.view(ProvenOut(played.now_s, 3))
    told = played.view.state().verdict
    assert (told.word, told.shape, told.final) == ("NOT CONFORM", "not-conform", False)
    assert told.why == "no placement of the first 3 points passes"
    played.judge(0, [0.0, 0.01, -0.03, 0.0])
    assert played.view.state().verdict == told, "more points cannot undo a proof"


def test_the_verdict_names_the_characteristic_that_it_comes_from(played: Played) -> None:
    played.arrive(ScanOpened("scanner", "S-9", 4))
    played.judge(0, [0.0, 0.01])
    told = []
    for chord in (CHORD, OUT, PROVEN):
        played.view(Evaluated(played.now_s, (replace(CHORD, name="contour"), chord), None))
        verdict = played.view.state().verdict
        told.append((verdict.word, verdict.shape, verdict.of))
    assert told == [("NOT PROVEN", "not-proven", ""), ("LOOKS OUT", "not-proven", "chord"), ("NOT CONFORM", "not-conform", "chord")]
    played.view(Evaluated(played.now_s, (replace(CHORD, name="contour"), OUT), None))
    played.view(ProvenOut(played.now_s, 2))
    assert [row.word for row in played.view.characteristics.rows] == ["NOT CONFORM", "LOOKS OUT"]
    assert played.view.state().verdict.of == "contour"


def test_points_out_prove_nothing_where_no_characteristic_need_fail_by_them(profile: NominalProfile) -> None:
    """As where the first profile is judged through a filter, which may take the points in."""
    played = Played(profile, base=None)
    played.arrive(ScanOpened("scanner", "S-9", 4))
    played.view(Evaluated(played.now_s, (CHORD, CHORD), None))
    played.judge(0, [0.0, 0.2], "settled")
    played.view(ProvenOut(played.now_s, 2))
    assert (played.view.state().verdict.word, played.view.state().verdict.shape) == ("LOOKS OUT", "not-proven")
    assert [row.word for row in played.view.characteristics.rows] == ["so far", "so far"]


def test_with_a_known_pose_a_point_that_is_out_is_proof(played: Played) -> None:
    played.arrive(ScanOpened("scanner", "S-9", 4))
    played.judge(0, [0.0, 0.055], "settled")
    assert played.view.state().verdict.word == "NOT PROVEN", "out by less than U"
    played.judge(2, [0.061], "settled")
    told = played.view.state().verdict
    assert (told.word, told.shape, told.final, told.why) == ("NOT CONFORM", "not-conform", False, "1 point out so far")


def test_what_looks_out_is_counted_at_the_pose_of_the_moment_whatever_the_verdicts_leave_room_for(played: Played) -> None:
    played.arrive(ScanOpened("scanner", "S-9", 4))
    update = played.update(0, [0.0, 0.2, -0.2, 0.058])
    played.view(Judged(played.now_s, 0.02, replace(update, verdicts=np.ones(4, dtype=np.int8)), Counts(received=4, judged=4)))
    assert (played.view.state().out_of_tolerance, played.view.state().verdict.word) == (2, "LOOKS OUT")


def test_state_that_was_given_never_changes(played: Played) -> None:
    played.judge(0, [0.0, 0.01])
    given = played.view.state()
    words = repr(given)
    played.judge(2, [0.3])
    assert repr(given) == words != repr(played.view.state())


def test_however_batches_are_cut_and_looked_at_the_same_is_shown(profile: NominalProfile) -> None:
    deviation = np.random.default_rng(4).normal(0.0, 0.03, 240)
    shown = []
    for size, is_looked_at in ((240, False), (7, False), (7, True), (1, False)):
        played = Played(profile)
        whole = played.update(0, deviation.tolist(), "settled")
        for first in range(0, len(deviation), size):
            rows = slice(first, first + size)
            arrays = {name: getattr(whole, name)[rows] for name in ("actual_mm", "foot_mm", "station_mm", "deviation_mm", "verdicts")}
            stop, played.now_s = first + len(arrays["station_mm"]), played.now_s + 1.0
            update = replace(whole, first=first, stop=stop, **arrays)
            played.view(Judged(played.now_s, 0.02, update, Counts(received=stop, judged=stop)))
            if is_looked_at:
                played.view.state()
        state, bins = played.view.state(), played.view.points_since(UNSEEN)[0]
        shown.append((state.judged, state.out_of_tolerance, state.worst, state.coverage, bins.bins.tolist(), bins.extremes.tolist()))
    assert all(other == shown[0] for other in shown[1:])
    assert shown[0][1] > 0


def test_what_nobody_looks_at_is_seen_to_by_the_run_itself(played: Played, monkeypatch: pytest.MonkeyPatch) -> None:
    added: list[int] = []
    add = Extremes.add

    def counted(extremes: Extremes, *columns: np.ndarray) -> None:
        added.append(len(columns[0]))
        add(extremes, *columns)

    monkeypatch.setattr(Extremes, "add", counted)
    for first in range(0, 100_000, 100):
        played.judge(first, [0.01] * 100)
    assert max(added) <= 8300
    assert sum(added) > 90_000
    assert played.view.state().judged == sum(added) == 100_000


def test_a_reader_that_is_late_does_not_show_what_was_before_the_end(played: Played, monkeypatch: pytest.MonkeyPatch) -> None:
    adding, released, add = threading.Event(), threading.Event(), Extremes.add

    def slow(extremes: Extremes, *columns: np.ndarray) -> None:
        adding.set()
        assert released.wait(60.0)
        add(extremes, *columns)

    monkeypatch.setattr(Extremes, "add", slow)
    played.judge(0, [0.3, 0.0, 0.0])
    with ThreadPoolExecutor(2) as pool:
        looked = pool.submit(played.view.state)
        assert adding.wait(30.0)
        ended = pool.submit(played.view, RunFinished("complete", None, Counts(received=5, rejected=5), "the points do not fit"))
        released.set()
        ended.result(30.0)
        looked.result(30.0)
    state = played.view.state()
    assert (state.phase, state.received, state.judged) == ("finished", 5, 0)


def test_nobody_waits_while_points_are_put_in_their_bins(played: Played, monkeypatch: pytest.MonkeyPatch) -> None:
    played.judge(0, [0.0, 0.01])
    assert played.view.state().judged == 2
    adding, released, add = threading.Event(), threading.Event(), Extremes.add

    def slow(extremes: Extremes, *columns: np.ndarray) -> None:
        adding.set()
        assert released.wait(60.0)
        add(extremes, *columns)

    monkeypatch.setattr(Extremes, "add", slow)
    played.judge(0, [0.3, 0.0, 0.0])
    with ThreadPoolExecutor(1) as pool:
        looked = pool.submit(played.view.state)
        assert adding.wait(30.0)
        state = played.view.state()
        assert (state.judged, state.out_of_tolerance) == (2, 0)
        assert len(played.view.points_since(UNSEEN)[0].bins) == 2
        played.judge(3, [0.0])
        played.view.end_soon()
        released.set()
        assert (looked.result(30.0).judged, looked.result(30.0).out_of_tolerance) == (3, 1)
    assert (played.view.state().judged, played.view.state().out_of_tolerance) == (4, 1)
    assert played.view.state().phase == "ending"


def test_a_machine_waits_until_it_was_told_or_was_not(profile: NominalProfile) -> None:
    assert Played(profile).view.state().answer is None
    view = Played(profile, answers=True).view
    assert view.state().answer == AnswerState("awaited")
    view(Answered("not withdrawn", None, NOON, "no folder"))
    assert view.state().answer == AnswerState("awaited")
    view(Answered("sent", 7, NOON, "", Verdict.UNCERTAIN))
    assert view.state().answer == AnswerState("sent", NOON.timestamp() * 1e3, 7, "", "NOT PROVEN")
    view(Answered("not sent", 7, NOON, "no folder"))
    assert view.state().answer == AnswerState("not sent", NOON.timestamp() * 1e3, 7, "no folder")


def test_a_run_that_breaks_off_tells_the_machine_nothing(profile: NominalProfile) -> None:
    view = Played(profile, answers=True).view
    view.fail("Record not kept: the disk is full")
    assert view.state().answer == AnswerState("not sent", problem="the run broke off")
