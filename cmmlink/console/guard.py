"""Who is served: the addresses that are ours, the pages that are ours. And the security headers of every answer."""

import contextlib
import socket
from collections.abc import Callable

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}


class Guard:
    """Refuses requests that are not meant for us.

    host, port : where the server listens; remote : whether other computers can reach it
    """

    def __init__(self, app: ASGIApp, host: str, port: int, remote: bool) -> None:
        self._app = app
        self._is_ours = hosts_served(host, port, remote)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a request, or pass it on."""
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        scheme = "https" if scope["scheme"] in ("https", "wss") else "http"
        refusal: Response | None = None
        if not self._is_ours(host):
            refusal = PlainTextResponse("this address is not served here", 400)
        elif (scope["type"] == "websocket" or origin is not None) and origin != f"{scheme}://{host}":
            refusal = PlainTextResponse("pages of other origins are not served", 403)
        if refusal is not None and scope["type"] == "websocket":
            await WebSocket(scope, receive, send).send_denial_response(refusal)
        else:
            await (refusal or self._app)(scope, receive, send)


def hosts_served(host: str, port: int, remote: bool) -> Callable[[str], bool]:
    """Which Host headers are ours: names of this machine, with our port."""
    bare = host.strip("[]").lower()
    names = {"127.0.0.1", "localhost", "[::1]", f"[{bare}]" if ":" in bare else bare}
    names |= {socket.gethostname().lower()} if remote else set()
    own = {f"{name}:{port}" for name in names} | (names if port in (80, 443) else set())

    def is_ours(header: str) -> bool:
        # A foreign name that resolves to us (rebinding) is never a bare address, so addresses may pass where we serve others.
        return header.lower() in own or (remote and _is_address(header, port))

    return is_ours


def _is_address(host: str, port: int) -> bool:
    name, _, given = host.rpartition(":")
    if given != str(port):
        return False
    for family, text in ((socket.AF_INET, name), (socket.AF_INET6, name.strip("[]"))):
        with contextlib.suppress(OSError, ValueError):
            socket.inet_pton(family, text)
            return True
    return False
