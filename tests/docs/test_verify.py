"""The verifier of docs/verify: it derives sound runs anew, and finds every alteration, with the chain computed anew or not."""

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from docs.verify import best_fit, verify
from tests.cmmlink.command import cmmlink
from tests.docs.evidence import ALTERATIONS as OF_ANY_RUN
from tests.docs.evidence import Evidence

POINTS = 150


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example of the program: a blade with its points, and those of a bad one."""
    folder = tmp_path_factory.mktemp("blade") / "example"
    assert cmmlink("example", folder).code == 0
    return folder


def run_and_export(example: Path, points: str, tolerance_mm: float, fit: str = "best-fit") -> Evidence:
    lines = (example / points).read_text().splitlines()
    (example / "few.csv").write_text("\n".join(lines[:1] + lines[1::10]) + "\n")
    (example / "few.yaml").write_text(
        f"part: {{name: blade}}\nnominal: {{file: blade.dat, scale: 100}}\nrecords: kept\nprobe: {{tip_radius_mm: 1}}\n"
        f"device: {{type: file, file: few.csv}}\ntolerance: {{lower_mm: -{tolerance_mm}, upper_mm: {tolerance_mm}}}\nout: null\n"
        f"registration: {{fit: {fit}}}\n"
    )
    assert cmmlink("run", example / "few.yaml", "--headless").code in (0, 1, 3)
    evidence = example.parent / f"evidence of {points} by {fit}"
    assert cmmlink("export", "last", "--records", example / "kept", "--out", evidence).code == 0
    return Evidence(evidence)


@pytest.fixture(scope="module")
def sound(example: Path) -> Evidence:
    return run_and_export(example, "points.csv", 0.05)


@pytest.fixture(scope="module")
def certified(example: Path) -> Evidence:
    """A run with the certificate of its minimum zone."""
    return run_and_export(example, "points.csv", 0.05, "minimum-zone")


@pytest.fixture(scope="module")
def bad(example: Path) -> Evidence:
    return run_and_export(example, "points-bad.csv", 0.03)


@pytest.fixture
def altered(sound: Evidence, tmp_path: Path) -> Evidence:
    return sound.copy(tmp_path / "evidence")


def test_a_sound_run_is_proved_with_python_and_numpy_alone(sound: Evidence) -> None:
    command = [sys.executable, "-I", verify.__file__, str(sound.folder), "--head", sound.head]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Proved: profile: CONFORM follows." in done.stdout
    assert [line for line in done.stdout.splitlines() if line.startswith("Not checked")] == [
        "Not checked: That key is the station's. (give it with --key)"
    ]
    lines = Path(verify.__file__).read_text().splitlines()
    assert len(lines) <= 400
    assert {line.split()[1] for line in lines if line.startswith(("import ", "from "))} == {
        "csv", "hashlib", "json", "math", "re", "sys", "pathlib", "typing", "numpy",
    }  # fmt: skip


def test_the_signature_is_held_against_a_key_that_was_given_beforehand(sound: Evidence, altered: Evidence) -> None:
    told = json.loads((sound.folder / "signature.json").read_text())
    for key in (told["public_key"], told["key_id"].upper()):
        assert "NOT TRUE" not in verify.Check(sound.folder, key=key).findings
    assert verify.Check(sound.folder, key="ab" * 32).findings["NOT TRUE"] == ["That key is the station's."]
    (altered.folder / "signature.json").write_text(json.dumps(told | {"signature": "00" + told["signature"][2:]}))
    assert "NOT TRUE" in verify.Check(altered.folder).findings
    findings = verify.Check(altered.folder, key=told["key_id"]).findings
    assert not any(sentence.startswith(("The run is signed", "That key")) for sentence in findings["Proved"])
    (altered.folder / "signature.json").unlink()
    assert "NOT TRUE" not in verify.Check(altered.folder).findings
    assert "NOT TRUE" in verify.Check(altered.folder, key=told["key_id"]).findings


RFC_8032 = [  # section 7.1: public key, message, signature
    (
        "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a",
        "",
        "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5f0595bbe24655141438e7a100b",
    ),
    (
        "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c",
        "72",
        "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302aeeb00d291612bb0c00",
    ),
    (
        "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025",
        "af82",
        "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716ed28dc027beceea1ec40a",
    ),
]


@pytest.mark.parametrize(("key", "message", "signature"), RFC_8032)
def test_signatures_of_the_standard_hold_and_altered_ones_do_not(key: str, message: str, signature: str) -> None:
    public, signed, told = (bytes.fromhex(text) for text in (key, message, signature))
    assert verify.is_signed(public, signed, told)
    assert not verify.is_signed(public, signed + b"x", told)
    assert not verify.is_signed(public, signed, told[:32] + (int.from_bytes(told[32:], "little") + verify.GROUP).to_bytes(32, "little"))
    for place in (0, 31, 32, 63):
        assert not verify.is_signed(public, signed, told[:place] + bytes([told[place] ^ 1]) + told[place + 1 :])
    assert not verify.is_signed(told[:32], signed, told)
    assert not verify.is_signed(public, signed, told[:63])


def test_a_part_that_fails_is_refuted_in_every_placement(bad: Evidence) -> None:
    assert json.loads(bad.body("result"))["verdict"] == "nonconform"
    assert "profile: NONCONFORM follows, for no placement passes." in verify.Check(bad.folder, bad.head).findings["Proved"]


def test_a_part_that_passes_is_not_refuted(altered: Evidence) -> None:
    result = json.loads(altered.body("result"))
    result["characteristics"] = [one | {"verdict": "nonconform"} for one in result["characteristics"]]
    altered.set_result(**result | {"verdict": "nonconform"})
    assert any("NONCONFORM follows" in sentence for sentence in verify.Check(altered.folder).findings["NOT TRUE"])


def with_file(name: str, change: Callable[[bytes], bytes]) -> Callable[[Evidence], None]:
    def alter(evidence: Evidence) -> None:
        path = next(evidence.folder.glob(name))
        before = path.read_bytes()
        path.write_bytes(change(before))
        assert path.read_bytes() != before

    return alter


def with_nominal(change: Callable[[dict[str, Any]], object]) -> Callable[[Evidence], None]:
    def alter(evidence: Evidence) -> None:
        nominal = json.loads((evidence.folder / "nominal.json").read_text())
        change(nominal)
        (evidence.folder / "nominal.json").write_text(json.dumps(nominal))

    return alter


def with_result(**values: Any) -> Callable[[Evidence], None]:
    return lambda evidence: evidence.set_result(**values)


def turn(evidence: Evidence) -> None:
    pose = json.loads(evidence.body("result"))["registration"]
    evidence.set_result(registration=pose | {"rotation_deg": pose["rotation_deg"] + 1e-6})


def leave_out_a_point(evidence: Evidence) -> None:
    rows = np.frombuffer(evidence.body("points"), "<f8").copy()
    n = len(rows) // 5
    kept = np.arange(n) != 7
    parts = [rows[:n][kept], rows[n : 2 * n][kept], rows[2 * n :].reshape(n, 3)[kept].ravel()]
    evidence.replace("points", np.concatenate(parts).tobytes())


def reject_a_point(evidence: Evidence) -> None:
    body = bytearray(evidence.body("deviations"))
    body[-1] = 1
    evidence.replace("deviations", bytes(body))


def cut_off(evidence: Evidence) -> None:
    end = next(place for place, row in enumerate(evidence.rows) if row["kind"] == "end")
    del evidence.rows[end:], evidence.bodies[end:]
    evidence.write()


def leave_out_a_record(evidence: Evidence) -> None:
    at = next(k for k, row in enumerate(evidence.rows) if row["kind"] == "events")
    del evidence.rows[at], evidence.bodies[at]
    evidence.write()


def with_row(**values: str) -> Callable[[Evidence], None]:
    def alter(evidence: Evidence) -> None:
        evidence.rows[3] |= values
        evidence.write()

    return alter


def widen_everything(evidence: Evidence) -> None:
    """Alter the zone in the plan, and all that follows from it in the result."""
    result = json.loads(evidence.body("result"))
    evidence.set_plan("upper_mm: 0.05", "upper_mm: 0.08")
    off = max(result["max_deviation_mm"], result["min_deviation_mm"], key=lambda d: abs(d - 0.015))
    value = 2 * abs(off - 0.015)
    first = result["characteristics"][0]
    first |= {"upper": 0.08, "value": value, "deviation": off, "consumption": value / 0.13, "worst": first["worst"] | {"deviation_mm": off}}
    errors = {"zone_error_mm": value, "best_fit_error_mm": value}
    evidence.set_result(tolerance=result["tolerance"] | {"upper_mm": 0.08}, characteristics=[first], **errors)


ALTERATIONS: dict[str, Callable[[Evidence], None]] = {
    "a byte of the records": with_file("records.bin", lambda data: data[:-9] + bytes([data[-9] ^ 1]) + data[-8:]),
    "bytes behind the records": with_file("records.bin", lambda data: data + b"x"),
    "a hash": with_row(sha256="11" * 32),
    "the hash before it": with_row(previous_sha256="11" * 32),
    "the time of a record": with_row(time_s="1.0"),
    "the kind of a record": with_row(kind="events"),
    "the count of a record": with_row(count="17"),
    "a run that is cut off": cut_off,
    "a record left out": leave_out_a_record,
    "the plan's file": with_file("plan.yaml", lambda data: data.replace(b"0.05", b"0.08")),
    "the nominal's file": with_file("nominal-*", lambda data: data.replace(b"1.000465277", b"1.000465278")),
    "the result's file": with_file("result.json", lambda data: data.replace(b'"lost": 0', b'"lost": 1')),
    "a control point by a micrometre": with_nominal(lambda nominal: nominal["control_points_mm"][9].__setitem__(0, 90.0)),
    "a knot": with_nominal(lambda nominal: nominal["knots"].__setitem__(99, nominal["knots"][99] + 1e-4)),
    "a weight": with_nominal(lambda nominal: nominal["weights"].__setitem__(170, 1.1)),
    "the side of the material": with_nominal(lambda nominal: nominal.__setitem__("material", "right")),
    "a point by a micrometre, chain anew": lambda evidence: evidence.move("points", 3 * POINTS, 1e-3),
    "a deviation by a micrometre, chain anew": lambda evidence: evidence.move("deviations", 5 * POINTS + 9, 1e-3),
    "a station, chain anew": lambda evidence: evidence.move("deviations", 4 * POINTS + 9, 1e-3),
    "a place, chain anew": lambda evidence: evidence.move("deviations", 9, 1e-3),
    "a point left out, chain anew": leave_out_a_point,
    "a point rejected, chain anew": reject_a_point,
    "the verdict, chain anew": with_result(verdict="uncertain"),
    "the verdict of all, chain anew": lambda evidence: evidence.set_result(
        verdict="uncertain",
        characteristics=[one | {"verdict": "uncertain"} for one in json.loads(evidence.body("result"))["characteristics"]],
    ),
    "the largest deviation, chain anew": with_result(max_deviation_mm=0.001),
    "the smallest deviation, chain anew": with_result(min_deviation_mm=-0.001),
    "the points out, chain anew": with_result(out_of_tolerance=2),
    "the coverage, chain anew": with_result(coverage=0.97),
    "the longest gap, chain anew": with_result(largest_gap_mm=0.5),
    "the count, chain anew": with_result(received=POINTS + 1),
    "lost points, chain anew": with_result(lost=3),
    "a scan without its end, chain anew": with_result(complete=False),
    "the angle, chain anew": turn,
    "the plan's limits, chain anew": lambda evidence: evidence.set_plan("upper_mm: 0.05", "upper_mm: 0.08"),
    "the limits that were applied, chain anew": with_result(
        tolerance={"lower_mm": -0.05, "upper_mm": 0.08, "uncertainty_mm": 0.0, "decision_rule": ""}
    ),
    "the tip, chain anew": lambda evidence: evidence.set_plan("tip_radius_mm: 1.0", "tip_radius_mm: 1.001"),
    "the section, chain anew": lambda evidence: evidence.set_plan("  x_axis:\n  - 1.0\n  - 0.0", "  x_axis:\n  - 1.0\n  - 0.001"),
}


@pytest.mark.parametrize("name", ALTERATIONS)
def test_an_alteration_is_found(altered: Evidence, name: str) -> None:
    head = altered.head
    ALTERATIONS[name](altered)
    findings = verify.Check(altered.folder, "" if "anew" in name else head).findings
    assert "NOT TRUE" in findings, findings


STANDS_TWICE = [name for name in OF_ANY_RUN if name.split()[1] in {"zone", "bound", "gap", "last", "value", "minimum"}]


@pytest.mark.parametrize("name", STANDS_TWICE)
def test_a_number_that_stands_twice_is_altered_in_neither_place(
    certified: Evidence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """The search of every placement, which would refute some of them, leaves it undecided here."""
    monkeypatch.setattr(verify.Curve, "search", lambda *_: None)
    altered = certified.copy(tmp_path / "evidence")
    assert "NOT TRUE" not in verify.Check(altered.folder).findings
    assert OF_ANY_RUN[name](altered)
    assert any("itself." in told or "agree with each other" in told for told in verify.Check(altered.folder).findings["NOT TRUE"])


def test_what_was_written_anew_as_a_whole_is_found_by_the_hash_that_was_kept_elsewhere(altered: Evidence) -> None:
    head = altered.head
    widen_everything(altered)
    assert "NOT TRUE" not in verify.Check(altered.folder).findings
    assert [sentence for sentence in verify.Check(altered.folder, head).findings["NOT TRUE"] if "kept elsewhere" in sentence]


@pytest.mark.parametrize("name", ["records.bin", "chain.csv", "nominal.json", "plan.yaml", "result.json", "run.json"])
def test_evidence_that_cannot_be_read_is_said_to_be_so(altered: Evidence, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    (altered.folder / name).unlink()
    assert verify.main([str(altered.folder)]) == 2
    assert capsys.readouterr().out.startswith("The evidence cannot be read: ")


WALK = (Path(verify.__file__).parent / "walk.md").read_text(encoding="utf-8")


def test_the_walk_of_an_auditor_is_as_its_page_tells_it(tmp_path: Path) -> None:
    """Every command of the page but those that install numpy; the sentences are held against the page, numbers left out."""
    commands = [line.removeprefix("$ ") for line in WALK.splitlines() if line.startswith("$ ")]
    for command in (line for line in commands if line.startswith("cmmlink ") and "key show" not in line):
        _, verb, *words = shlex.split(command)
        assert cmmlink(verb, *(tmp_path / word if word[0] in "ek" and word != "export" else word for word in words)).code == 0
    evidence = Evidence(tmp_path / "evidence")
    told = json.loads((evidence.folder / "signature.json").read_text())
    shown = dict(re.findall(r"^\$ (plain/bin/python verify.py \S+) .*\n((?:[A-Z].*: .*\n)+)", WALK, re.MULTILINE))
    evidence.copy(tmp_path / "altered")
    plan = tmp_path / "altered" / "plan.yaml"
    plan.write_bytes(plan.read_bytes().replace(b"upper_mm: 0.05", b"upper_mm: 0.08"))
    for folder, code in (("evidence", 0), ("altered", 1)):
        words = [verify.__file__, folder, "--head", evidence.head, "--key", told["key_id"]]
        done = subprocess.run([sys.executable, "-I", *words], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == code, done.stdout + done.stderr
        printed = [line for line in done.stdout.splitlines() if code == 0 or line.startswith("NOT TRUE")]
        numbers = re.compile(r"[0-9a-f]{16}|[-+.0-9]+(?:e[-+]?[0-9]+)?|20[0-9-]+")
        assert [numbers.sub("#", line) for line in printed] == [
            numbers.sub("#", line) for line in shown[f"plain/bin/python verify.py {folder}"].splitlines()
        ]


@pytest.mark.parametrize(("turned_deg", "moved_mm", "holds"), [(0.0, 0.0, True), (1e-5, 0.0, False), (0.0, 1e-5, False)])
def test_a_best_fit_is_told_from_a_placement_beside_it(
    sound: Evidence, turned_deg: float, moved_mm: float, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(best_fit, "STARTS", 3 if holds else 1)
    check = best_fit.verify.Check(sound.folder)
    one = check.result["characteristics"][0]
    assert one["fit"] == "best-fit"
    x, y = one["pose"]["translation_mm"]
    pose = {"rotation_deg": one["pose"]["rotation_deg"] + turned_deg, "translation_mm": [x, y + moved_mm]}
    best_fit.check_fit(check, one | {"pose": pose}, check.zone_of(-1))
    assert ("NOT TRUE" not in check.findings) is holds
    told = [sentence for heap in check.findings.values() for sentence in heap if "step is left" in sentence or "fits better" in sentence]
    assert len(told) == 2
