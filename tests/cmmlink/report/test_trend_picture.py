"""The drawing of a trend: its words, also in German, and what it does without much to draw."""

from pathlib import Path

from pypdf import PdfReader

from cmmlink.part_trend import look_at_trend
from cmmlink.report import Speech, write_trend_picture
from tests.cmmlink.plant.trending import Remembered, drifting_runs, drifting_trend


def test_a_page_holds_figures_and_drift_also_in_german_and_draws_the_newest(tmp_path: Path) -> None:
    chord = look_at_trend(Remembered(drifting_runs(520, drift_mm=0.0)), "blade", "chord", last=520)
    write_trend_picture(chord, tmp_path / "a.pdf", Speech("de"))
    told = PdfReader(tmp_path / "a.pdf").pages[0].extract_text()
    assert chord.trend.capability is not None
    ppk = chord.trend.capability.ppk
    assert f"Ppk {ppk.value:.2f} ({ppk.lower:.2f} .. {ppk.upper:.2f})".replace(".", ",").replace(",,", "..") in told
    assert "Keine Stelle des Profils driftet signifikant über die letzten 60 Läufe." in told
    assert "gezeichnet sind die neuesten 500 von 520" in told


def test_every_sentence_beside_a_trend_has_german_words() -> None:
    say = Speech("de")
    gaps = drifting_runs(60)
    trends = [drifting_trend(count, subgroup=size) for count in (3, 12, 45) for size in (1, 4)]
    trends.append(look_at_trend(Remembered(gaps), "blade", "chord"))
    for found in trends:
        for told in (*found.drifts, *found.notes):
            assert say.sentence(told) != told, told


def test_the_same_trend_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.svg", "b.svg"):
        write_trend_picture(drifting_trend(12, subgroup=4), tmp_path / name, Speech())
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_a_single_value_is_no_chart_and_is_drawn_as_words(tmp_path: Path) -> None:
    found = look_at_trend(Remembered(drifting_runs(1)), "blade", "contour")
    assert found.trend.charts is None
    write_trend_picture(found, tmp_path / "one.png", Speech())
    assert (tmp_path / "one.png").read_bytes().startswith(b"\x89PNG")
