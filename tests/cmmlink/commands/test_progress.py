"""What shows that a command is at work: a bar that comes up by itself, where somebody looks, and leaves nothing behind."""

import io
import sys

import pytest

from cmmlink.commands.progress import _Bar, progress


class Terminal(io.StringIO):
    """Somebody looks at it."""

    def isatty(self) -> bool:
        return True


def shown_on(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Put a terminal in place of standard error; in the test itself, since pytest puts its own there before each."""
    monkeypatch.setattr(sys, "stderr", shown := Terminal())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    return shown


def test_a_bar_says_what_is_done_and_how_much(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = shown_on(monkeypatch)
    bar = _Bar("inspecting [b]scan[/b].csv", patience_s=3600)
    bar.tell(0.25)
    bar._show()
    bar.tell(0.5)
    bar.end()
    assert "inspecting [b]scan[/b].csv" in terminal.getvalue()


def test_a_command_that_is_done_sooner_shows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = shown_on(monkeypatch)
    with progress("inspecting", patience_s=3600) as tell:
        tell(0.5)
    bar = _Bar("inspecting", patience_s=3600)
    bar.end()
    bar._show()  # the moment came while the command was ending
    assert terminal.getvalue() == ""


def test_nothing_shows_where_nobody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", shown := io.StringIO())
    with progress("inspecting", patience_s=0.0) as tell:
        tell(0.5)
    assert shown.getvalue() == ""
