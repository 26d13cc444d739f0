"""The two laws over every source: what is missing never improves a verdict, and order, density and batches never change one.

The parts carry a step that no zone holds, in rows chosen at random, and the faults of the catalogue strike just there or anywhere.
Whatever the fault takes away, the part never conforms: either the step is seen, or it is known, or seen as a gap, that it was not.
"""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.source import WireBytes
from inspection import Verdict
from simulators.faults import CATALOGUE, Fault
from tests.drivers.codecs.streams import account
from tests.integration.encoded_scans import Source, Transcript, decode, registers
from tests.integration.judged_scans import COUNT, judge, scan_of
from tests.integration.machine_scans import EVERY_SOURCE as SOURCES

BUSY = [HealthCheck.too_slow]  # a machine that is busy with other things is no fault of a case
LAW = settings(max_examples=max(2, settings().max_examples // 50), deadline=None, suppress_health_check=BUSY)  # `make laws` tries more
WIDTHS = st.integers(6, 20)  # rows of the step, longer than the longest gap that counts as measured
SHARE = ("flip", "lost-bytes", "inserted-bytes")
FRAMES = ("lost-frames", "repeated-frames", "reordered-frames", "invalid", "sentinel", "no-contact", "wrong-tag", "lone-lf", "split-points")
LASTING = ("stall", "silence", "unplug", "restart", "slow")  # whose value is so many seconds
SHORT_S = 2e-4


def speaks_registers(source: Source) -> bool:
    return source.encode.__qualname__.startswith(registers.__name__)


def kinds_of(source: Source) -> list[str]:
    """The faults that this source may meet; a Modbus device that dies would take this process with it, and is tried elsewhere."""
    if source.faults:
        return list(source.faults)
    common = {name: kind for name, kind in CATALOGUE.items() if kind.only in ((), ("registers",))}
    return [name for name, kind in common.items() if (name != "die" if speaks_registers(source) else not kind.only)]


@st.composite
def faults_at(draw: st.DrawFn, source: Source, first: int, stop: int) -> list[Fault]:
    """One to three faults that strike rows first .. stop - 1, or, when they have no end, from there on."""
    faults = []
    for name in draw(st.lists(st.sampled_from(kinds_of(source)), min_size=1, max_size=3, unique=True)):
        if name in SHARE:
            faults.append(Fault(name, draw(st.sampled_from([0.002, 0.02, 0.2, 1.0])), first, stop))
        elif name in FRAMES:
            faults.append(Fault(name, draw(st.sampled_from([0.3, 1.0])), first, stop))
        elif name in ("gap", "overflow"):
            faults.append(Fault(name, stop - first, first))
        elif name == "burst":
            faults.append(Fault(name, draw(st.integers(20, 800)), first))
        else:
            faults.append(Fault(name, SHORT_S if name in LASTING else 9.0, first))
    return faults


@st.composite
def struck(draw: st.DrawFn, source: Source) -> tuple[int, int, list[Fault], int]:
    """Rows of a step, the faults there, and their seed; often at one of the two ends of the scan."""
    width = draw(WIDTHS)
    first = draw(st.one_of(st.just(0), st.just(COUNT - width), st.integers(0, COUNT - width)))
    return first, first + width, draw(faults_at(source, first, first + width)), draw(st.integers(0, 2**30))


def read(source: Source, transcript: Transcript, cuts: np.random.Generator | None = None) -> tuple[object, ...]:
    """The points in their order, every count, and what ended the scan."""
    found = decode(source, transcript, COUNT, cuts)
    book = account(arrival for arrival in found if not isinstance(arrival, Exception | WireBytes))
    return book.sequence, book.points_mm, book.counts, book.others, type(found[-1])


@pytest.mark.parametrize("name", SOURCES)
def test_a_sound_scan_is_told_from_one_with_a_step(name: str) -> None:
    source = SOURCES[name]
    good, bad = (judge(name, source.encode(scan_of(source, first, 80), [], 1)) for first in (80, 70))
    assert (good.conforms, good.missing, good.counts_ok) == (True, False, True)
    assert bad.verdict == Verdict.NONCONFORM


# ---- law I


@pytest.mark.parametrize("name", SOURCES)
@given(data=st.data())
@LAW
def test_no_fault_hides_a_step_and_no_count_is_wrong(name: str, data: st.DataObject) -> None:
    source = SOURCES[name]
    first, stop, faults, seed = data.draw(struck(source))
    transcript = source.encode(scan_of(source, first, stop), faults, seed)
    said = judge(name, transcript)
    assert said.counts_ok
    assert not said.conforms
    assert read(source, transcript, np.random.default_rng(seed)) == read(source, transcript)


@pytest.mark.parametrize("name", SOURCES)
@given(data=st.data())
@LAW
def test_a_good_part_of_which_anything_is_missing_is_not_conform_and_not_scrapped(name: str, data: st.DataObject) -> None:
    source = SOURCES[name]
    _, _, faults, seed = data.draw(struck(source))
    said = judge(name, source.encode(scan_of(source), faults, seed))
    assert said.counts_ok
    if said.missing or said.outcome.failure is not None:
        assert not said.conforms
    if source.sound:
        assert said.verdict != Verdict.NONCONFORM


@pytest.mark.parametrize("name", ["ascii", "binary blocks", "modbus ring", "gocator"])
@given(data=st.data())
@LAW
def test_no_fault_hides_a_step_where_the_pose_is_fitted(name: str, data: st.DataObject) -> None:
    source = SOURCES[name]
    first, stop, faults, seed = data.draw(struck(source))
    said = judge(name, source.encode(scan_of(source, first, stop), faults, seed), fit="best-fit")
    assert said.counts_ok
    assert not said.conforms


# ---- law II


@pytest.mark.parametrize("name", [name for name, source in SOURCES.items() if not source.flat])
@given(seed=st.integers(0, 2**30), width=st.sampled_from([0, 12]), dwell=st.integers(0, COUNT - 1))
@LAW
def test_order_and_density_never_change_a_verdict(name: str, seed: int, width: int, dwell: int) -> None:
    source, rng = SOURCES[name], np.random.default_rng(seed)
    points = scan_of(source, 70, 70 + width)
    denser = np.concatenate([points, np.repeat(points[dwell : dwell + 1], 20, axis=0), points[rng.integers(0, COUNT, 20)]])
    mixed = rng.permutation(denser)
    expected = judge(name, source.encode(points, [], seed))
    said = judge(name, source.encode(mixed, [], seed), count=len(mixed))
    assert said.verdict == expected.verdict == (Verdict.NONCONFORM if width else Verdict.CONFORM)
    assert (said.outcome.counts.judged, said.missing) == (len(mixed), False)


HARMLESS = ("reordered-frames", "repeated-frames", "stall", "silence")


@pytest.mark.parametrize(
    ("name", "fault"),
    [(name, fault) for name, source in SOURCES.items() if source.sound for fault in HARMLESS if fault in kinds_of(source)],
)
def test_what_takes_nothing_away_changes_no_verdict(name: str, fault: str) -> None:
    source = SOURCES[name]
    share = SHORT_S if fault in ("stall", "silence") else 0.3
    for width, verdict in ((0, Verdict.CONFORM), (12, Verdict.NONCONFORM)):
        said = judge(name, source.encode(scan_of(source, 70, 70 + width), [Fault(fault, share, 20, 150)], 1))
        assert (said.verdict, said.outcome.failure, said.missing) == (verdict, None, False)
        assert said.outcome.counts.judged == COUNT


# ---- what the laws stand on


@pytest.mark.parametrize("name", SOURCES)
def test_a_busy_computer_changes_nothing_of_what_passes_over_the_wire(name: str) -> None:
    """So the laws are decided by content, and a case that fails once fails again."""
    source, faults = SOURCES[name], [Fault("stall", SHORT_S, 20), Fault("flip", 0.02, 10, 40), Fault("silence", SHORT_S, 60)]
    assert source.encode(scan_of(source), faults, 7) == source.encode(scan_of(source), faults, 7)
