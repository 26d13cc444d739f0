"""Who may come in: the addresses that are served, the pages that are ours, the token, and the security headers of every answer."""

import contextlib
import hmac
import socket
from collections.abc import Callable

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_HEADERS = {
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
    """Refuses requests that are not meant for us, and puts the security headers on every answer.

    host, port : where the server listens
    """

    def __init__(self, app: ASGIApp, host: str, port: int) -> None:
        self._app = app
        self._is_ours = hosts_served(host, port)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a request, or pass it on."""
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        refusal: Response | None = None
        if not self._is_ours(host):
            refusal = PlainTextResponse("this address is not served here", 400)
        elif (scope["type"] == "websocket" or origin is not None) and origin != f"http://{host}":
            refusal = PlainTextResponse("pages of other origins are not served", 403)
        if scope["type"] == "websocket":
            await (WebSocket(scope, receive, send).send_denial_response(refusal) if refusal else self._app(scope, receive, send))
            return
        await (refusal or self._app)(scope, receive, _with_headers(send))


def is_remote(host: str) -> bool:
    """Whether a server that listens at `host` can be reached from other machines."""
    return host not in _LOOPBACK


def knows_token(given: object, token: str) -> bool:
    """Whether somebody gave the right token; takes as long for a wrong one."""
    return isinstance(given, str) and hmac.compare_digest(given.encode(), token.encode())


def hosts_served(host: str, port: int) -> Callable[[str], bool]:
    """Which Host headers are ours: names of this machine, with our port."""
    remote = is_remote(host)
    names = {"127.0.0.1", "localhost", "[::1]"} | ({socket.gethostname().lower(), host.lower()} if remote else set())
    own = {f"{name}:{port}" for name in names} | (names if port == 80 else set())

    def is_ours(header: str) -> bool:
        # A foreign name that resolves to us (rebinding) is never a bare address, so addresses may pass where we serve others.
        return header.lower() in own or (remote and _is_address(header, port))

    return is_ours


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(_HEADERS)
        await send(message)

    return send_with_headers


def _is_address(host: str, port: int) -> bool:
    name, _, given = host.rpartition(":")
    if given != str(port):
        return False
    for family, text in ((socket.AF_INET, name), (socket.AF_INET6, name.strip("[]"))):
        with contextlib.suppress(OSError):
            socket.inet_pton(family, text)
            return True
    return False
