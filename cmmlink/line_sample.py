"""Lines of a machine tool as a plan describes them: their decoder, and its trial on a file of lines that the machine printed."""

import re

from cmmlink.errors import PlanError
from cmmlink.plan import LinesDevice
from drivers import Damaged, Decoder, DeviceError, PointBatch, PointFileError, Rejected, ScanClosed, decoder, read_bytes


def line_decoder(device: LinesDevice, tip_radius_mm: float, parity: str = "") -> Decoder:
    """The decoder of a machine tool's lines; `parity` is even or odd where the bytes carry it as their eighth bit."""
    radius = {"tip_radius_mm": tip_radius_mm, "radius_tolerance_mm": device.radius_tolerance_mm} if device.format.language == "g800" else {}
    return decoder(device.format.name, unit=device.unit, parity=parity, **radius, **device.format.options)


def check_existing(device: LinesDevice) -> None:
    """Raise PlanError where a file that is read from its beginning holds several sets, and the plan does not say which is meant."""
    path, asked = device.file, device.format
    if path is None or not device.existing or asked.language != "g800" or asked.result_set or not path.exists():
        return
    try:
        sets = len(re.findall(rb"^[ \x00\x11-\x14]*START *$", read_bytes(path).replace(b"\r", b"\n"), re.MULTILINE))
    except PointFileError as error:
        raise PlanError(str(error)) from None
    if sets > 1:
        told = f"{path.name} holds {sets} sets; name the one to take by its RESULTSFILE or DOCUMENTID"
        raise PlanError(f"device.format.result_set: {told}")


def check_sample(device: LinesDevice, tip_radius_mm: float) -> None:
    """Read the sample of a plan's lines as a scan would. Raises PlanError for the first line that cannot be used, or where no point is."""
    sample = device.format.sample
    if sample is None:
        return
    try:
        data = read_bytes(sample)
    except PointFileError as error:
        raise PlanError(str(error)) from None
    reading, points = line_decoder(device, tip_radius_mm), 0
    for number, line in enumerate(re.findall(rb"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+$", data), start=1):
        try:
            found = reading.feed(line if line.endswith((b"\r", b"\n")) else line + b"\n")
        except DeviceError as error:
            raise PlanError(f"{sample.name}, line {number}: {error}") from None
        points += sum(len(arrival) for arrival in found if isinstance(arrival, PointBatch))
        for arrival in found:
            if isinstance(arrival, Damaged | Rejected):
                shown = line.decode("latin-1").strip()
                raise PlanError(f"{sample.name}, line {number}: {shown!r:.80} gives no point: {arrival.reason}")
        if any(isinstance(arrival, ScanClosed) for arrival in found):
            break
    if not points:
        raise PlanError(f"{sample.name} holds no line with a point, as device.format describes it")
