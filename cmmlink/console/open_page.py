"""One open page: what it looks at, what it was sent, and how long it may take to read."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import anyio.to_thread
from starlette.websockets import WebSocket

from cmmlink.console.connections import Visitor
from cmmlink.console.drawing import nominal_message, points_message
from cmmlink.console.protocol import FoundRuns, History, Message
from cmmlink.extremes import PointsVersion
from cmmlink.record import RunSearch
from cmmlink.run_view import RunView
from inspection import NominalProfile

if TYPE_CHECKING:
    from cmmlink.console.surface_drawing import SurfaceDrawing
    from inspection.surface import NominalSurface

_SENT_WITHIN_S = 10.0  # a page that takes longer to read one message is gone
NOTHING_SOUGHT = FoundRuns(None, 0)
_UNSEEN = PointsVersion(-1, 0)


@dataclass(eq=False)
class OpenPage:
    """One connected browser. Belongs to the event loop.

    generation : of the points it was sent last; counted for each page, because runs number theirs alike
    search     : the runs that it looks for; `found` are those that there were when the history was `searched_in`
    expelled   : it has to come in again, with a new address
    """

    socket: WebSocket
    visitor: Visitor
    number: int
    opened: RunView | None = None
    nominal_of: RunView | None = None
    drawing: "SurfaceDrawing | None" = None
    seen: PointsVersion = _UNSEEN
    generation: int = 0
    sent: dict[str, Message] = field(default_factory=dict)
    search: RunSearch | None = None
    found: FoundRuns = NOTHING_SOUGHT
    searched_in: History | None = None
    expelled: bool = False
    sending: asyncio.Lock = field(default_factory=asyncio.Lock)

    async def look_for_runs(self, history: History, find: Callable[[RunSearch], FoundRuns]) -> None:
        """Look for the runs that the page looks for, unless the history has nothing new since."""
        if self.search is None or self.searched_in is history:
            return
        self.searched_in = history
        self.found = await anyio.to_thread.run_sync(find, self.search)

    async def send(self, message: str | bytes) -> None:
        """Send one message. A page that does not read is gone: it may hold neither memory nor the control of the station."""
        try:
            async with asyncio.timeout(_SENT_WITHIN_S), self.sending:
                sent: Awaitable[None] = self.socket.send_text(message) if isinstance(message, str) else self.socket.send_bytes(message)
                await sent
        except TimeoutError:
            self.visitor.abort()
            raise

    async def show_points(self, view: RunView | None) -> None:
        """Send the nominal of the run it looks at, and the points that changed since it was sent some."""
        if view is None:
            return
        if self.nominal_of is not view:
            self.nominal_of, self.seen = view, _UNSEEN
            self.drawing, message = await anyio.to_thread.run_sync(_begin_to_draw, view.context.nominal)
            await self.send(message)
        if self.seen != view.newest_points:
            packed = await anyio.to_thread.run_sync(_pack_changes, view, self.drawing, self.seen, self.generation)
            self.seen, self.generation = packed.seen, packed.generation
            await self.send(packed.message)


class _Packed(NamedTuple):
    """Points packed for one page, and what the page has seen with them."""

    message: bytes
    seen: PointsVersion
    generation: int


def _begin_to_draw(nominal: "NominalProfile | NominalSurface") -> "tuple[SurfaceDrawing | None, bytes]":
    """What packs the points of a surface, None for a section, and the message with the nominal."""
    if isinstance(nominal, NominalProfile):
        return None, nominal_message(nominal)
    from cmmlink.console.surface_drawing import SurfaceDrawing  # noqa: PLC0415 - who shows sections alone loads nothing of surfaces

    drawing = SurfaceDrawing(nominal)
    return drawing, drawing.nominal_message()


def _pack_changes(view: RunView, drawing: "SurfaceDrawing | None", seen: PointsVersion, generation: int) -> _Packed:
    """Pack the points that changed after what a page has `seen`; `generation` is that of the message before."""
    if drawing is None:
        bins, verdict_at = view.points_since(seen)
        generation += bins.seen.generation != seen.generation
        return _Packed(points_message(bins, generation, verdict_at), bins.seen, generation)
    voxels, verdict_at = view.voxels_since(seen)
    generation += voxels.seen.generation != seen.generation
    return _Packed(drawing.points_message(voxels, generation, verdict_at), voxels.seen, generation)
