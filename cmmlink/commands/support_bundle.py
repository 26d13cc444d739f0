"""One zip file with everything that helps to find the cause of a problem from afar."""

import json
import locale
import os
import platform
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.log import log_files, log_folder
from cmmlink.record import export_run, find_run, open_to_read
from cmmlink.version import __version__
from inspection import compiled_code_folder


def pack_bundle(file: Path, said: Sequence[str], records: Path, now: Callable[[], datetime]) -> Iterator[str]:
    """Write the file and yield a line for each thing in it, and for what is missing. Raises PlanError where it cannot be written.

    doctor.txt    : what `cmmlink doctor` said
    log           : the log file and the older ones
    versions.json : every installed package with its version
    platform.json : system, Python, and where compiled code is kept
    run           : the newest run of the records, as `cmmlink export` writes it

    said : lines of the doctor
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            yield f"packed into {file}:"
            yield from _pack(archive, said, records, now)
    except OSError as error:
        raise PlanError(f"{file}: the bundle cannot be written ({error.strerror}); choose another file") from None
    yield "the run holds the plan, the nominal and every measured point: look whether you may send it"


def _pack(archive: zipfile.ZipFile, said: Sequence[str], records: Path, now: Callable[[], datetime]) -> Iterator[str]:
    archive.writestr("doctor.txt", "\n".join(said) + "\n")
    yield f"  doctor.txt: {len(said)} lines of what was looked at"
    logs = log_files(log_folder())
    for log in logs:
        archive.write(log, f"log/{log.name}")
    yield f"  log: {len(logs)} files from {log_folder()}" if logs else f"  no log was found in {log_folder()}"
    versions = _versions()
    archive.writestr("versions.json", _text(versions))
    yield f"  versions.json: {len(versions)} installed packages"
    archive.writestr("platform.json", _text(_platform()))
    yield "  platform.json: system, Python, compiled code"
    yield _pack_newest_run(archive, records, now)


def _pack_newest_run(archive: zipfile.ZipFile, records: Path, now: Callable[[], datetime]) -> str:
    try:
        with tempfile.TemporaryDirectory() as folder, open_to_read(records, now) as store:
            run = find_run(store, "last")
            for file in export_run(store, run, Path(folder)):
                archive.write(file, f"run/{file.name}")
    except (RunError, StoreError) as error:
        return f"  no run: {error}"
    return f"  run: {run}, the newest in {records}"


def _versions() -> Mapping[str, str]:
    found = {str(package.metadata["Name"]): package.version for package in metadata.distributions()}
    return {"cmmlink": __version__, **dict(sorted(found.items()))}


def _platform() -> Mapping[str, Any]:
    compiled = compiled_code_folder()
    return {
        "system": platform.platform(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
        "python": sys.version,
        "executable": sys.executable,
        "c_library": " ".join(platform.libc_ver()),
        "locale": ".".join(filter(None, locale.getlocale())),
        "encodings": {"files": sys.getfilesystemencoding(), "output": sys.stdout.encoding},
        "compiled_code": {
            "folder": str(compiled) if compiled else None,
            "files": len(list(compiled.iterdir())) if compiled else 0,
            "bytes": sum(path.stat().st_size for path in compiled.iterdir()) if compiled else 0,
        },
    }


def _text(document: Mapping[str, Any]) -> str:
    return json.dumps(document, indent=2) + "\n"
