"""Recorded runs on their way to a page, as an archive or a report in a temporary folder that is gone afterwards, however it ends."""

import tempfile
import threading
from asyncio import CancelledError
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import get_args

import anyio.to_thread
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

from cmmlink.console.refused import Refused, words_of
from cmmlink.console.station import Station
from cmmlink.console.trend_look import AskedTrend, trends_of
from cmmlink.plan import LanguageName, PaperName

EXPORT_S = 3600.0
_MOST = 4  # at a time
_MEDIA = {".pdf": "application/pdf", ".xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"}
_LOOKS = {"language": get_args(LanguageName), "paper": get_args(PaperName)}  # of a report, as far as a page chooses them


class RunFiles:
    """Makes files of a station's runs for pages. Belongs to the event loop, but for the making itself."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._under_way = 0

    async def export(self, request: Request) -> Response:
        """One run as an archive."""
        run = request.path_params["run"]
        return await self._answer(lambda folder: self._station.export_run(run, folder), "application/zip")

    async def report(self, request: Request) -> Response:
        """The report of one run, in the language and on the paper that are asked for."""
        run, asked = request.path_params["run"], request.query_params
        settings = {name: asked[name] for name, allowed in _LOOKS.items() if asked.get(name) in allowed}
        return await self._answer(lambda folder: self._station.report_run(run, folder, settings), "application/pdf")

    async def trend(self, request: Request) -> Response:
        """The trend of a part as a drawing, or as a workbook."""
        asked = request.query_params
        suffix = ".xlsx" if asked.get("as") == "xlsx" else ".pdf"
        language = asked["language"] if asked.get("language") in _LOOKS["language"] else "en"
        look = self._station.trends
        return await self._answer(lambda folder: trends_of(look).write(AskedTrend.of(asked), folder, suffix, language), _MEDIA[suffix])

    async def compare(self, request: Request) -> Response:
        """Two runs on one drawing."""
        first, second = request.path_params["first"], request.path_params["second"]
        return await self._answer(lambda folder: self._station.compare_runs(first, second, folder), "application/pdf")

    async def _answer(self, make: Callable[[Path], Path], media_type: str) -> Response:
        """The answer to a page that asks for a file; `make` writes it into a folder."""
        if self._under_way >= _MOST:
            return PlainTextResponse("other runs are being exported; try again when they are done", 503)
        with ExitStack() as ending:
            self._under_way += 1
            ending.callback(self._end)
            try:
                folder = _Folder()
                ending.callback(folder.let_go)
                file = await anyio.to_thread.run_sync(folder.fill, make)  # a station that ends meanwhile cancels it here, not in the thread
            except Refused as refusal:
                return PlainTextResponse(str(refusal), 404)
            except OSError as error:
                return PlainTextResponse(words_of(error), 500)
            return _RunFile(file, media_type, ending.pop_all())

    def _end(self) -> None:
        self._under_way -= 1


class _Folder:
    """A temporary folder held by who answers the page and, while it makes the file, by a thread; the last to let go removes it."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._lock, self._holders = threading.Lock(), 1

    def fill(self, make: Callable[[Path], Path]) -> Path:
        """Let a file be made in it, in the calling thread. Raises CancelledError where nobody waits for it any more."""
        with self._lock:
            if not self._holders:
                raise CancelledError
            self._holders += 1
        try:
            return make(Path(self._folder.name))
        finally:
            self.let_go()

    def let_go(self) -> None:
        """Hold it no longer."""
        with self._lock:
            self._holders -= 1
            if not self._holders:
                self._folder.cleanup()


class _RunFile(FileResponse):
    """A file that is being sent; `ending` is closed behind it."""

    def __init__(self, file: Path, media_type: str, ending: ExitStack) -> None:
        super().__init__(file, media_type=media_type)
        self._ending = ending

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        with self._ending:
            await super().__call__(scope, receive, send)
