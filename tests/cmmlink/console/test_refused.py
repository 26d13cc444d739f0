"""What is said on a page names files, and no folder of the computer."""

import errno
from pathlib import Path

import pytest

from cmmlink.console.refused import Refused, answer_errors, without_folders, words_of
from cmmlink.errors import PlanError


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("/home/op/records/station.sqlite: there is no run 'x'", "station.sqlite: there is no run 'x'"),
        ("cannot read '/data/my files/a.csv' (No such file)", "cannot read 'a.csv' (No such file)"),
        ("C:\\Users\\Ada L\\plans\\a.yaml: line 3", "a.yaml: line 3"),
        ("\\\\server\\share\\plans\\a.yaml: x", "a.yaml: x"),
        (f"{Path.cwd()}/plans/x.yaml: bad", "plans/x.yaml: bad"),
        (f"written into {Path.home()}", f"written into {Path.home().name}"),
        ("of /a/b.csv and /c/d/e.dat", "of b.csv and e.dat"),
    ],
)
def test_files_are_named_without_their_folders(said: str, shown: str) -> None:
    assert without_folders(said) == shown


@pytest.mark.parametrize(
    "said", ["/dev/ttyUSB0: denied", "/dev/serial/by-id/usb-1: x", "3/4 mm/s", "http://127.0.0.1:80/x", "plans/x.yaml: bad", "a: 1/2"]
)
def test_addresses_and_numbers_stay_as_they_are(said: str) -> None:
    assert without_folders(said) == said


def test_every_answer_goes_without_folders() -> None:
    for error in (PlanError("/srv/plans/a.yaml: bad"), OSError(errno.EACCES, "Permission denied", "/srv/records/station.sqlite")):
        with pytest.raises(Refused) as refusal, answer_errors():
            raise error
        assert "/srv" not in str(refusal.value)
    assert words_of(OSError(errno.EMFILE, "Too many open files", "/srv/x")) == "the station's computer refuses it: Too many open files"
