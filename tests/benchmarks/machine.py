"""On which machine, with which versions and when a benchmark ran: the line that stands over its figures."""

import datetime
import importlib.metadata
import os
import platform
from pathlib import Path


def machine(*packages: str) -> str:
    """Date, processor, cores, system, versions of Python and of those of the packages that are installed."""
    versions = [f"Python {platform.python_version()}"]
    for package in packages:
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{package} not installed")
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    return f"{today}; {processor()}, {os.cpu_count()} cores, {platform.system()}; {', '.join(versions)}."


def processor() -> str:
    """Name of the processor: figures of another one are not comparable."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    named = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())
    return named or platform.machine()


def load() -> str:
    """How much else the machine has to do, the means of 1, 5 and 15 minutes, as far as the system tells."""
    return f"Load {', '.join(f'{each:.1f}' for each in getattr(os, 'getloadavg', tuple)()) or 'not known'}."
