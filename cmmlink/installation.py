"""What an installation is, to the bit: its own files, the libraries that compute, Python, the system and the processor.

A qualification holds for the installation that it was made on. To read some hundred megabytes takes half a second, which no inspection
can wait for; so what was found is kept beside the sizes and times of all files and folders, which are asked in some milliseconds. A file
that was written to has another time. Whoever has to be certain reads every file anew: `cmmlink qualify` and `cmmlink doctor`.

The kernel of the system is left out: it computes nothing, and it is replaced every month. Its C library is in.
"""

import hashlib
import json
import os
import platform
import subprocess
import sys
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib import metadata, util
from pathlib import Path
from typing import Any

from platformdirs import user_data_path

from cmmlink.version import __version__
from inspection import compiled_code_folder

_OURS = ("inspection", "drivers", "simulators", "cmmlink")
_COMPUTING = ("numpy", "scipy", "numba", "llvmlite")  # every deviation goes through their code, so that each of their files counts
_READING = ("pydantic", "PyYAML", "ezdxf", "pymodbus", "pyserial", "cadquery-ocp-novtk", "open3d-cpu", "open3d")
_CODE = (".py", ".so", ".pyd", ".dll", ".dylib")
_NO_CODE_OF_A_RUN = ("__pycache__", "tests")
_COMPILED = ".nbc"  # the ending of what numba keeps of a compiled function
_KNOWN = "installation.json"


@dataclass(frozen=True, slots=True)
class Installation:
    """What is installed.

    parts    : for each part its version, or the hash of the names and contents of all its files
    compiled : the hash of each compiled kernel that is kept on the disk; a further one, or one less, is no change
    """

    parts: Mapping[str, str]
    compiled: Mapping[str, str] = field(default_factory=dict)

    @property
    def sha256(self) -> str:
        """One hash that changes with any of the parts."""
        return hashlib.sha256(json.dumps(dict(self.parts), sort_keys=True).encode()).hexdigest()

    def changes_since(self, earlier: "Installation") -> list[str]:
        """The names of the parts that are not as they were."""
        changed = [name for name in {**earlier.parts, **self.parts} if earlier.parts.get(name) != self.parts.get(name)]
        if any(self.compiled.get(name, sha256) != sha256 for name, sha256 in earlier.compiled.items()):
            changed.append("compiled kernels")
        return changed


@dataclass(frozen=True, slots=True)
class _Files:
    """The wanted files of a folder and of all folders below it, and these folders, named from there."""

    root: Path
    names: Sequence[str]
    folders: Sequence[str]

    @classmethod
    def of(cls, root: Path, is_wanted: Callable[[str], bool]) -> "_Files":
        """Look for the files whose names are wanted. There are none where there is no folder, as of a package in an archive."""
        names, folders = [], []
        for folder, below, files in os.walk(root):
            below[:] = [name for name in below if name not in _NO_CODE_OF_A_RUN]
            place = Path(folder).relative_to(root)
            folders.append(place.as_posix())
            names += [(place / name).as_posix() for name in files if is_wanted(name)]
        return cls(root, sorted(names), sorted(folders))

    def hashes(self) -> dict[str, str]:
        """The hash of each file."""
        return {name: _sha256(self.root / name) for name in self.names}


def station_folder() -> Path:
    """The folder where an account keeps its qualifications, beside its records."""
    return user_data_path("cmmlink", appauthor=False) / "qualification"


@cache
def installation_here() -> Installation:
    """What is installed, told in some milliseconds where no file was touched. A process asks it once: it keeps the code that it loaded."""
    return _known(station_folder() / _KNOWN) or read_installation(station_folder())


def read_installation(folder: Path) -> Installation:
    """What is installed, by reading every file. What was found is kept in `folder`, where that can be written."""
    packages = {name: _Files.of(root, _is_ours) for name, root in _roots(_OURS)}
    packages |= {name: _Files.of(root, _is_code) for name, root in _roots(_COMPUTING)}
    kernels = _Files.of(compiled_code_folder() or folder / "none", _is_compiled)
    paths = [str(files.root / name) for files in packages.values() for name in (*files.folders, *files.names)]
    paths += [str(kernels.root / name) for name in kernels.names] + list(_folders_of_packages())
    stamps = _stamps(paths)  # before the files are read: of what is written meanwhile the times are others then
    of_files = {f"files of {name}": _sha256_of(files.hashes()) for name, files in packages.items()}
    found = Installation({**_surroundings(), **_versions(), **of_files}, kernels.hashes())
    _keep(folder / _KNOWN, {"paths": paths, "stamps": stamps, **asdict(found)})
    return found


def versions_installed() -> dict[str, str]:
    """The version of cmmlink, and of every library that a verdict depends on."""
    return {"cmmlink": __version__, **_versions()}


def _roots(names: tuple[str, ...]) -> Iterator[tuple[str, Path]]:
    """The folders of packages; the wheels of a library may bring a second folder, of the libraries that it needs."""
    for name in names:
        spec = util.find_spec(name)
        if spec is None or spec.origin is None:
            continue
        root = Path(spec.origin).parent
        yield name, root
        if (beside := root.with_name(f"{name}.libs")).is_dir():
            yield beside.name, beside


def _folders_of_packages() -> Iterator[str]:
    """The folders that libraries are installed into: their times tell that a library has another version."""
    return (place for place in sys.path if place.endswith("-packages") and os.path.isdir(place))


def _is_ours(name: str) -> bool:
    return not name.endswith(".pyc")


def _is_code(name: str) -> bool:
    return name.endswith(_CODE) or ".so." in name


def _is_compiled(name: str) -> bool:
    return name.endswith(_COMPILED)


def _stamps(paths: Iterable[str]) -> str:
    """A hash of the sizes and times of files and folders; empty where one of them is gone."""
    told = array("q")
    try:
        for path in paths:
            found = os.stat(path)
            told.extend((found.st_size, found.st_mtime_ns, found.st_ctime_ns))
    except OSError:
        return ""
    return hashlib.sha256(told.tobytes()).hexdigest()


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _sha256_of(hashes: Mapping[str, str]) -> str:
    return hashlib.sha256("".join(f"{name} {sha256}\n" for name, sha256 in hashes.items()).encode()).hexdigest()


def _surroundings() -> dict[str, str]:
    """Python, the system with its C library, and the processor."""
    return {"Python": f"{platform.python_implementation()} {sys.version}", "system": _system(), "processor": _processor()}


def _system() -> str:
    name = f"{platform.system()} {platform.machine()}"
    if sys.platform == "win32":
        return f"{name} {platform.version()}"
    if sys.platform == "darwin":
        return f"{name} {platform.mac_ver()[0]}"
    with suppress(ValueError, OSError):  # a C library that does not tell its version
        return f"{name} {os.confstr('CS_GNU_LIBC_VERSION')}"
    return name


def _processor() -> str:
    """The model of the processor: on another one other instructions compute."""
    if sys.platform == "win32":
        return os.environ.get("PROCESSOR_IDENTIFIER", "unknown")
    if sys.platform == "darwin":
        with suppress(OSError, subprocess.SubprocessError):
            asked = ["/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string"]
            return subprocess.run(asked, capture_output=True, text=True, check=True, timeout=5).stdout.strip()
        return platform.machine()
    with suppress(OSError, StopIteration), open("/proc/cpuinfo", encoding="utf-8", errors="replace") as told:
        return next(line for line in told if line.lower().startswith(("model name", "cpu model"))).partition(":")[2].strip()
    return platform.machine()


def _versions() -> dict[str, str]:
    found = {}
    for name in (*_COMPUTING, *_READING):
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def _known(file: Path) -> Installation | None:
    """What is kept of this installation; None where nothing is, or where a file or the surroundings are not as they were then."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        told = json.loads(file.read_bytes())
        found = Installation(told["parts"], told["compiled"])
        if told["stamps"] == _stamps(told["paths"]) != "" and all(found.parts[name] == now for name, now in _surroundings().items()):
            return found
    return None


def _keep(file: Path, told: Mapping[str, Any]) -> None:
    """Keep what was found, whole or not at all; where it cannot be kept, it is looked up anew every time."""
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        new = file.with_name(f"{file.name}.{os.getpid()}")
        new.write_text(json.dumps(told), encoding="utf-8")
        new.replace(file)
