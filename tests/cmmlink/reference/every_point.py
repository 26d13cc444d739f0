"""Check every point of every case of the reference set: `make reference`, some minutes."""

import sys
import tempfile
import time
import traceback
from pathlib import Path

from cmmlink.nominal_files import load_nominal
from cmmlink.reference import reference_cases, write_reference
from tests.cmmlink.reference.exact_truth import Written, check_consumption, check_deviations, check_least_squares, check_sums, check_zone
from tests.cmmlink.reference.formats import check_formats
from tests.cmmlink.reference.section_truth import check_bent, check_filters, check_outliers, check_placement, check_section


def check_case(folder: Path) -> None:
    """All that is stated of a case."""
    case = Written(folder)
    truth = case.truth
    if "deviation" in truth:
        feet = check_deviations(case, range(len(case.points)))
        check_sums(case)
        if truth["kind"] in ("best-fit", "placement") or (truth["kind"] == "disturbed" and case.plan["weights"] == "points"):
            check_least_squares(case, feet)
    if "zone" in truth and truth["zone"]["held_by"]:
        check_zone(case)
    if "consumption" in truth:
        check_consumption(case)
    for kind, check in (("filter", check_filters), ("section", check_section), ("placement", check_placement)):
        if truth["kind"] == kind:
            (check_bent if "-bent-" in truth["case"] else check)(case)
    if "outliers" in truth:
        check_outliers(case)
    check_formats(folder, truth["unit"])
    load_nominal(folder / "nominal.step")


def main() -> int:
    """Check all cases, or those whose names begin with the arguments."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "set"
        names = sorted({name.split("/")[0] for name in write_reference(folder, reference_cases()) if "/" in name})
        failed = 0
        for name in names:
            if sys.argv[1:] and not name.startswith(tuple(sys.argv[1:])):
                continue
            begun = time.monotonic()
            try:
                check_case(folder / name)
                print(f"{name}: true ({time.monotonic() - begun:.1f} s)", flush=True)
            except AssertionError:
                failed += 1
                print(f"{name}: NOT TRUE\n{traceback.format_exc()}", flush=True)
        return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
