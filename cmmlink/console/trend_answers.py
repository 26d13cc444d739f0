"""What any page may ask of trends: which there are, one of them, and one as a file."""

from collections.abc import Callable

import anyio.to_thread
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from cmmlink.console.protocol import json_of
from cmmlink.console.refused import Refused, words_of
from cmmlink.console.station import Station
from cmmlink.console.trend_look import AskedTrend, trends_of
from cmmlink.console.trend_words import TrendChoices, TrendShown

LOOK_S = 60.0  # as long as one may take, with a database that is far away
_MOST = 4  # at a time


class TrendAnswers:
    """Answers pages of a station. Belongs to the event loop, but for the looking itself."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._under_way = 0

    async def choices(self, _: Request) -> Response:
        """Which parts and characteristics have results."""
        return await self._answer(lambda: trends_of(self._station.trends).choices())

    async def trend(self, request: Request) -> Response:
        """The trend of one characteristic."""
        return await self._answer(lambda: trends_of(self._station.trends).trend(AskedTrend.of(request.query_params)))

    async def _answer(self, look: Callable[[], TrendChoices | TrendShown]) -> Response:
        if self._under_way >= _MOST:
            return PlainTextResponse("other trends are being looked at; try again when they are done", 503)
        self._under_way += 1
        try:
            return Response(await anyio.to_thread.run_sync(lambda: json_of(look())), media_type="application/json")
        except Refused as refusal:
            return PlainTextResponse(str(refusal), 409)
        except OSError as error:
            return PlainTextResponse(words_of(error), 500)
        finally:
            self._under_way -= 1
