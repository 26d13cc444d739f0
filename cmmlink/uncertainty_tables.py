"""The uncertainty of a result for people and programs: the GUM budget as lines of text, the JSON object, and uncertainty.csv."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cmmlink.csv_rows import write_rows

if TYPE_CHECKING:
    from inspection import InspectionResult, PartName, ProfileUncertainty

COLUMNS = {
    "station_mm": "arc length from the start of the nominal",
    "expanded_mm": "U, the expanded uncertainty of a deviation there: coverage factor times standard_mm, plus |growth_left_mm|",
    "standard_mm": "u, the combined standard uncertainty: the root of the sum of the squares of its parts",
    "repeatability_mm": "its part by what is independent from point to point",
    "device_mm": "its part by the maximum permissible error of the device, after what the fit takes away",
    "tip_radius_mm": "its part by the calibrated radius of the tip",
    "temperature_mm": "its part by the temperature of the part",
    "expansion_mm": "its part by the coefficient of expansion",
    "growth_left_mm": "growth that is known and was not taken out of the points, as it stands in the deviation there",
}
_PARTS: "tuple[PartName, ...]" = ("repeatability", "device", "tip radius", "temperature", "expansion")


def uncertainty_json(result: "InspectionResult") -> dict[str, Any] | None:
    """The uncertainty of the deviations as JSON holds it; None where no budget was stated."""
    found = result.uncertainty
    if found is None:
        return None
    told = found.telling_places()
    return {
        "basis": found.basis,
        "coverage_factor": found.stated.coverage_factor,
        "largest_mm": found.largest_mm,
        "station_mm": float(found.station_mm[found.worst]),
        "standard_mm": float(found.standard_mm[found.worst]),
        "growth_left_mm": float(found.left_mm[found.worst]),
        "used_mm": result.zone.uncertainty_mm,
        "largest_by_noise_mm": result.largest_by_noise_mm,
        "budget": [line._asdict() for line in found.contributions()],
        "stations": [
            {"station_mm": station, "expanded_mm": expanded}
            for station, expanded in zip(found.station_mm[told].tolist(), found.expanded_mm[told].tolist(), strict=True)
        ],
    }


def uncertainty_lines(result: "InspectionResult") -> Iterator[str]:
    """The GUM budget as lines of text; none where no budget was stated."""
    found = result.uncertainty
    if found is None:
        return
    at, factor = found.worst, found.stated.coverage_factor
    left_mm = float(abs(found.left_mm[at]))
    left = f" + {left_mm:.5f} mm of growth that was not compensated" if left_mm else ""
    yield (
        f"U of a deviation, by {found.basis}: at most {found.largest_mm:.5f} mm, at station {found.station_mm[at]:.2f} mm "
        f"(k = {factor:g}, u = {found.standard_mm[at]:.5f} mm{left}); there"
    )
    yield f"  {'':14}{'value':>13}  {'distribution':13}{'type':5}{'u(x)':>11}{'sensitivity':>13}{'u (mm)':>10}{'of u^2':>8}"
    for line in found.contributions():
        yield (
            f"  {line.name:14}{f'{line.value:.4g} {line.unit}':>13}  {line.distribution:13}{line.evaluated:5}{line.standard:11.4g}"
            f"{line.sensitivity:13.4g}{line.contributed_mm:10.5f}{line.share:8.1%}"
        )
    if result.largest_by_noise_mm:
        yield f"  noise alone raises the largest |deviation| of so many points by {result.largest_by_noise_mm:.4f} mm on average"


def write_uncertainty(found: "ProfileUncertainty", path: Path) -> None:
    """Write the uncertainty at all places along the profile that are told of."""
    rows = found.telling_places()
    parts = [found.parts_mm[name] for name in _PARTS]
    columns = [found.station_mm, found.expanded_mm, found.standard_mm, *parts, found.left_mm]
    with path.open("wb") as file:
        file.write((",".join(COLUMNS) + "\r\n").encode())
        write_rows(file, [np.column_stack(columns)[rows]])
