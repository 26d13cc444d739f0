"""`check`: plans of every kind, all mistakes at once, each with a line that is right; `plan keys` and `plan schema`."""

import json
import shutil
from pathlib import Path

import pytest

from cmmlink.demo.example import write_example
from tests.cmmlink.command import cmmlink


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shop")
    write_example(folder)
    return folder


def changed(shop: Path, plan: str, *changes: tuple[str, str]) -> Path:
    """A plan of the example beside its files, with some text in it changed."""
    text = (shop / plan).read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = shop / f"changed-{plan}"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ("plan.yaml", "can be run: blade 7, zone -0.05 .. +0.05 mm, serial 127.0.0.1:4001"),
        ("modbus-plan.yaml", "can be run: blade 7"),
        ("characteristics-plan.yaml", "can be run: blade 7"),
        (
            "ct-plan.yaml",
            "blade 8, zone -0.1 .. +0.1 mm, part.stl, 1352 triangles (binary STL)\n3 sections at heights 2, 5, 8 mm",
        ),
        ("my-controller.yaml", "can be used: the registers of my controller, read by the pattern ring"),
    ],
)
def test_every_kind_of_plan_is_checked(shop: Path, plan: str, words: str) -> None:
    ended = cmmlink("check", shop / plan)
    assert (ended.code, ended.err) == (0, "")
    assert words in ended.out


def test_one_mistake_is_one_line_with_an_example(shop: Path) -> None:
    plan = changed(shop, "plan.yaml", ("upper_mm: 0.05", "upper_mm: wide"))
    message = cmmlink("check", plan).refused()
    assert message == f"{plan}: line 4: tolerance.upper_mm is 'wide'; expected a number; for example upper_mm: 0.05"


def test_all_mistakes_of_the_text_are_listed_in_their_order_with_files_that_are_not_there(shop: Path) -> None:
    plan = changed(
        shop,
        "plan.yaml",
        ("{name: blade 7", "{nam: blade 7"),
        ("blade.dat", "gone.dat"),
        ("lower_mm: -0.05", "lower_mm: -0,05"),
        ("serial,", "cereal,"),
    )
    ended = cmmlink("check", plan)
    assert (ended.code, ended.out) == (2, "")
    head, *lines = ended.err.splitlines()
    assert head == f"cmmlink: {plan}: 4 mistakes"
    told = [line for line in lines if not line.startswith("      ")]
    assert [int(line.split()[1].rstrip(":")) for line in told] == sorted(int(line.split()[1].rstrip(":")) for line in told)
    assert "part.nam is not a known key; did you mean name?" in told[0]
    assert f"nominal.file: {shop / 'gone.dat'}: no such file" in told[1]
    assert any("is it what stands behind a decimal comma?" in line for line in told)
    assert "      for example device: {type: serial, address: COM3}" in lines
    assert "      for example name: blade 7" in lines
    assert "part.name is missing" not in ended.err, "the same mistake is told once"


@pytest.mark.parametrize(
    ("plan", "changes", "told"),
    [
        ("file-plan.yaml", [("blade.dat", "gone.dat"), ("points.csv", "lost.csv")], ["nominal.file", "device"]),
        (
            "modbus-plan.yaml",
            [("my-controller.yaml}", "lost.yaml}"), ("blade.dat", "gone.dat")],
            ["nominal.file", "device"],
        ),
        ("ct-plan.yaml", [("blade.dat", "gone.dat"), ("part.stl", "lost.stl")], ["nominal.file", "mesh.file"]),
    ],
)
def test_all_that_the_files_show_is_listed(shop: Path, plan: str, changes: list[tuple[str, str]], told: list[str]) -> None:
    ended = cmmlink("check", changed(shop, plan, *changes))
    assert ended.code == 2
    assert ended.err.splitlines()[0].endswith(f"{len(told)} mistakes")
    for key in told:
        assert f": {key}" in ended.err


def test_a_ct_plan_with_nothing_to_cut_is_refused_before_it_is_cut(shop: Path) -> None:
    plan = changed(shop, "ct-plan.yaml", ("heights_mm: [2, 5, 8]", "every_mm: 50"))
    assert "sections: a section every 50 mm from 25 to 10 mm makes 0" in cmmlink("check", plan).refused()


def test_what_is_no_plan_at_all_is_said(tmp_path: Path) -> None:
    for text, words in (
        ("[1, 2]", "expected keys with values"),
        ("a: &b c", "anchors"),
        ("a\x01", "not a text file"),
        ("", "the file is empty"),
    ):
        (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
        assert words in cmmlink("check", tmp_path / "p.yaml").refused()
    assert "no such file" in cmmlink("check", tmp_path / "none.yaml").refused()


def test_keys_are_printed_and_a_schema_is_written(tmp_path: Path) -> None:
    assert "for example  lower_mm: -0.05" in cmmlink("plan", "keys", "tolerance.lower_mm").out
    assert "sections.heights_mm" in cmmlink("plan", "keys").out
    assert "no plan has a key" in cmmlink("plan", "keys", "colour").refused()
    schema = cmmlink("plan", "schema", "-o", tmp_path / "s.json")
    assert schema.code == 0
    assert json.loads((tmp_path / "s.json").read_text(encoding="utf-8")) == json.loads(cmmlink("plan", "schema").out)
    shutil.rmtree(tmp_path)
    assert "cannot be written" in cmmlink("plan", "schema", "-o", tmp_path / "s.json").refused()
