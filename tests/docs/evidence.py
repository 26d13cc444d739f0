"""An exported run whose records can be altered, and hashed anew as somebody would who knows how; and ways to alter any run."""

import csv
import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np


@dataclass
class Evidence:
    """The files of an exported run."""

    folder: Path
    rows: list[dict[str, str]] = field(default_factory=list)
    bodies: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        data, offset = (self.folder / "records.bin").read_bytes(), 0
        with (self.folder / "chain.csv").open(newline="") as file:
            self.rows = list(csv.DictReader(file))
        for row in self.rows:
            self.bodies.append(data[offset : offset + int(row["bytes"])])
            offset += int(row["bytes"])

    def copy(self, folder: Path) -> "Evidence":
        """The same evidence in another folder."""
        return Evidence(Path(shutil.copytree(self.folder, folder)))

    @property
    def head(self) -> str:
        return next(row["sha256"] for row in self.rows if row["kind"] == "end")

    def body(self, kind: str) -> bytes:
        return next(body for row, body in zip(self.rows, self.bodies, strict=True) if row["kind"] == kind)

    @property
    def result(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.body("result"))
        return found

    def replace(self, kind: str, body: bytes) -> None:
        """Exchange the first body of a kind, and compute the whole chain anew. Whoever does so has no key: the signature is taken away."""
        (self.folder / "signature.json").unlink(missing_ok=True)
        self._put(kind, body)
        self._say_elsewhere()
        run, previous = json.loads(self.body("run"))["run"], self.rows[0]["previous_sha256"]
        for row, one in zip(self.rows, self.bodies, strict=True):
            row["bytes"], row["previous_sha256"] = str(len(one)), previous
            head = f"{row['number']}\n{run}\n{row['kind']}\n{row['time_s']}\n{row['count']}\n{len(one)}\n".encode()
            previous = row["sha256"] = hashlib.sha256(bytes.fromhex(previous) + head + one).hexdigest()
        self.write()
        told = json.loads((self.folder / "run.json").read_text())
        told |= {"result": self.result, "plan": self.body("plan").decode(), "chain_sha256": self.head, "signature": None}
        told |= {key: value for key, value in (json.loads(self.body("run")) | json.loads(self.body("end"))).items() if key in told}
        (self.folder / "run.json").write_text(json.dumps(told))
        if (self.folder / "zone.json").exists():
            zone, proofs = (
                json.loads((self.folder / "zone.json").read_text()),
                {c["name"]: c["certificate"] for c in self.result["characteristics"]},
            )
            zone["zones"] = [{key: (proofs[one["name"]] | {"name": one["name"]})[key] for key in one} for one in zone["zones"]]
            (self.folder / "zone.json").write_text(json.dumps(zone))

    def _put(self, kind: str, body: bytes) -> None:
        self.bodies[next(k for k, row in enumerate(self.rows) if row["kind"] == kind)] = body

    def _say_elsewhere(self) -> None:
        """Say at the begin and at the end of the records what they now hold between."""
        run, end, result = json.loads(self.body("run")), json.loads(self.body("end")), self.result
        run |= {f"{kind}_sha256": hashlib.sha256(self.body(kind)).hexdigest() for kind in ("plan", "nominal")}
        self._put("run", json.dumps(run).encode())
        self._put("end", json.dumps(end | {key: result[key] for key in ("received", "verdict", "coverage")}).encode())

    def write(self) -> None:
        (self.folder / "records.bin").write_bytes(b"".join(self.bodies))
        with (self.folder / "chain.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, list(self.rows[0]))
            writer.writeheader()
            writer.writerows(self.rows)

    def set_result(self, **values: Any) -> None:
        """Write another result, into the records and into the file that people read."""
        result = self.result | values
        self.replace("result", json.dumps(result).encode())
        (self.folder / "result.json").write_text(json.dumps(result))

    def set_plan(self, old: str, new: str) -> None:
        text = self.body("plan").decode()
        assert old in text
        self.replace("plan", text.replace(old, new).encode())
        (self.folder / "plan.yaml").write_text(text.replace(old, new), newline="")

    def move(self, kind: str, place: int, change: float) -> None:
        """Add to one number of a body of doubles."""
        body = bytearray(self.body(kind))
        body[8 * place : 8 * place + 8] = (np.frombuffer(body, "<f8", 1, 8 * place) + change).tobytes()
        self.replace(kind, bytes(body))

    def judged_row(self) -> tuple[int, int]:
        """How many rows the first record of deviations has, and one of them that was judged."""
        body = self.body("deviations")
        n = len(body) // 50
        return n, int(np.flatnonzero(np.frombuffer(body, "i1", n, 49 * n) == 0)[n // 4])


def _move(kind: str, column: int, change: float) -> Callable[[Evidence], bool]:
    """Move a number of a judged point: of points after 2 columns of the device, of deviations after x, y, foot x, foot y."""

    def alter(evidence: Evidence) -> bool:
        n, row = evidence.judged_row()
        first = 2 * n + 3 * row if kind == "points" else column * n + row
        if kind == "points" and len(evidence.body("points")) != 40 * n:
            return False
        evidence.move(kind, first, change)
        return True

    return alter


def _better_verdict(evidence: Evidence) -> bool:
    """Say CONFORM of everything, which a run that conforms says already."""
    result = evidence.result
    if result["verdict"] == "conform":
        return False
    found = [one | {"verdict": "conform", "reasons": []} for one in result["characteristics"]]
    evidence.set_result(verdict="conform", reasons=[], characteristics=found)
    return True


def _worse_verdict(evidence: Evidence) -> bool:
    """Say NOT CONFORM of a part that conforms."""
    result = evidence.result
    if result["verdict"] != "conform":
        return False
    evidence.set_result(verdict="nonconform", characteristics=[one | {"verdict": "nonconform"} for one in result["characteristics"]])
    return True


def _turn(evidence: Evidence) -> bool:
    pose = evidence.result["registration"]
    evidence.set_result(registration=pose | {"rotation_deg": pose["rotation_deg"] + 1e-6})
    return True


def _count(key: str, more: int) -> Callable[[Evidence], bool]:
    def alter(evidence: Evidence) -> bool:
        evidence.set_result(**{key: evidence.result[key] + more})
        return True

    return alter


def _say_nothing_of_losses(evidence: Evidence) -> bool:
    """Take out of the record what the device said of points that never came."""
    at = [k for k, row in enumerate(evidence.rows) if row["kind"] == "events"]
    lost = [one for k in at for one in json.loads(evidence.bodies[k]) if one["event"] == "Lost"]
    if not lost:
        return False
    for k in at:
        evidence.bodies[k] = json.dumps([one for one in json.loads(evidence.bodies[k]) if one["event"] != "Lost"]).encode()
    evidence.set_result(lost=0)
    return True


def _cut(evidence: Evidence) -> bool:
    end = next(k for k, row in enumerate(evidence.rows) if row["kind"] == "end")  # what was added behind it goes as well
    del evidence.rows[end:], evidence.bodies[end:]
    evidence.write()
    return True


def _value(evidence: Evidence) -> bool:
    """Make the value of a line-profile smaller by ten micrometres."""
    result = evidence.result
    if result["method"] != "exact":
        return False
    first, *others = result["characteristics"]
    evidence.set_result(characteristics=[first | {"value": first["value"] - 0.01}, *others])
    return True


def _certificate(key: str, change: float) -> Callable[[Evidence], bool]:
    """Alter one number of a certificate of a minimum zone, and nothing else."""

    def alter(evidence: Evidence) -> bool:
        found = evidence.result["characteristics"]
        proof = next((one["certificate"] for one in found if (one["certificate"] or {}).get(key) is not None), None)
        if proof is None:
            return False
        proof[key] += change
        evidence.set_result(characteristics=found)
        return True

    return alter


def _any_value(key: str) -> Callable[[Evidence], bool]:
    """Alter one number of the last characteristic, whatever it is, by a micrometre."""

    def alter(evidence: Evidence) -> bool:
        found = evidence.result["characteristics"]
        if found[-1]["value"] is None or "varying" in found[-1]["name"]:
            return False
        found[-1][key] += 1e-3
        evidence.set_result(characteristics=found)
        return True

    return alter


def _in_file(name: str, key: str) -> Callable[[Evidence], bool]:
    """Alter a number in a file that people read, and not in the records."""

    def alter(evidence: Evidence) -> bool:
        path = evidence.folder / name
        text = path.read_text() if path.exists() else ""
        before = json.loads(text) if text else {}
        place = before["zones"][0] if name == "zone.json" and text else before.get("result", before)
        if place.get(key) is None:
            return False
        place[key] += 1e-3
        path.write_text(json.dumps(before))
        return True

    return alter


def _byte(evidence: Evidence) -> bool:
    path = evidence.folder / "records.bin"
    data = path.read_bytes()
    path.write_bytes(data[:-9] + bytes([data[-9] ^ 1]) + data[-8:])
    return True


ALTERATIONS: dict[str, Callable[[Evidence], bool]] = {
    "a point by a micrometre": _move("points", 0, 1e-3),
    "a deviation by a micrometre": _move("deviations", 5, 1e-3),
    "a station by ten micrometres": _move("deviations", 4, 1e-2),
    "the verdict made better": _better_verdict,
    "the verdict made worse": _worse_verdict,
    "the angle by a millionth of a degree": _turn,
    "one point more": _count("received", 1),
    "one lost point more": _count("lost", 1),
    "the largest deviation": _count("max_deviation_mm", -1),
    "the losses left out": _say_nothing_of_losses,
    "a run that is cut off": _cut,
    "a value made smaller": _value,
    "the zone of a certificate": _certificate("zone_mm", -1e-3),
    "the bound of a certificate": _certificate("bound", 1e-3),
    "the gap of a certificate": _certificate("gap_mm", -1e-5),
    "the last value": _any_value("value"),
    "the last deviation": _any_value("deviation"),
    "the zone in zone.json": _in_file("zone.json", "zone_mm"),
    "the minimum zone in result.json": _in_file("result.json", "minimum_zone_mm"),
    "the zone error in run.json": _in_file("run.json", "zone_error_mm"),
    "a byte of the records": _byte,
}
"""Ways to alter any run; each tells whether the run has what it alters. Those of a file, and the last, leave the chain as it was."""
