"""A test of the device: what it says in the first seconds, in one sentence for the operator."""

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager

from cmmlink.console.job import Job
from cmmlink.console.protocol import DeviceTest
from cmmlink.console.refused import without_folders
from cmmlink.devices import Connected
from cmmlink.errors import PlanError
from drivers import DeviceError, PointBatch, PointFileError, ScanOpened

UNTESTED = DeviceTest("none", "")
TESTING = DeviceTest("testing", "listening")
_LONGEST_S = 5.0
_ENOUGH_POINTS = 200


def listen_to_device(job: Job, connect: Callable[[], AbstractContextManager[Connected]], clock: Callable[[], float]) -> DeviceTest:
    """Listen until the device has shown itself, the time is over, or the job is aborted."""
    try:
        with connect() as connected:
            job.attach(connected.trial or connected.source)
            message = _listen(connected, clock)
    except (DeviceError, PlanError, PointFileError) as error:
        return DeviceTest("failed", without_folders(str(error)))
    return DeviceTest("aborted", "aborted") if job.stop.is_set() else DeviceTest("passed", message)


def _listen(connected: Connected, clock: Callable[[], float]) -> str:
    began_s, points, device = clock(), 0, ""
    source = connected.trial or connected.source
    timer = threading.Timer(_LONGEST_S, source.stop)
    timer.name, timer.daemon = "device test's end", True
    timer.start()
    try:
        for arrival in source.arrivals():
            if isinstance(arrival, ScanOpened):
                device = " ".join(filter(None, (arrival.device, arrival.serial_number)))
            elif isinstance(arrival, PointBatch):
                points += len(arrival)
            if points >= _ENOUGH_POINTS:
                break
    finally:
        timer.cancel()
        source.stop()
    device = device or connected.device
    if connected.trial is not None:
        return f"{device}: it answers; nothing was moved"
    if not points:
        return f"{device}: the link opened, but no point came within {_LONGEST_S:g} s"
    taken = "The test took them out of the device's stream: they are in no run; start the device's scan anew before the part is measured."
    return f"{device}: {points} points in {clock() - began_s:.1f} s. {taken}"
