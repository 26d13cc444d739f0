"""Files of runs for pages: what becomes of one whose making is broken off."""

import asyncio
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from cmmlink.console.run_file import RunFiles


@pytest.mark.parametrize("is_late", [False, True], ids=["before the file is there", "while it is written"])
def test_a_file_that_is_being_made_when_the_station_ends_leaves_no_folder(is_late: bool) -> None:
    """Nothing is left to be cleaned up by chance, of which Python would warn; and the next file is made."""
    begun, released, written = threading.Event(), threading.Event(), list[int]()
    folders, makers = list[Path](), list[threading.Thread]()

    def export(run: str, folder: Path) -> Path:
        folders.append(folder)
        makers.append(threading.current_thread())
        begun.set()
        assert released.wait(60.0)
        written.append((folder / run).write_bytes(b"archive"))
        return folder / run

    async def break_off() -> RunFiles:
        files = RunFiles(cast(Any, SimpleNamespace(export_run=export)))
        making = asyncio.create_task(files.export(cast(Any, SimpleNamespace(path_params={"run": "r.zip"}))))
        assert await asyncio.to_thread(begun.wait, 60.0)
        making.cancel()
        if is_late:
            released.set()
        with pytest.raises(asyncio.CancelledError):
            await making
        return files

    assert asyncio.run(break_off())._under_way == 0
    released.set()
    makers[0].join(60.0)
    assert written == [7], "the folder was there as long as it was written into"
    assert [folder.exists() for folder in folders] == [False]
