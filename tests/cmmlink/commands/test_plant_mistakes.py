"""What a plant's commands say to somebody who named what is not there, or is something else: what, where, and what to do."""

from pathlib import Path

import pytest

from tests.cmmlink.command import cmmlink

NOBODY = "postgresql://cmm@127.0.0.1:1/plant"
CHANGE = ("--set", "tolerance.upper_mm=0.1")
GONE = "none: there is no such folder; --records DIR says in which one the records are"
FILE = "text: is no folder; --records DIR says in which one the records are"
BEGIN = "No such file or directory; `cmmlink study new none.json` begins a study"

MISTAKES: list[tuple[tuple[str, ...], int, str]] = [
    (("plant", "push", "--records", "none"), 2, GONE),
    (("plant", "push", "--stay", "--records", "none"), 2, GONE),
    (("plant", "status", "--records", "none"), 2, GONE),
    (("plant", "verify", "--records", "none"), 2, GONE),
    (("plant", "trends", "blade", "--records", "none"), 2, GONE),
    (
        ("plant", "trends", "blade", "--records", "empty"),
        2,
        "empty/plant.sqlite: nothing was pushed there yet: `cmmlink plant push` ",
    ),
    (("plant", "push", "--records", "text"), 2, FILE),
    (("plant", "verify", "--records", "text"), 2, FILE),
    (("plant", "trends", "blade", "--records", "text"), 2, FILE),
    (("plant", "verify", "--records", "empty"), 2, "empty: there are no records here; --records DIR says where they are"),
    (("plant", "trends", "blade", "--records", "lost"), 2, "none/plant.sqlite: there is no folder "),
    (("plant", "trends", "blade", "--records", "other"), 2, "text: file is not a database; it is some other file, or damaged; "),
    (("plant", "trends", "blade", "--records", "away"), 4, "Connection refused; the server has to run and to be reached from"),
    (("plant", "status", "--records", "broken"), 2, "broken/plant.yaml: line 1: adres is not a known key; did you mean address?"),
    (("plant", "address", "none/x.sqlite"), 2, "none/x.sqlite: there is no folder "),
    (("plant", "address", "empty"), 2, "empty: is a folder; expected a file of results, like "),
    (("plant", "address", "text"), 2, "text: file is not a database; it is some other file, or damaged; `cmmlink plant address ADDRESS`"),
    (("plant", "address", "http://x/y"), 2, "http://x/y: expected the path of a file, or postgresql://USER@HOST/DATABASE"),
    (("plant", "address", NOBODY), 4, "; the server has to run and to be reached from this computer; `cmmlink plant address ADDRESS`"),
    (("study", "report", "none.json"), 2, f"none.json: {BEGIN}"),
    (("study", "add", "none.json", "last"), 2, f"none.json: {BEGIN}"),
    (("study", "report", "text"), 2, "text: no study: Expecting value: line 1 column 1 (char 0); `cmmlink study new text` makes one"),
    (("study", "new", "none/s.json", "--kind", "crossed"), 2, "none/s.json: cannot be written: No such file or directory"),
    (("rejudge", "none", *CHANGE), 2, "none: there are no records here; expected a backup of records, or a folder of them"),
    (("rejudge", "text", *CHANGE), 2, "text: file is not a database: the file is damaged; expected a backup of records"),
]


@pytest.mark.parametrize(("words", "code", "told"), MISTAKES, ids=[" ".join(words) for words, *_ in MISTAKES])
def test_a_mistake_is_told_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], code: int, told: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path("text").write_text("this is text, and neither records nor results", encoding="utf-8")
    settings = {"lost": "address: ../none/plant.sqlite", "other": "address: ../text", "away": f"address: {NOBODY}", "broken": "adres: x"}
    Path("empty").mkdir()
    for name, address in settings.items():
        Path(name).mkdir()
        Path(name, "plant.yaml").write_text(address, encoding="utf-8")
    assert told in cmmlink(*words).failed(code).replace("\\", "/")
    assert not Path("none").exists(), "looking for something makes nothing"
