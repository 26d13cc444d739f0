"""The folder of results that `--out` asks for."""

import json
from pathlib import Path
from typing import Any

from cmmlink.errors import PlanError
from cmmlink.report.deviations_csv import write_deviations
from inspection import InspectionResult, NominalProfile


def write_results(folder: Path, facts: dict[str, Any], result: InspectionResult | None, profile: NominalProfile, title: str) -> None:
    """Write result.json, and where something was judged deviations.csv and profile.png."""
    from cmmlink.report.picture import write_picture  # noqa: PLC0415 - matplotlib takes half a second that other commands need not pay

    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "result.json").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
        if result is not None and result.judged:
            write_deviations(result, folder / "deviations.csv")
            write_picture(result, profile, title, folder / "profile.png")
    except OSError as error:
        raise PlanError(f"{folder}: the results cannot be written ({error.strerror}); choose another folder with --out") from None
