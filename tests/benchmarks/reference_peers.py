"""The reference set through other libraries: their errors beside ours, by kind, as docs/reference-set/results.md has them.

    python -m tests.benchmarks.reference_peers [--page]

Each is given what it reads and asks for: Open CASCADE the STEP file, scipy the knots, engeom and Open3D samples of the curve, as many as
are stated. Where a library has no way to find a thing, it says "cannot". What is asked of them:

deviation  of every point at the pose that is known, as a signed distance; of ball centres less the radius
sign       points that are put on the wrong side of the nominal
pose       the best fit where every point counts alike, from a start that is a degree and a hundredth of the size away; how far a point is
           from where the known pose brings it
zone       the minimum zone, from the same start
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cmmlink.qualification.budget import MINIMUM_ZONE, POSE
from cmmlink.qualification.cases import errors_of_case
from cmmlink.reference import reference_cases, write_reference
from tests.benchmarks.machine import machine
from tests.benchmarks.reference_peer_libraries import LIBRARIES, Given, Library, ours_distances

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference-set" / "results.md"
NOTES = "## What to read into it"  # stands in the page behind the table, written by hand
KINDS = ("deviation, mm", "points on the wrong side", "pose, mm", "minimum zone, mm")
SIGN_MATTERS_MM = 1e-6


@dataclass
class Errors:
    """Errors of one library, by kind: of each case the largest."""

    found: dict[str, list[tuple[float, str]]] = field(default_factory=dict)
    failed: list[str] = field(default_factory=list)

    def add(self, kind: str, error: float, case: str) -> None:
        self.found.setdefault(kind, []).append((error, case))

    def cell(self, kind: str) -> str:
        found = self.found.get(kind)
        if not found:
            return "cannot"
        errors, (largest, case) = [error for error, _ in found], max(found)
        if kind == KINDS[1]:
            return f"{sum(errors):.0f}"
        return f"{largest:.0e} in `{case}` (median {np.median(errors):.0e}; {len(found)} cases)"


def judge(library: Library, given: Given, errors: Errors) -> None:
    """Hold what a library finds of a case against what is true."""
    case, truth = given.case, given.case.truth
    if truth.pose is None:
        return
    distances = library.distances(given)
    if truth.deviation is not None:
        known = truth.deviation * given.scale
        part = np.isfinite(known)
        found = distances(given.pose(truth.pose).apply(given.points_mm)) - given.radius_mm
        from_curve = known + given.radius_mm
        errors.add(KINDS[0], float(np.abs(np.abs(found + given.radius_mm) - np.abs(from_curve))[part].max()), case.name)
        clear = part & (np.abs(from_curve) > SIGN_MATTERS_MM)
        errors.add(KINDS[1], float((np.sign(found + given.radius_mm) != np.sign(from_curve))[clear].sum()), case.name)
    offset = given.radius_mm > 0 or given.middle_mm != 0
    if library.fit is not None and case.kind == "best-fit" and case.settings.get("weights") == "points" and (library.offset or not offset):
        pose, known_pose = library.fit(given, distances), given.pose(truth.pose)
        errors.add(KINDS[2], float(np.hypot(*(pose.apply(given.points_mm) - known_pose.apply(given.points_mm)).T).max()), case.name)
    if library.largest is not None and truth.zone is not None:
        errors.add(KINDS[3], abs(2 * library.largest(given, distances) - truth.zone.value * given.scale), case.name)


def ours(cases: list[Given]) -> Errors:
    """Ours: distances as the others' are asked, the rest as `cmmlink qualify` finds it, from no start at all."""
    errors = Errors()
    kinds = {"best-fit": KINDS[2], "minimum-zone": KINDS[3]}
    for given in cases:
        judge(Library("cmmlink", "", ours_distances), given, errors)
        if given.case.kind not in kinds:
            continue
        for one in errors_of_case(given.case, given.folder.parent):
            if one.quantity in (POSE, MINIMUM_ZONE):
                errors.add(kinds[given.case.kind], one.error, given.case.name)
    return errors


def lines(cases: list[Given]) -> Iterator[str]:
    """The page, line by line."""
    yield "# The reference set through other programs"
    yield ""
    yield f"{machine('cmmlink', *(library.package for library in LIBRARIES.values()))} {len(cases)} cases."
    yield ""
    yield "Written by `python -m tests.benchmarks.reference_peers --page`, with the extra `bench`. A cell has the largest error over the"
    yield "cases of its kind and where it is. Points on the wrong side are counted over all cases."
    yield ""
    yield f"| | {' | '.join(KINDS)} |"
    yield f"|---|{'---|' * len(KINDS)}"
    found = {"cmmlink": ours(cases)}
    for name, library in LIBRARIES.items():
        errors = found[name] = Errors()
        began = time.perf_counter()
        for given in cases:
            try:
                judge(library, given, errors)
            except (RuntimeError, ValueError, TypeError, AttributeError) as error:
                errors.failed.append(f"{given.case.name}: {error}")
        sys.stderr.write(f"{name}: {time.perf_counter() - began:.0f} s, {len(errors.failed)} failed {errors.failed[:3]}\n")
    for name, errors in found.items():
        yield f"| {name} | {' | '.join(errors.cell(kind) for kind in KINDS)} |"
    yield ""
    yield from (f"- **{name}**: {library.how}." for name, library in LIBRARIES.items())
    yield from (f"- {name} could not: {text}" for name, errors in found.items() for text in errors.failed)


def main() -> int:
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help="write docs/reference-set/results.md")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as own:
        folder = Path(own) / "set"
        all_cases = list(reference_cases())
        write_reference(folder, all_cases)
        cases = [Given(case, folder / case.name) for case in all_cases]
        text = "\n".join(lines(cases)) + "\n"
    sys.stdout.write(text)
    if asked.page:
        kept = PAGE.read_text(encoding="utf-8").partition(NOTES)[1:] if PAGE.is_file() else ()
        PAGE.write_text(text + "".join(["\n", *kept] if kept else []), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
