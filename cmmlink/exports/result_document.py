"""JSON: the object that result.json holds, whose keys docs/results.md explains and docs/result.schema.json publishes."""

import json
from collections.abc import Sequence

from cmmlink.exports.measured_part import MeasuredPart
from cmmlink.result_files import NewFiles


def write_json(parts: Sequence[MeasuredPart], files: NewFiles, stem: str) -> None:
    """Write STEM.json of one part."""
    (part,) = parts
    files(f"{stem}.json").write_text(json.dumps(part.document, indent=2) + "\n", encoding="utf-8")
