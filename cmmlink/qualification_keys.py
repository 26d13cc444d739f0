"""The keys of the certificate of a qualification, as `qualify --json` prints it and its file holds it."""

from typing import Literal

from pydantic import Field

from cmmlink.inspection_keys import JsonObject
from cmmlink.last_qualification import QualificationResult

QualifiedKind = Literal["deviation", "pose", "zone", "filter", "characteristics", "wire to verdict"]


class BudgetEntry(JsonObject):
    """One quantity over all cases of the set."""

    kind: QualifiedKind = Field(description="the kind of number that it is")
    quantity: str = Field(description="what was held against its truth")
    unit: str = Field(description="mm, deg, share or count")
    values: int = Field(description="how many numbers were held against their truth; 0 where there was nothing, which is outside")
    cases: int = Field(description="how many cases of the set they come from")
    largest: float | None = Field(description="the largest error; null where a number was missing")
    median: float | None = Field(description="the median of the largest errors of the cases; null where there is none")
    worst_case: str = Field(description="the case with the largest error")
    limit: float = Field(description="how large the largest error may be")
    inside: bool = Field(description="whether it is")
    reason: str = Field(description="why that limit")


class WireLatency(JsonObject):
    """From the arrival of a point until its verdict; told without a limit, because computers are busy."""

    median: float = Field(description="the median, ms")
    p99: float = Field(description="99 % of the points took no longer, ms")
    largest: float = Field(description="the longest, ms")


class WireScan(JsonObject):
    """The scan with a simulated scanner in a process of its own."""

    rate_hz: float = Field(description="how many points a second it sent")
    sent: int = Field(description="how many it sent")
    received: int = Field(description="how many arrived")
    latency_ms: WireLatency | None = Field(description="how long they waited for their verdicts; null where none arrived")


class ReferenceSetRun(JsonObject):
    """The reference set that was judged."""

    cases: int = Field(description="how many cases it has")
    files: int = Field(description="how many files it was written to")
    sha256: str = Field(description="the hash of the names and hashes of all its files")


class QualifiedMachine(JsonObject):
    """The computer."""

    name: str = Field(description="its name")
    system: str = Field(description="its system with its version")
    processors: int | None = Field(description="how many processors it has")


class InstallationQualified(JsonObject):
    """The installation to the bit."""

    sha256: str = Field(description="one hash of all its parts")
    parts: dict[str, str] = Field(description="of each part its version, or the hash of the names and contents of its files")


class Qualified(JsonObject):
    """The certificate."""

    schema_urn: Literal["urn:cmmlink:qualification:1"] = Field(alias="schema", description="the version of these keys")
    date: str = Field(description="when it was begun, in UTC")
    result: QualificationResult = Field(description="passed only where every line of the budget is inside its limit")
    outside: list[QualifiedKind] = Field(description="the kinds with a line that is outside")
    duration_s: float = Field(description="how long it took")
    set_judged: ReferenceSetRun = Field(alias="set", description="the reference set that was judged")
    budget: list[BudgetEntry] = Field(description="the error budget, a line for each quantity")
    wire: WireScan = Field(description="the scan from the wire to the verdict")
    problems: list[str] = Field(description="why numbers are missing, in words")
    software: dict[str, str] = Field(description="the versions of cmmlink and of every library that a verdict depends on")
    machine: QualifiedMachine = Field(description="the computer")
    installation: InstallationQualified = Field(description="the installation to the bit")
    certificate_sha256: str = Field(description="the hash of all else in this object: JSON with sorted keys and without blanks")
