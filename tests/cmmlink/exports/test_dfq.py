"""Q-DAS AQDEF: read back by an independent reader, with the numbers of result.json; files grow by whole runs and lose none."""

import importlib
import importlib.util
import json
import re
import sys
import threading
import types
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from cmmlink.exports.dfq import write_dfq
from cmmlink.exports.measured_part import MeasuredPart, MeasuredSection
from cmmlink.result_files import new_files
from tests.cmmlink.command import cmmlink
from tests.cmmlink.exports.conftest import Measured, measure
from tests.cmmlink.exports.test_qif import part_of


@cache
def reader() -> Any:
    """The reader of aqdefreader alone: the package's front door also loads pandas, which it does not declare."""
    spec = importlib.util.find_spec("aqdefreader")
    assert spec is not None
    package = types.ModuleType("aqdefreader")
    package.__path__ = list(spec.submodule_search_locations or ())
    sys.modules["aqdefreader"] = package
    return importlib.import_module("aqdefreader.file").DfqFile


def parts_in(path: Path) -> list[Any]:
    content = path.read_bytes()
    assert content.count(b"\n") == content.count(b"\r\n")
    lines = content.decode("utf-8-sig").splitlines()
    parts = reader()(lines).get_parts()
    assert lines[0] == f"K0100 {sum(len(part.get_characteristics()) for part in parts)}"
    return list(parts)


def values_of(part: Any) -> list[list[float]]:
    return [[float(one.value) for one in asked.get_measurements()] for asked in part.get_characteristics()]


def test_an_independent_reader_finds_part_characteristics_and_values(measured: Measured) -> None:
    result = measured.result
    (part,) = parts_in(measured.out / "result.dfq")
    assert part.get_data("K1002") == result["part"]
    began = datetime.fromisoformat(result["measured_at"]).astimezone()
    content = (measured.out / "result.dfq").read_text(encoding="utf-8-sig")
    assert set(re.findall(r"K0004/\d+ (.*)", content)) == {f"{began:%d.%m.%Y/%H:%M:%S}"}
    assert set(re.findall(r"K0014/\d+ (.*)", content)) == {result["serial_number"]}
    profile, side, varying, most, least = part.get_characteristics()
    asked = result["characteristics"]
    expected = [asked[0]["value"], asked[1]["value"], asked[2]["consumption"], result["max_deviation_mm"], result["min_deviation_mm"]]
    for characteristic, value in zip((profile, side, varying, most, least), expected, strict=True):
        (found,) = characteristic.get_measurements()
        assert float(found.value) == pytest.approx(value, abs=5.1e-10)
        assert found.attribute == 0
    limits = [[float(one.get_data(key)) for key in ("K2110", "K2111")] for one in (profile, side, varying, most, least)]
    assert limits == [pytest.approx(pair) for pair in ([0, 0.12], [0, 0.3], [0, 1], [-0.05, 0.07], [-0.05, 0.07])]
    assert [one.get_data("K2120") for one in (profile, side, varying, most, least)] == [2, 2, 2, 1, 1]
    assert [one.get_data("K2142") for one in (profile, side, varying, most)] == ["mm", "mm", None, "mm"]
    assert side.get_data("K2002") == "a side with a name that is too long for some"
    assert side.get_data("K2001") == "a side with a name~2"


def test_text_is_within_its_lengths_on_one_line_and_marked_as_utf_8_where_it_is_not_ascii(measured: Measured) -> None:
    content = (measured.out / "result.dfq").read_bytes()
    assert content.startswith(b"\xef\xbb\xbf")
    for line in content.decode("utf-8-sig").splitlines():
        key, _, text = line.partition(" ")
        assert len(text) <= {"K1001": 30, "K1002": 80, "K1082": 40, "K2001": 20, "K2002": 80, "K0009": 255, "K0014": 40}.get(key[:5], 20)
        assert text.strip() == text != ""


def export(measured: Measured, run: str, file: Path) -> Any:
    return cmmlink("export", run, "--format", "dfq", "--out", file, "--records", measured.folder / "records")


def test_a_run_of_the_same_part_adds_a_value_and_another_one_a_part_and_none_is_added_twice(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    first, file = measure(tmp_path / "a", part="blade", serial="1", out="null"), tmp_path / "all.dfq"
    second = cmmlink("run", tmp_path / "a" / "plan.yaml", "--headless", "--json").json()
    other = measure(tmp_path / "b", part="another blade", serial="2", out="null")
    for measured, run in ((first, first.result["run"]), (other, other.result["run"]), (first, second["run"])):
        assert export(measured, run, file).code == 0
    blade, another = parts_in(file)
    assert (blade.get_data("K1001"), another.get_data("K1001")) == ("blade", "another blade")
    assert [len(found) for found in values_of(blade)] == [2] * 5
    assert [len(found) for found in values_of(another)] == [1] * 5
    assert values_of(blade)[0][0] == pytest.approx(first.result["zone_error_mm"], abs=5.1e-10)
    before = file.read_bytes()
    export(first, first.result["run"], file)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


@pytest.mark.parametrize(
    "content", [b"K0100 1\r\nK1001/1 foreign\r\n", b"", b"\xff\xfe", b"K0100 0\r\nsomething\r\n", b"K0100 1\r\nK0001/1 0.1\r\n"]
)
def test_a_file_of_another_program_is_refused_and_left_as_it_is(measured: Measured, tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "theirs.dfq"
    file.write_bytes(content)
    assert "no file of runs that cmmlink wrote" in export(measured, "last", file).refused()
    assert file.read_bytes() == content


def test_many_who_add_at_once_lose_no_run(measured: Measured, tmp_path: Path) -> None:
    def add(number: int) -> None:
        identity = json.loads(json.dumps(measured.result)) | {"run": f"run-{number}"}
        part = MeasuredPart(identity, identity, part_of(measured).plan, [MeasuredSection(identity, lambda: ())])
        with new_files(tmp_path, alone=True) as files:
            write_dfq([part], files, "all")

    threads = [threading.Thread(target=add, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (part,) = parts_in(tmp_path / "all.dfq")
    assert [len(found) for found in values_of(part)] == [8] * 5
