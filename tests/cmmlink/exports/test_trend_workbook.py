"""The workbook of a trend: its sheets hold what the trend holds."""

from pathlib import Path

import numpy as np
import pytest

from cmmlink.exports import write_trend_workbook
from tests.cmmlink.exports.tables_of import sheets_of
from tests.cmmlink.plant.trending import drifting_trend


def test_the_workbook_holds_the_trend_and_is_the_same_each_time(tmp_path: Path) -> None:
    found = drifting_trend(20)
    for name in ("a", "b"):
        write_trend_workbook(found, tmp_path / f"{name}.xlsx")
    assert (tmp_path / "a.xlsx").read_bytes() == (tmp_path / "b.xlsx").read_bytes()
    sheets = sheets_of(tmp_path / "a.xlsx")
    assert list(sheets) == ["trend", "figures", "profiles", "drift", "columns"]
    values = sheets["trend"]
    assert [row["value"] for row in values] == pytest.approx(found.series.value.tolist(), rel=1e-15)
    assert [row["run"] for row in values] == list(found.series.run)
    assert "eight values in a row" in " ".join(row.get("rules", "") for row in values)
    places = [name for name in sheets["profiles"][0] if name != "run"]
    assert len(places) == 120
    assert found.strip is not None
    assert np.float32(sheets["profiles"][3][places[7]]) == found.strip.strips.worst_mm[3, 7]
    assert places[-1] not in sheets["profiles"][5]  # was not measured
    assert [row["slope_mm"] for row in sheets["drift"]] == pytest.approx(found.strip.drift.slope.tolist(), rel=1e-14)
    figures = {row["figure"]: row for row in sheets["figures"]}
    assert "value" not in figures["Cpk"]
    assert figures["Cpk"]["words"]
    assert figures["location: centre"]["value"] == pytest.approx(found.series.value.mean())


def test_of_subgroups_the_last_row_of_each_holds_what_is_plotted(tmp_path: Path) -> None:
    found = drifting_trend(10, subgroup=4)
    write_trend_workbook(found, tmp_path / "a.xlsx")
    rows = sheets_of(tmp_path / "a.xlsx")["trend"]
    plotted = [place for place, row in enumerate(rows) if "plotted" in row]
    assert plotted == [5, 9]
    assert rows[9]["plotted"] == pytest.approx(found.series.value[6:].mean())
