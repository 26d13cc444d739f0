"""What is handed in to do harm, or by mistake: one message, and neither time nor memory out of proportion."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import TOLERANCE
from tests.cmmlink.oval_part import oval_points

MOST_S = 3.0  # of processor time; what is meant takes a few hundredths
LONGEST_MESSAGE = 600
ROWS = "".join(f"{x:.6f},{y:.6f}\n" for x, y in oval_points(0.0))
DIGITS = "9" * 5000
LAUGHS = "a: &a [1, 1]\n" + "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True))
PLAN = "part: {name: a}\nnominal: {file: nominal.csv}\ntolerance: {lower_mm: -1, upper_mm: 1}\n"
FILE = PLAN + "device: {type: file, file: points.csv}\n"
MODBUS = PLAN + "device: {type: modbus, address: '127.0.0.1:502', map: map.yaml}\n"
SUFFIXES = [".csv", ".txt", ".dat", ".yaml", ".npy"]


def refused_soon(*arguments: object) -> str:
    """Take the one message of a command that refuses its input within the time that is allowed."""
    began_s = time.process_time()
    message = cmmlink(*arguments).refused()
    assert time.process_time() - began_s < MOST_S
    assert len(message) < LONGEST_MESSAGE
    return message


def inspect(points: Path, nominal: Path) -> str:
    return refused_soon("inspect", points, "--nominal", nominal, *TOLERANCE, "--no-record")


@pytest.fixture
def points(tmp_path: Path) -> Path:
    path = tmp_path / "points.csv"
    path.write_text(ROWS, encoding="utf-8")
    return path


@pytest.fixture
def nominal(tmp_path: Path) -> Path:
    path = tmp_path / "nominal.csv"
    path.write_text(ROWS + ROWS.splitlines()[0] + "\n", encoding="utf-8")
    return path


def pipe(path: Path) -> None:
    os.mkfifo(path)


def endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def folder(path: Path) -> None:
    path.mkdir()


def circle(path: Path) -> None:
    path.symlink_to(path.name)


NO_FILES: dict[str, tuple[Callable[[Path], None], str]] = {
    "a pipe": (pipe, "is not a regular file|a pipe or a device|no nominal file is known"),
    "a device without end": (endless, "is not a regular file|a pipe or a device|no nominal file is known"),
    "a folder": (folder, "is a folder|is not a file|no nominal file is known"),
    "a link to itself": (circle, "cannot be read|no such file|no nominal file is known"),
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names and /dev are POSIX")
@pytest.mark.parametrize("kind", NO_FILES)
def test_what_is_no_file_is_refused_and_not_waited_for(tmp_path: Path, points: Path, nominal: Path, kind: str) -> None:
    make, words = NO_FILES[kind]
    for suffix in SUFFIXES:
        strange = tmp_path / f"strange{suffix}"
        make(strange)
        for message in (inspect(strange, nominal), inspect(points, strange)):
            assert any(word in message for word in words.split("|")), message
    for suffix in (".stl", ".obj", ".ply"):
        strange = tmp_path / f"surface{suffix}"
        make(strange)
        assert refused_soon("ct", strange, "--nominal", nominal, *TOLERANCE, "--heights", 1).startswith(f"{strange}: ")
    for command in ("check", "run", "ct"):
        assert str(tmp_path / "strange.yaml") in refused_soon(command, tmp_path / "strange.yaml")


@pytest.mark.skipif(not Path("/proc/self/pagemap").exists(), reason="files that the system makes while they are read, on Linux")
@pytest.mark.parametrize("made", ["/proc/self/pagemap", "/proc/kmsg", "/proc/self/mem"])
def test_what_has_no_size_is_not_read_to_its_end(tmp_path: Path, points: Path, nominal: Path, made: str) -> None:
    for suffix in (".csv", ".dat", ".npy"):
        (tmp_path / f"made{suffix}").symlink_to(made)
        inspect(tmp_path / f"made{suffix}", nominal)
        inspect(points, tmp_path / f"made{suffix}")
    for suffix in (".stl", ".obj", ".ply"):
        (tmp_path / f"made{suffix}").symlink_to(made)
        refused_soon("ct", tmp_path / f"made{suffix}", "--nominal", nominal, *TOLERANCE, "--heights", 1)


TEXTS: dict[str, tuple[str, str]] = {
    "digits as a count": (f"{DIGITS}\n{ROWS}", "columns"),
    "digits as an exponent": (f"1e{DIGITS},1\n2,3\n", ""),
    "many columns": ("1.5," * 60_000 + "\n", ""),
    "a line of quotes": ('"' * 300_000 + "\n1,2\n", ""),
    "a line of blanks": (" " * 3_000_000 + "1,2\n3,4\n", ""),
    "a long word": ("x" * 3_000_000 + "\n", "no line of numbers"),
    "a line of signs": ("-" * 300_000 + "\n" + "#" * 300_000 + "\n", ""),
    "a line of error values": ("#" + "A" * 300_000 + " 1\n", ""),
    "bars": ("|" * 300_000 + "\n1|2\n", ""),
}


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("suffix", [".csv", ".dat"])
def test_texts_without_measure_are_refused_soon(tmp_path: Path, points: Path, nominal: Path, name: str, suffix: str) -> None:
    text, words = TEXTS[name]
    strange = tmp_path / f"strange{suffix}"
    strange.write_text(text, encoding="utf-8")
    assert words in inspect(strange, nominal)
    inspect(points, strange)


PLANS: dict[str, str] = {
    "nested too deep": FILE + "x: " + "[" * 100_000,
    "nested in words": FILE + "x: " + "{a: " * 3000 + "}" * 3000,
    "aliases": LAUGHS + FILE,
    "aliases of itself": FILE + "x: &x [*x]\n",
    "digits": FILE.replace("-1", DIGITS),
    "digits of samples": FILE + f"discretisation: {{samples: {DIGITS}}}\n",
    "a long list": FILE.replace("name: a", "name: [" + "1, " * 100_000 + "]"),
    "a long name": FILE.replace("name: a", f"nam: {'a' * 1_000_000}"),
    "a long text": "x" * 3_000_000,
}


@pytest.mark.parametrize("name", PLANS)
@pytest.mark.usefixtures("points", "nominal")
def test_plans_without_measure_are_refused_soon(tmp_path: Path, name: str) -> None:
    plan = tmp_path / "plan.yaml"
    plan.write_text(PLANS[name], encoding="utf-8")
    refused_soon("check", plan)
    refused_soon("ct", plan)


@pytest.mark.parametrize("name", ["aliases", "aliases of itself", "nested too deep"])
@pytest.mark.usefixtures("nominal")
def test_register_maps_without_measure_are_refused_soon(tmp_path: Path, name: str) -> None:
    maps = {
        "aliases": LAUGHS + "device: d\npattern: latest\npoints: {at: *i, fields: *i}\n",
        "aliases of itself": "device: d\npattern: latest\npoints: &p {at: 0, fields: {x: [*p]}}\n",
        "nested too deep": "device: d\npattern: latest\npoints: " + "{a: " * 1000 + "}" * 1000,
    }
    (tmp_path / "map.yaml").write_text(maps[name], encoding="utf-8")
    (tmp_path / "plan.yaml").write_text(MODBUS, encoding="utf-8")
    refused_soon("check", tmp_path / "plan.yaml")


@pytest.mark.skipif(os.name != "posix", reason="names of files are bytes on POSIX alone")
def test_a_name_that_is_no_text_is_refused_wherever_it_stands(tmp_path: Path, points: Path, nominal: Path) -> None:
    strange = os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.csv")
    Path(strange).write_text(ROWS, encoding="utf-8")
    words = "caf\\udce9.csv: the name holds bytes that are no text (UTF-8); rename the file or folder"
    for arguments in ((strange, "--nominal", nominal), (points, "--nominal", strange), (points, "--nominal", nominal, "--out", strange)):
        assert refused_soon("inspect", *arguments, *TOLERANCE).endswith(words)


def test_the_largest_discretisation_takes_a_time_in_proportion(nominal: Path, tmp_path: Path, points: Path) -> None:
    plan = tmp_path / "plan.yaml"
    took_s = []
    for samples in (4_000, 32_000):
        plan.write_text(FILE + f"discretisation: {{samples: {samples}}}\n", encoding="utf-8")
        began_s = time.process_time()
        assert cmmlink("check", plan).code == 0
        took_s.append(time.process_time() - began_s)
    assert took_s[1] < 16 * took_s[0]  # eight times as many samples; quadratic would be sixty-four times
