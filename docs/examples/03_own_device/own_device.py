"""A Modbus device of one's own: a register map and a plan, and nothing to program.

The device is simulated here: `cmmlink simulate modbus-ring` serves registers as map.yaml describes them. For a real one, write its
address into plan.yaml, and `cmmlink run plan.yaml` is all.

It prints:

    nonconform: received 1000, judged 1000, rejected 0, lost 0
    out of tolerance in 1 place, near station 70 mm
"""

import json
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
CMMLINK = [sys.executable, "-m", "cmmlink"]
SCAN = shlex.split("--path path.csv --rate 2000 --speed 300 --count 1000 --form-error-mm 0.01 --noise-mm 0.001 --unpaced")


def simulate(folder: Path) -> tuple[subprocess.Popen[str], str]:
    """Start the simulated device in a process of its own; give the process and the address that it serves."""
    command = [*CMMLINK, "simulate", "modbus-ring", "--address", "127.0.0.1:0", *SCAN]
    device = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    assert device.stdout is not None
    return device, device.stdout.readline().strip()


with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    for file in (HERE / "map.yaml", HERE.parent / "data" / "cam.yaml"):
        shutil.copy(file, folder)
    shutil.copy(HERE.parent / "data" / "cam-points.csv", folder / "path.csv")  # the probe moves along these points
    device, address = simulate(folder)
    try:
        plan = (HERE / "plan.yaml").read_text(encoding="utf-8").replace("127.0.0.1:5020", address)
        (folder / "plan.yaml").write_text(plan, encoding="utf-8")
        command = [*CMMLINK, "run", "plan.yaml", "--headless", "--json", "--records", "records"]
        ended = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=False)
    finally:
        device.terminate()
        device.communicate()

result = json.loads(ended.stdout)
print(f"{result['verdict']}: " + ", ".join(f"{key} {result[key]}" for key in ("received", "judged", "rejected", "lost")))
places = [(stretch["from_mm"] + stretch["to_mm"]) / 2 for stretch in result["stretches"]]
print(f"out of tolerance in {len(places)} place, near station {places[0]:.0f} mm")
