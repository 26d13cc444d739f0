"""The two posts of a page: a nominal to be understood, and a new plan with its nominal to be saved.

A post has the token, as everything that is asked of the station, comes from a page of the station's own (guard.py), and holds no more
than `LARGEST_NOMINAL`. One is worked on at a time, and none while a part is measured.
"""

import asyncio
from collections.abc import Callable, Mapping

import anyio.to_thread
from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response

from cmmlink.console.form_answers import PlanSaved, Understood
from cmmlink.console.protocol import LARGEST_NOMINAL, json_of
from cmmlink.console.refused import Refused, words_of
from cmmlink.console.station import Station

POST_S = 120.0  # as long as one may take, with reading a solid

Work = Callable[[Mapping[str, str], bytes], Understood | PlanSaved]


class Posts:
    """Takes posts for a station, one after the other. Belongs to the event loop, but for the work itself.

    let_control : lets the page of a number control the station, or raises Refused
    """

    def __init__(self, station: Station, let_control: Callable[[str], None]) -> None:
        self._station, self._let_control = station, let_control
        self._turn = asyncio.Semaphore(1)

    async def understand_nominal(self, request: Request) -> Response:
        """What is understood of a nominal that is handed in."""
        return await self._answer(request, self._station.understand_nominal)

    async def save_plan(self, request: Request) -> Response:
        """A new plan, from the page in control, which says its number."""
        try:
            self._let_control(request.query_params.get("page", ""))
        except Refused as refusal:
            return PlainTextResponse(str(refusal), 409)
        return await self._answer(request, self._station.save_plan)

    async def _answer(self, request: Request, work: Work) -> Response:
        """What the work gives as JSON, or why it is refused."""
        async with self._turn:
            try:
                content = await _content_of(request)
                if content is None:
                    return PlainTextResponse(f"the file is too large: expected at most {LARGEST_NOMINAL >> 20} MB", 413)
                given = await anyio.to_thread.run_sync(work, dict(request.query_params), content)
            except ClientDisconnect:
                return PlainTextResponse("the page is gone", 400)
            except Refused as refusal:
                return PlainTextResponse(str(refusal), 409)
            except OSError as error:
                return PlainTextResponse(words_of(error), 500)
        return Response(json_of(given), media_type="application/json")


async def _content_of(request: Request) -> bytes | None:
    """What a post holds; None where that is too much, of which no more is read."""
    content = bytearray()
    async for piece in request.stream():
        if len(content) + len(piece) > LARGEST_NOMINAL:
            return None
        content += piece
    return bytes(content)
