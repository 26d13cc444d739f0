"""What the record keeps of a result, be it of a section or of a whole surface: its document, and the rows of its points."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from cmmlink.events import Counts
from cmmlink.record.bodies import JUDGED_ROWS, pack_judged
from cmmlink.record.surface_bodies import pack_surface
from cmmlink.result_json import result_json
from cmmlink.surface_rows import surface_blocks

if TYPE_CHECKING:
    from inspection import InspectionResult
    from inspection.surface import SurfaceResult

DocumentOf = Callable[["InspectionResult | SurfaceResult | None", Counts], dict[str, Any]]
"""Says what the record tells of a result, from it and the counts of its run; without a result from the counts alone."""


def document_of_section(result: "InspectionResult | SurfaceResult | None", counts: Counts) -> dict[str, Any]:
    """What the record tells of the result of a section."""
    from inspection import InspectionResult  # noqa: PLC0415 - who reads records needs no inspection

    return result_json(result if isinstance(result, InspectionResult) else None, counts)


def judged_bodies(result: "InspectionResult | SurfaceResult | None") -> Iterator[tuple[int, bytes]]:
    """The rows of a result as the record holds them, one body after the other, each with its number of rows."""
    from inspection import InspectionResult  # noqa: PLC0415 - likewise

    if result is None or isinstance(result, InspectionResult):
        return pack_judged(result.blocks(JUDGED_ROWS) if result is not None else ())
    return pack_surface(surface_blocks(result, JUDGED_ROWS))
