"""Maps: what is shipped, what a user writes, and what is refused how."""

import struct
from pathlib import Path

import numpy as np
import pytest
import yaml

from drivers.codecs.register_map import MAPS, Block, RegisterField, entries_of, load_map, shipped_maps

README = (Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8")
MINE = "device: my controller\n" + README.partition("\ndevice: my controller\n")[2].partition("```")[0]


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(text)
    return path


def test_every_shipped_map_loads_by_its_name() -> None:
    names = sorted(file.stem for file in MAPS.glob("*.yaml"))
    assert names == ["generic-fifo", "generic-ring", "gocator", "riftek-rf60x"]
    assert [load_map(name).pattern for name in names] == ["fifo", "ring", "queue", "latest"]


def test_a_map_of_a_user(tmp_path: Path) -> None:
    mine = load_map(written(tmp_path, MINE))
    assert (mine.table, mine.word_order, mine.points.at, mine.points.size) == ("holding", "high-first", 40, 5)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("pattern: latest", "pattern: newest", r"mine\.yaml, line 2: pattern: .*'latest', 'ring', 'queue' or 'fifo'.*'newest'"),
        ("float32}         # registers", "float}         # registers", r"line 7: points\.fields\.x\.type: .*float32.*'float'"),
        ("at: 40", "at: forty", r"line 4: points\.at: .*integer.*'forty'"),
        ("at: 40", "at: 70000", r"line 4: points\.at: .*65535"),
        ("at: 40", "at: 65535", r"line 3: points: .*end after register 65535"),
        ("    y: {at: 3", "    q: {at: 3", r"map: .*field 'q' is none of crc"),
        ("device: my controller\n", "", r"device: Field required"),
        ("device: my controller", "device: my controller\nbaud: 9600", r"line 2: baud: Extra inputs"),
        ("y: {at: 3", "y: {at: 130", r"at most 125"),
        ("pattern: latest", "pattern: ring", r"a ring needs the field written in status"),
        ("pattern: latest", "pattern: queue", r"needs a block pop"),
        ("device: my", "device: [my", r"no YAML"),
        ("at: 40", "at: true", r"line 4: points\.at: .*true or false where a number belongs; found True"),
        ("y: {at: 3, ", "y: {at: 3, invalid: yes, ", r"points\.fields\.y\.invalid: .*true or false"),
        ("y: {at: 3, ", "y: {at: 3, scale: on, ", r"points\.fields\.y\.scale: .*true or false"),
        ("y: {at: 3, ", "y: {at: 3, scale: 0, ", r"points\.fields\.y\.scale: .*a scale of 0.*; found 0"),
        ("y: {at: 3, ", "y: {at: 3, scale: -0.0, ", r"a scale of 0"),
        ("y: {at: 3, ", "y: {at: 3, scale: 1.0e-320, ", r"a scale of 0, or too close to it"),
        ("y: {at: 3, ", "y: {at: 3, scale: .inf, ", r"scale: .*finite number; found inf"),
        ("y: {at: 3, ", "y: {at: 3, scale: .nan, ", r"scale: .*finite number; found nan"),
        ("y: {at: 3, ", "y: {at: 3, offset: -.inf, ", r"offset: .*finite number; found -inf"),
        ("at: 40", "at: " + "[" * 3000, r"mine\.yaml, line 4: nested more than 20 deep"),
        ("at: 40", "at: " + "{a: " * 3000, r"mine\.yaml, line 4: nested more than 20 deep"),
        ("at: 40", "at: 2001-99-99", r"mine\.yaml: no YAML: month"),
        ("at: 40", "at: !!timestamp x", r"mine\.yaml, line 4: the tag .*timestamp is not supported"),
    ],
)
def test_mistakes_are_named_with_file_line_and_key(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    path = written(tmp_path, MINE.replace(old, new))
    with pytest.raises(ValueError, match=complaint):
        load_map(path)


def test_a_map_without_coordinates_is_refused(tmp_path: Path) -> None:
    without = "".join(line for line in MINE.splitlines(keepends=True) if " x: " not in line and " y: " not in line)
    with pytest.raises(ValueError, match="none of x, y, z is named"):
        load_map(written(tmp_path, without))


def test_an_unknown_name_lists_what_is_shipped() -> None:
    with pytest.raises(ValueError, match="give a YAML file or one of generic-fifo, generic-ring, gocator, riftek-rf60x"):
        load_map("no-such-map")


@pytest.mark.parametrize("name", ["generic-fifo", "generic-ring", "gocator", "riftek-rf60x"])
def test_what_a_map_says_reads_back_as_the_same_map(name: str) -> None:
    shipped = load_map(name)
    kept = yaml.safe_load(yaml.safe_dump(shipped.model_dump(mode="json")))
    assert load_map(kept) == shipped
    assert load_map(kept).model_dump() == shipped.model_dump()


def test_a_shipped_name_is_the_shipped_map_whatever_lies_in_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "generic-ring").mkdir()
    (tmp_path / "gocator").write_text(MINE, encoding="utf-8")
    assert load_map("generic-ring").device == "generic ring"
    assert load_map("gocator").device == "LMI Gocator"
    assert load_map(Path("gocator")).device == "my controller"
    assert shipped_maps().keys() == {"generic-fifo", "generic-ring", "gocator", "riftek-rf60x"}


def test_a_map_needs_no_suffix(tmp_path: Path) -> None:
    path = tmp_path / "mymap"
    path.write_text(MINE, encoding="utf-8")
    assert load_map(str(path)) == load_map(path) == load_map(written(tmp_path, MINE))


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16-le", "utf-16-be"])
def test_another_encoding_is_named_with_the_way_out(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_bytes(MINE.replace("my controller", "mein Gerät").encode(encoding))
    with pytest.raises(ValueError, match=r"mine\.yaml: .*save the map as UTF-8"):
        load_map(path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_mark_tells_the_encoding(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_bytes(MINE.replace("my controller", "mein Gerät").encode(encoding))
    assert load_map(path).device == "mein Gerät"


@pytest.mark.parametrize(("order", "words"), [("high-first", 1), ("low-first", -1)])
@pytest.mark.parametrize(
    ("kind", "code", "values"),
    [
        ("uint16", "H", (0, 65535)),
        ("int16", "h", (-32768, 32767)),
        ("uint32", "I", (1, 0xFFFFFFFE)),
        ("int32", "i", (-(2**31), 123456789)),
        ("uint64", "Q", (2**63 + 5, 1)),
        ("int64", "q", (-(2**62), 7)),
        ("float32", "f", (1.5, -0.25)),
        ("float64", "d", (0.1, -1e300)),
    ],
)
def test_every_type_in_both_word_orders(order: str, words: int, kind: str, code: str, values: tuple[float, float]) -> None:
    entries = []
    for value in values:
        big = struct.pack(">" + code, value)
        entries.append(b"\xaa\xbb" + b"".join([big[i : i + 2] for i in range(0, len(big), 2)][::words]))
    field = RegisterField.model_validate({"at": 1, "type": kind})
    read = entries_of(Block(at=0, fields={"x": field}), order, b"".join(entries))
    np.testing.assert_array_equal(read.values["x"], values)


def test_the_map_in_the_readme_is_short() -> None:
    assert len(MINE.splitlines()) < 30
    assert yaml.safe_load(MINE)["pattern"] == "latest"
