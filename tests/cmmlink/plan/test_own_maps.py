"""A user's register map: read as plans are, with the same messages."""

from pathlib import Path

import pytest

from cmmlink.errors import PlanError
from cmmlink.plan.own_maps import map_of
from drivers import shipped_map

PAGE = (Path(__file__).parents[3] / "docs" / "register-map.md").read_text(encoding="utf-8")
MINE = PAGE.partition("```yaml\n")[2].partition("```")[0]


def written(folder: Path, text: str, name: str = "mine.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_the_map_of_the_documentation_is_read(tmp_path: Path) -> None:
    mine = map_of(written(tmp_path, MINE))
    assert (mine.device, mine.table, mine.word_order) == ("my controller", "holding", "high-first")
    assert (mine.pattern, mine.points.at, mine.points.size) == ("latest", 40, 5)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("pattern: latest", "pattern: newest", "line 2: pattern is 'newest'; expected 'latest', 'ring', 'queue' or 'fifo'"),
        ("y: {at: 3, type: float32}", "y: {at: 3, type: float}", "line 8: points.fields.y.type is 'float'; expected 'uint16', "),
        ("at: 40", "at: forty", "line 4: points.at is 'forty'; expected a whole number"),
        ("at: 40", "at: 70000", "line 4: points.at is '70000'; expected a number less than or equal to 65535"),
        ("at: 40", "at: true", "line 4: points.at is 'true'; expected a whole number"),
        ("at: 40", "at: 65535", "line 3: points is a mapping; expected an end by register 65535"),
        ("sequence:", "sequnce:", "line 6: points.fields.sequnce is not a known key; did you mean sequence? Allowed: sequence, time, "),
        ("y: {at: 3,", "y: {at: 3, sclae: 2,", "line 8: points.fields.y.sclae is not a known key; did you mean scale?"),
        ("points:", "poinst:", "line 3: poinst is not a known key; did you mean points?"),
        ("device: my controller\n", "", "line 1: device is missing: expected the name of the device"),
        ("y: {at: 3, type: float32}", "y: {at: 3}", "line 8: points.fields.y.type is missing: expected how the number is stored"),
        ("y: {at: 3,", "y: {at: 3, scale: 0,", "line 8: points.fields.y.scale is '0'; expected a factor that is not 0"),
        ("y: {at: 3,", "y: {at: 3, scale: '1,5',", "line 8: points.fields.y.scale is '1,5'; expected a number, with a decimal point"),
        ("y: {at: 3,", "y: {at: 3, at: 4,", "line 8: points.fields.y.at is given twice"),
        ("pattern: latest", "pattern: ring", "line 1: the text is a mapping; expected the field written in status, which a ring needs"),
        ("device: my", "device: [my", "line 2: not valid YAML"),
        ("at: 40", "at: !!timestamp x", "line 4: the tag tag:yaml.org,2002:timestamp is not supported"),
    ],
)
def test_a_mistake_is_named_with_file_line_key_and_what_is_allowed(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    path = written(tmp_path, MINE.replace(old, new))
    with pytest.raises(PlanError) as caught:
        map_of(path)
    assert str(caught.value).startswith(f"{path}: {complaint}")


def test_numbers_of_every_spelling_are_the_same(tmp_path: Path) -> None:
    spelled = written(tmp_path, MINE.replace("at: 40", "at: 0x28").replace("at: 3", "at: 0b11"))
    assert map_of(spelled) == map_of(written(tmp_path, MINE, "plain.yaml"))


def test_a_shipped_name_is_the_shipped_map_whatever_lies_in_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "generic-ring").mkdir()
    written(tmp_path, MINE, "gocator")
    assert map_of("generic-ring") == shipped_map("generic-ring")
    assert map_of("gocator") == shipped_map("gocator")
    assert map_of(Path("gocator")).device == "my controller"


def test_a_file_needs_no_suffix_and_a_record_keeps_the_content(tmp_path: Path) -> None:
    path = written(tmp_path, MINE, "mymap")
    assert map_of(str(path)) == map_of(path)
    assert map_of(map_of(path).model_dump(mode="json")) == map_of(path)


def test_an_unknown_name_lists_what_is_shipped() -> None:
    with pytest.raises(PlanError, match="no-such-map: no such file; give a YAML file or one of generic-fifo, generic-ring, gocator, "):
        map_of("no-such-map")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_the_encoding_is_found_as_of_every_text(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_bytes(MINE.replace("my controller", "mein Ger\u00e4t").encode(encoding))
    assert map_of(path).device == "mein Ger\u00e4t"
