"""What a command does not need it does not load: help and mistakes are told at once, and records are read without the inspection."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from cmmlink.demo.example import write_example
from cmmlink.other_processes import processes_here
from cmmlink.record.store import FILE_NAME
from tests.cmmlink.commands.oval_files import TOLERANCE
from tests.cmmlink.oval_part import oval_points, write_points
from tests.cmmlink.recorded import Script, record, scan_arrivals

ROOT = Path(__file__).resolve().parents[3]
DEVICES, PAGE, PICTURES = {"pymodbus", "serial"}, {"starlette", "uvicorn", "websockets", "ssl", "asyncio"}, {"matplotlib", "reportlab"}
CAD, BOOKS, SURFACES = {"ezdxf", "OCP"}, {"xlsxwriter"}, {"drivers.surface"}
MATHS, PLANS, SPEECH = {"numpy", "scipy", "numba", "llvmlite"}, {"yaml", "cmmlink.plan.scan"}, {"rich"}
SCIPY = {f"scipy.{part}" for part in ("interpolate", "linalg", "optimize", "sparse", "spatial", "special")}  # a third of a second together
SIGNATURES = {"cryptography"}  # where something is signed, or a signature verified
RESULTS = {"sqlalchemy", "alembic", "psycopg"}
HEAVY = (
    SIGNATURES | RESULTS | SCIPY | DEVICES | PAGE | PICTURES | MATHS | PLANS | SPEECH | CAD | BOOKS | SURFACES | {"simulators", "sqlite3"}
)

IN_ONE_PROCESS = """
import contextlib, io, json, sys
from cmmlink.commands import main

commands, watched = json.loads(sys.argv[1])
for words in commands:
    sys.argv = ["cmmlink", *words]
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
            main()
    except SystemExit as ended:
        print(json.dumps([ended.code or 0, said.getvalue(), sorted(set(watched) & set(sys.modules))]))
"""


def loaded_by(*commands: tuple[object, ...]) -> list[tuple[int, str, set[str]]]:
    """Exit status, what was said on standard error, and the heavy modules loaded after each of these commands, run one after another."""
    words = json.dumps([[[str(word) for word in command] for command in commands], sorted(HEAVY)])
    told = subprocess.run([sys.executable, "-c", IN_ONE_PROCESS, words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    return [(code, said, set(loaded)) for code, said, loaded in map(json.loads, told.splitlines())]


def test_help_version_and_mistakes_load_nothing_heavy() -> None:
    working = ("demo", "run", "inspect", "ct", "nominal", "check", "console", "prepare", "doctor", "ports", "registers")
    commands = (
        *working,
        "runs",
        "show",
        "export",
        "report",
        "compare",
        "replay",
        "rejudge",
        "verify",
        "backup",
        "restore",
        "merge",
        "key",
        "plant",
    )
    helped = (("--version",), ("--help",), *((command, "--help") for command in commands))
    mistaken = (("inspcet",), ("inspect", "points.csv"), ("inspect", "points.csv", "--nominal", "n.dat", "--tolerance", "wide", 1))
    told = loaded_by(*helped, *mistaken)
    assert [(code, loaded) for code, _, loaded in told] == [(0, set())] * len(helped) + [(2, set())] * len(mistaken)
    assert all(said.startswith("cmmlink: ") for _, said, _ in told[len(helped) :])


def test_records_are_listed_shown_and_verified_without_inspection_plans_devices_or_page(tmp_path: Path) -> None:
    record(tmp_path, Script(*scan_arrivals()))
    assert (tmp_path / FILE_NAME).exists()
    read = loaded_by(*((*words, "--records", tmp_path) for words in (("verify",), ("runs",), ("show", "last"))))
    assert [(code, loaded) for code, _, loaded in read] == [(0, {"numpy", "sqlite3"})] * 3


def test_points_are_inspected_without_devices_page_and_pictures_and_pictures_drawn_without_the_page(nominal: Path, tmp_path: Path) -> None:
    points = write_points(tmp_path / "points.csv", oval_points(0.01))
    noisy = write_points(tmp_path / "noisy.csv", oval_points(np.random.default_rng(1).normal(0.0, 0.003, 360)))
    least_of = ("inspect", noisy, "--nominal", nominal, *TOLERANCE, "--no-record", "--json")
    inspect = ("inspect", points, "--nominal", nominal, *TOLERANCE, "--records", tmp_path)
    (_, _, least), (judged, _, plain), (_, _, drawn) = loaded_by(least_of, (*inspect, "--json"), (*inspect, "--out", tmp_path / "out"))
    assert least & (SCIPY | SIGNATURES) == set()
    assert judged == 0
    assert plain & (DEVICES | PAGE | PICTURES | SPEECH | CAD | {"simulators"}) == set()
    assert ("matplotlib" in drawn) == (processes_here() == 0)  # else another process draws
    assert drawn & (DEVICES | PAGE | CAD | BOOKS | {"simulators"}) == set()


def test_a_workbook_alone_loads_what_writes_workbooks(tmp_path: Path) -> None:
    record(tmp_path, Script(*scan_arrivals()))
    export = ("export", "last", "--records", tmp_path, "--out", tmp_path / "out", "--format")
    others, (code, _, book) = loaded_by(*((*export, name) for name in ("qif", "xlsx")))
    assert (others[0], code) == (0, 0)
    watched = BOOKS | PICTURES | PAGE | DEVICES | CAD | {"simulators"}
    assert (others[2] & watched, book & watched) == (set(), BOOKS)


def test_a_plan_of_a_file_or_a_serial_device_is_checked_without_surfaces_page_and_scipy(nominal: Path, tmp_path: Path) -> None:
    write_example(tmp_path)
    for plan in ("file-plan.yaml", "plan.yaml"):
        text = (tmp_path / plan).read_text(encoding="utf-8")
        assert "file: blade.dat" in text  # whose points scipy joins to a curve; an exact curve needs nothing of it
        (tmp_path / plan).write_text(text.replace("file: blade.dat", f"file: {nominal.name}"), encoding="utf-8")
    checked = loaded_by(*(("check", tmp_path / plan) for plan in ("file-plan.yaml", "plan.yaml")))
    assert [(code, said) for code, said, _ in checked] == [(0, "")] * 2
    unneeded = SCIPY | SURFACES | {"pymodbus"} | PAGE | PICTURES | CAD | BOOKS | {"simulators"}
    assert [loaded & unneeded for _, _, loaded in checked] == [set()] * 2
