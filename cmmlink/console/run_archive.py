"""A recorded run on its way to a page, as a zip archive in a temporary folder that is gone afterwards, however it ends."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import anyio.to_thread
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

from cmmlink.console.refused import Refused, words_of

_MOST = 4  # at a time


class RunArchives:
    """Packs runs for pages. Belongs to the event loop, but for the packing itself.

    export_run : writes a run as an archive into a folder
    """

    def __init__(self, export_run: Callable[[str, Path], Path]) -> None:
        self._export_run = export_run
        self._under_way = 0

    async def answer(self, run: str) -> Response:
        """The answer to a page that asks for a run."""
        if self._under_way >= _MOST:
            return PlainTextResponse("other runs are being exported; try again when they are done", 503)
        self._under_way += 1
        try:
            archive, folder = await anyio.to_thread.run_sync(self._pack, run)
        except BaseException as error:
            self._under_way -= 1
            if isinstance(error, Refused):
                return PlainTextResponse(str(error), 404)
            if isinstance(error, OSError):
                return PlainTextResponse(words_of(error), 500)
            raise
        return _Archive(archive, folder, self._end)

    def _pack(self, run: str) -> tuple[Path, tempfile.TemporaryDirectory[str]]:
        """Write a run as an archive into a folder that is to be cleaned up. Raises Refused, OSError."""
        folder = tempfile.TemporaryDirectory()
        try:
            return self._export_run(run, Path(folder.name)), folder
        except BaseException:
            folder.cleanup()
            raise

    def _end(self) -> None:
        self._under_way -= 1


class _Archive(FileResponse):
    """An archive that is being sent."""

    def __init__(self, archive: Path, folder: tempfile.TemporaryDirectory[str], on_end: Callable[[], None]) -> None:
        super().__init__(archive, media_type="application/zip")
        self._folder, self._on_end = folder, on_end

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._folder.cleanup()
            self._on_end()
