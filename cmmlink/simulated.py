"""Simulated devices as processes of their own; that of the demonstration walks along the nominal with form error, noise and a pose."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from cmmlink.demo import write_part_path
from cmmlink.devices import Connected, source_of, words_of
from cmmlink.plan import Plan
from drivers import LinkError
from inspection import NominalProfile

_ENDS_WITHIN_S = 20.0
RATE_HZ, _POINTS = 2000, 4000  # so that the scan can be watched for two seconds


@contextmanager
def connect_demo_device(plan: Plan, profile: NominalProfile, seed: int, defect: tuple[float, float] | None) -> Iterator[Connected]:
    """Start a simulated device and make it ready for one scan of one part; another seed is another part.

    defect : height and station of a local defect, both in mm
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "path.csv"
        write_part_path(profile.curve, path)
        with simulated_device("serial", ["--path", str(path), *_motion(plan, profile, seed, defect)]) as address:
            plan = plan.with_address(address)
            yield Connected(source_of(plan), words_of(plan.device), simulated=True)


def _motion(plan: Plan, profile: NominalProfile, seed: int, defect: tuple[float, float] | None) -> list[str]:
    """Arguments of the simulator: form error and noise well inside the tolerance, an arbitrary pose on the table."""
    zone = plan.zone
    motion = {
        "rate": RATE_HZ,
        "speed": profile.length_mm * RATE_HZ / _POINTS,
        "count": _POINTS,
        "seed": seed,
        "form-error-mm": 0.4 * zone.upper_mm,
        "noise-mm": 0.04 * zone.upper_mm,
        "tip-radius-mm": plan.probe.tip_radius_mm,
        "rotation-deg": 37.0 + 11.0 * (seed % 30),
    }
    arguments = [text for name, value in motion.items() for text in (f"--{name}", f"{value:.17g}")]
    arguments += ["--translation-mm", "210", "145", "60"]
    if defect is not None:
        arguments += ["--defect-mm", str(defect[0]), "--defect-station-mm", str(defect[1])]
    return arguments


@contextmanager
def simulated_device(device: str, arguments: Sequence[str]) -> Iterator[str]:
    """Run a simulated device as a process of its own and yield the address that it serves."""
    address = "127.0.0.1:0" if sys.platform == "win32" else "pty"
    command = [
        sys.executable,
        "-m",
        "simulators",
        device,
        "--address",
        address,
        *arguments,
        "--until-stdin-ends",
    ]  # a tenth of what `cmmlink simulate` loads
    # In a session of its own, so that Ctrl-C reaches only the run, which then stops the device.
    # It ends with the pipe to its standard input, so that it does not outlive a run that was killed.
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stderr is not None
    with process.stdin, process.stdout, process.stderr:
        try:
            served_address = process.stdout.readline().strip()
            if not served_address:
                raise LinkError(f"the simulated device did not start: {process.stderr.read().strip()}")
            yield served_address
        finally:
            process.terminate()
            process.wait(_ENDS_WITHIN_S)
