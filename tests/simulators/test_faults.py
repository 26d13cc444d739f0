"""The catalogue: what is asked for happens, as often as asked for, and is counted."""

import numpy as np
import pytest

from simulators.faults import CATALOGUE, Fault, Injector

DATA = bytes(range(256)) * 400


def frames(injector: Injector, count: int) -> list[int]:
    """The numbers in the order in which they go out."""
    sent = [number for index in range(count) for number in injector.points_stored_at(index)]
    held = injector.release()
    return [*sent, int.from_bytes(held, "big")] if held else sent


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("flip", Fault("flip", 1e-4, 0)),
        ("flip:0.5", Fault("flip", 0.5, 0)),
        ("die@20", Fault("die", 9, 20)),
        ("unplug:2.5@7", Fault("unplug", 2.5, 7)),
        ("silence", Fault("silence", float("inf"), 0)),
        ("invalid:1@20-30", Fault("invalid", 1.0, 20, 30)),
    ],
)
def test_written_faults(text: str, fault: Fault) -> None:
    assert Fault.parse(text) == fault


@pytest.mark.parametrize(
    ("text", "complaint"), [("flop", "fault 'flop' is none of flip"), ("die@x", "expected NAME"), ("die:x", "expected NAME")]
)
def test_mistakes_are_named(text: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        Fault.parse(text)


def test_every_kind_says_what_its_value_means() -> None:
    assert all(len(kind.meaning) > 20 for kind in CATALOGUE.values())


def test_flips_turn_over_one_bit_in_the_share_of_bytes() -> None:
    injector = Injector([Fault("flip", 0.01, 0)], seed=1)
    damaged = injector.damage(DATA)
    changed = np.frombuffer(damaged, np.uint8) ^ np.frombuffer(DATA, np.uint8)
    assert len(damaged) == len(DATA)
    assert set(np.unique(changed)) <= {0, 1, 2, 4, 8, 16, 32, 64, 128}
    assert np.count_nonzero(changed) == injector.tally["flip"]
    assert 0.008 < injector.tally["flip"] / len(DATA) < 0.012


@pytest.mark.parametrize(("name", "sign"), [("lost-bytes", -1), ("inserted-bytes", 1)])
def test_bytes_vanish_and_appear(name: str, sign: int) -> None:
    injector = Injector([Fault(name, 0.01, 0)], seed=1)
    assert len(injector.damage(DATA)) == len(DATA) + sign * injector.tally[name]
    assert injector.tally[name] > 0


def test_frames_are_lost_repeated_and_reordered_as_counted() -> None:
    lost = Injector([Fault("lost-frames", 0.1, 50)], seed=1)
    sent = frames(lost, 1000)
    assert sent[:50] == list(range(50))
    assert len(sent) == 1000 - lost.tally["lost-frames"]
    repeated = Injector([Fault("repeated-frames", 0.1, 0)], seed=1)
    assert len(frames(repeated, 1000)) == 1000 + repeated.tally["repeated-frames"]
    reordered = Injector([Fault("reordered-frames", 0.1, 0)], seed=1)
    sent = frames(reordered, 1000)
    assert sorted(sent) == list(range(1000))
    assert np.count_nonzero(np.diff(sent) < 0) == reordered.tally["reordered-frames"] > 0


def test_a_gap_and_events_strike_once_at_their_point() -> None:
    injector = Injector([Fault("gap", 5, 10), Fault("stall", 2.0, 12)], seed=1)
    assert frames(injector, 30) == [*range(10), *range(15, 30)]
    assert [injector.strike("stall", index) for index in (11, 12, 13)] == [None, 2.0, None]
    assert injector.next_stop(0, 30) == 10
    assert injector.next_stop(10, 30) == 12
    assert injector.next_stop(12, 30) == 30


def test_a_fault_ends_where_it_is_told() -> None:
    injector = Injector([Fault("lost-frames", 1, 10, 15), Fault("flip", 1, 20, 25)], seed=1)
    assert [injector.next_stop(index, 30) for index in (0, 10, 15, 20, 25)] == [10, 15, 20, 25, 30]
    assert frames(injector, 30) == [*range(10), *range(15, 30)]
    assert injector.damage(DATA) == DATA
    injector.note_progress(20)
    assert injector.damage(DATA) != DATA


def test_the_same_seed_gives_the_same_damage() -> None:
    faults = [Fault("flip", 0.01, 0), Fault("lost-bytes", 0.01, 0)]
    assert Injector(faults, 3).damage(DATA) == Injector(faults, 3).damage(DATA) != Injector(faults, 4).damage(DATA)
