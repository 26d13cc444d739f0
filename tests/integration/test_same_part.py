"""One blade, measured by a serial scanner, a coordinate measuring machine, and a machine tool: the same result to the last digit.

All three tell positions in steps of 0.1 um, which the shortest of their numbers holds.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.demo import plan_file, section_on_machine
from tests.cmmlink.command import cmmlink
from tests.integration.simulated import simulated

STEP_MM, RATE_HZ = 0.2, 1000.0
SECTION_MM = section_on_machine()[::4]
COUNT = round(float(np.hypot(*np.diff(SECTION_MM, axis=0).T).sum()) / STEP_MM)
BLADE = ["--tip-radius-mm", "1.0", "--form-error-mm", "0.02", "--resolution-mm", "0.0001", "--unpaced"]
# What results by different devices may differ in.
OF_ITS_OWN = {"run", "device", "measured_at", "chain_sha256", "plan_sha256", "signature", "notes"}
MORE = "section: {origin_mm: [0, 10, 0]}\ndiscretisation: {samples: 300}\n"
DEVICES = {
    "serial": "{type: serial, address: 'ADDRESS'}",
    "dme": f"{{type: dme, address: 'ADDRESS', scan: {{type: curve, step_mm: {STEP_MM}}}}}",
    "machine-tool": "{type: lines, address: 'ADDRESS', unit: mm}",
}


def measured(device: str, folder: Path, *options: str) -> dict[str, Any]:
    """The result of the demonstration's plan with a device of this kind, but for what is its own."""
    (folder / "nominal.csv").write_bytes(plan_file().with_name("nominal.csv").read_bytes())
    demo = plan_file().read_text(encoding="utf-8")
    with simulated(
        device,
        "127.0.0.1:0",
        folder,
        *BLADE,
        *options,
        path_mm=SECTION_MM,
        count=COUNT,
        rate_hz=RATE_HZ,
        speed_mm_s=STEP_MM * RATE_HZ,
        noise_mm=0.001,
    ) as machine:
        mine = DEVICES[device].replace("ADDRESS", machine.address)
        (folder / "plan.yaml").write_text(demo.replace("{type: serial, address: simulated}", mine) + MORE, encoding="utf-8")
        done = cmmlink("run", folder / "plan.yaml", "--json", "--records", folder / "records")
    assert done.code in (0, 1), done.err
    return {key: value for key, value in done.json().items() if key not in OF_ITS_OWN}


@pytest.mark.parametrize(("defect", "verdict"), [((), "conform"), (("--defect-mm", "0.15", "--defect-station-mm", "70"), "nonconform")])
def test_a_blade_has_the_same_result_by_every_machine(defect: tuple[str, ...], verdict: str, tmp_path: Path) -> None:
    by_line = measured("serial", tmp_path, *defect)
    assert (by_line["verdict"], by_line["received"], by_line["judged"]) == (verdict, COUNT, COUNT)
    assert len(by_line) > 30
    assert measured("dme", tmp_path, *defect) == by_line
    assert measured("machine-tool", tmp_path, *defect) == by_line
