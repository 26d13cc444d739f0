"""A record judged again: first as it was, to the last bit, then with a wider tolerance.

Every run is recorded, with its plan and its nominal; a replay takes the recorded bytes or points through the same inspection.

It prints:

    recorded: nonconform, received 800
    replayed: nonconform, identical to the last bit: True
    with 0.15 mm: conform
      changed tolerance.lower_mm from -0.05 to -0.15
      changed tolerance.upper_mm from 0.05 to 0.15
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


def cmmlink(*arguments: str) -> Any:
    """Run a command in the folder of this example, and give the object that it prints."""
    command = [sys.executable, "-m", "cmmlink", *arguments, "--records", "records", "--json"]
    return json.loads(subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=False).stdout)


with tempfile.TemporaryDirectory() as folder:
    for file in (HERE / "plan.yaml", *(HERE.parent / "data").glob("cam*")):
        shutil.copy(file, folder)
    recorded = cmmlink("run", "plan.yaml", "--headless")
    again = cmmlink("replay", "last")
    wider = cmmlink("replay", "last", "--tolerance", "-0.15", "0.15")

print(f"recorded: {recorded['verdict']}, received {recorded['received']}")
print(f"replayed: {again['verdict']}, identical to the last bit: {again['identical']}")
print(f"with 0.15 mm: {wider['verdict']}")
for change in wider["changed"]:
    print(f"  changed {change['key']} from {change['recorded']} to {change['replayed']}")
