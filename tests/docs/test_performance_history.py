"""What the benchmark keeps: a line a run, what got slower, and the table of the page."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.benchmarks import bench, history


def run(date: str, *figures: history.Figure, processor: str = "a processor") -> history.Run:
    return history.Run(date, "abc1234", f"{date}; a machine.", processor, figures, {"points": [(1e3, 40.0), (1e4, 20.0)]})


def figure(median: float, scatter: float = 0.0, unit: str = "s", name: str = "a command") -> history.Figure:
    return history.Figure(name, unit, median, median - scatter / 2, median + scatter / 2, 5, goal=2.0)


def test_a_run_comes_back_from_its_line(tmp_path: Path) -> None:
    kept = [run("2026-01-01", figure(1.0)), run("2026-01-02", figure(1.5), figure(3.0, unit="MB"))]
    for one in kept:
        history.append(one, tmp_path / "history.jsonl")
    assert history.runs(tmp_path / "history.jsonl") == kept
    assert history.runs(tmp_path / "none.jsonl") == []


def test_only_what_got_worse_by_more_than_its_scatter_is_named() -> None:
    before = run("2026-01-01", figure(1.0, 0.1), figure(10.0, unit="of a KD-tree query, times"))
    same, noisy, worse = figure(1.0), figure(1.15, 0.2), figure(1.25, 0.1)
    assert not list(history.slower(run("2026-01-02", same), before))
    assert not list(history.slower(run("2026-01-02", noisy), before))
    assert list(history.slower(run("2026-01-02", worse), before)) == ["a command: 1.25 s, 1 on 2026-01-01 (scatter 0.2)"]
    assert not list(history.slower(run("2026-01-02", figure(0.2)), before)), "what got faster is not slower"
    assert not list(history.slower(run("2026-01-02", replace(worse, name="another")), before)), "nothing is known of it"
    less = figure(5.0, unit="of a KD-tree query, times")
    assert len(list(history.slower(run("2026-01-02", less), before))) == 1, "of a ratio to rivals more is better"


def test_runs_are_compared_on_one_processor_only() -> None:
    first, other, last = run("2026-01-01"), run("2026-01-02", processor="another"), run("2026-01-03")
    assert history.previous(last, [first, other]) == first
    assert history.previous(other, [first]) is None


def test_what_got_slower_is_said_of_a_history_of_two_lines(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    kept = [run("2026-01-01", figure(1.0, 0.1), figure(9.0, name="another"))]
    monkeypatch.setattr(history, "runs", lambda: kept)
    assert bench.say_what_got_slower() == 0
    kept.append(run("2026-01-02", figure(1.5, 0.1), figure(9.0, name="another")))
    capsys.readouterr()
    assert bench.say_what_got_slower() == 1
    assert capsys.readouterr().out == "a command: 1.5 s, 1 on 2026-01-01 (scatter 0.2)\n"


def test_the_page_gets_the_table_between_its_marks_and_keeps_the_rest(tmp_path: Path) -> None:
    page = tmp_path / "performance.md"
    page.write_text(f"# Before\n{history.BEGIN}\nold\n{history.END}\nafter\n")
    history.write_page(run("2026-01-01", figure(1.0, 0.1), figure(3.0)), page)
    once = page.read_text()
    assert once.startswith("# Before\n")
    assert once.endswith("\nafter\n")
    assert "old" not in once
    assert "| a command | 1 s | 0.95 to 1.05 | 2 (reached) |" in once
    assert "| a command | 3 s | 3 to 3 | 2 |" in once
    history.write_page(run("2026-01-01", figure(1.0, 0.1), figure(3.0)), page)
    assert page.read_text() == once


def test_the_history_of_this_repository_can_be_read() -> None:
    for one in history.runs():
        assert one.figures
        assert all(found.low <= found.median <= found.high for found in one.figures)
