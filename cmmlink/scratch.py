"""Arrays of a long scan on a disk instead of in memory: constant memory beyond `ROWS_IN_MEMORY` points, and room told beforehand.

A long array lies in a file without a name, which is gone with the array or with the program, and is mapped into memory, so that the
operating system may write it out and read it back. The file is written before it is mapped: a full disk is an error here, and never a
signal in the middle of a loop. An array that has to be longer is mapped again with more of its file: nothing is copied, so the next
points of a scan cost what the first ones did.
"""

import mmap
import os
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.errors import StoreError

ROWS_IN_MEMORY = 1 << 18  # points of a scan that are kept in memory: 26 s at 10,000 points/s
RUNNING_BYTES = 170  # of disk that a point may need while it is measured: raw bytes and point in the record, its row and room to grow
FINISHING_BYTES = 110  # and at the end: its verdict in the record, and what the fits work with
RESERVE_BYTES = 256 << 20  # of disk that stays free
_PIECE = bytes(1 << 20)
_MEND = "Free some space, or keep the records elsewhere with --records DIR"


class Scratch:
    """Gives arrays like numpy.empty; those of more than `rows_in_memory` rows lie in the folder's file system.

    folder : None takes the system's folder for temporary files
    """

    def __init__(self, folder: Path | None = None, rows_in_memory: int = ROWS_IN_MEMORY) -> None:
        self.folder = folder if folder is not None else Path(tempfile.gettempdir())
        self._rows_in_memory = rows_in_memory
        self._mapped: weakref.WeakValueDictionary[int, _Mapped] = weakref.WeakValueDictionary()  # by where they lie in memory

    def __call__(self, shape: tuple[int, ...], kind: type[np.generic]) -> NDArray[Any]:
        """An array whose values are not set. Raises StoreError where the disk has no room for it."""
        if shape[0] <= self._rows_in_memory:
            return np.empty(shape, kind)
        return self._map(_UnnamedFile(self.folder), shape, kind)

    def resize(self, array: NDArray[Any], rows: int) -> NDArray[Any] | None:
        """An array that was given, with so many rows where it lies. None where it lies in memory, and has to be copied.

        Raises StoreError where the disk has no room for it.
        """
        memory = self._mapped.get(array.ctypes.data)
        if memory is None:
            return None
        return array[:rows] if rows <= len(array) else self._map(memory.file, (rows, *array.shape[1:]), array.dtype.type)

    def refusal(self, received: int, announced: int | None = None) -> str:
        """Why a run cannot go on after so many points, where its disk has no room for the rest of it; nothing where it has.

        A disk that does not say how much room it has ends no run: what is written next shows whether it has any.
        """
        try:
            free = _free_bytes(self.folder)
        except StoreError:
            return ""
        if free < RESERVE_BYTES + FINISHING_BYTES * received:
            told = f"only {free / 1e6:.0f} MB are free after {received:,} points; the run ends here so that it can be kept"
        elif (announced or 0) - received > (fit := _points_in(free, received)):
            told = f"the device announces {announced:,} points and there is room for {received + fit:,}"
        else:
            return ""
        return f"{self.folder}: {told}. {_MEND}"

    def _map(self, file: "_UnnamedFile", shape: tuple[int, ...], kind: type[np.generic]) -> NDArray[Any]:
        self._let_go()
        try:
            memory = file.map(int(np.prod(shape)) * np.dtype(kind).itemsize)
        except OSError as error:
            raise StoreError(f"{self.folder}: a scan of {shape[0]} points does not fit there ({error.strerror}); {_MEND}") from None
        array = np.frombuffer(memory, kind).reshape(shape)
        self._mapped[array.ctypes.data] = memory
        return array

    def _let_go(self) -> None:
        """Let the system have the memory of what was mapped so far; what was written stays in the files."""
        if hasattr(mmap, "MADV_DONTNEED"):
            for memory in list(self._mapped.values()):
                memory.madvise(mmap.MADV_DONTNEED)


class _Mapped(mmap.mmap):
    """The beginning of a file without a name as memory."""

    file: "_UnnamedFile"


class _UnnamedFile:
    """A file that only this process knows, as long as it or memory of it is in use."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._size = folder, 0
        self._file: IO[bytes] | None = None

    def map(self, size: int) -> _Mapped:
        """So many bytes of it; what was not written before is zero. Raises OSError where the disk has no room for them."""
        if self._file is None:
            self._file = tempfile.TemporaryFile(dir=self._folder, prefix="cmmlink-", buffering=0)  # noqa: SIM115 - closed with its last mapping
            weakref.finalize(self, self._file.close)
        while (left := size - self._size) > 0:
            self._size += self._file.write(_PIECE[: min(left, len(_PIECE))])
        memory = _Mapped(self._file.fileno(), size)
        memory.file = self
        return memory


def _free_bytes(folder: Path) -> int:
    """What is free on the disk of a folder, or of the nearest one above it that exists. Raises StoreError where it does not say."""
    try:
        return shutil.disk_usage(_nearest(folder)).free
    except OSError as error:
        raise StoreError(f"{folder}: cannot be used: {error}; choose another folder with --records DIR") from error


def _points_in(free: int, received: int) -> int:
    return max(0, free - RESERVE_BYTES - FINISHING_BYTES * received) // (RUNNING_BYTES + FINISHING_BYTES)


def points_that_fit(folder: Path) -> int:
    """How many points a run can measure before the disk of a folder is full. Raises StoreError where it does not say."""
    return _points_in(_free_bytes(folder), 0)


def words_of_room(folder: Path) -> str:
    """How many points fit on the disk of a folder, for people."""
    fit = points_that_fit(folder)
    return f"{folder}: room for {fit:,} points, {fit / 36_000_000:.1f} hours at 10,000 points/s"


def scratch_in(folder: Path | None) -> Scratch:
    """Room on the disk of a folder that is there or will be, or with the system's temporary files where nothing can be written there.

    Temporary files may lie in memory; records never do.
    """
    try:
        place = None if folder is None else _nearest(folder)
        return Scratch(place if place is not None and place.is_dir() and os.access(place, os.W_OK) else None)
    except OSError:  # the folder cannot be looked at
        return Scratch(None)


def _nearest(folder: Path) -> Path:
    """The folder itself, or the nearest one above it that exists."""
    folder = folder.absolute()
    return next(path for path in (folder, *folder.parents) if path.exists())
