"""The page of a session, for the browser of this machine alone."""

from __future__ import annotations

import json
import secrets
import socket
import sys
import traceback
from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from trainmj.errors import InputError
from trainmj.explore.page import html
from trainmj.explore.session import Session

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Receive, Scope, Send
    from starlette.websockets import WebSocket

ADDRESS = "127.0.0.1"
_NAMES = (ADDRESS, "localhost")
_LARGEST = 2**20  # bytes of a message from the page
_AT_ONCE = 2  # collisions, each of another page, the pages in turn: MuJoCo steps one while Python tells the other
_SWITCH = 0.5e-3  # after so many seconds a thread of Python's lets another one go on, which comes back from MuJoCo
_HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # which would hand on the token
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
SETTINGS: dict[str, Any] = {
    "log_level": "error",
    "access_log": False,
    "lifespan": "off",
    "server_header": False,
    "timeout_graceful_shutdown": 1,
    "ws": "websockets-sansio",
    "ws_max_size": _LARGEST,
    "ws_per_message_deflate": False,  # nothing leaves the machine
}
"""How the server runs."""

_MISSING = "trainmj explore needs a small server that is not installed: pip install 'trainmj[explore]'"


def needed() -> None:
    """Make sure that the server is installed.

    Raises:
        InputError: if it is not.
    """
    if not all(find_spec(name) for name in ("starlette", "uvicorn", "websockets")):
        raise InputError(_MISSING)


def serve(session: Session, port: int, ready: Callable[[str], None]) -> None:
    """Serve the page of a session until Ctrl-C.

    Args:
        session: that answers.
        port: 0 for any that is free.
        ready: called with the address, once the page can be asked for.

    Raises:
        InputError: if the scenario cannot be computed as it stands, or another program has the port.
    """
    import uvicorn

    sys.setswitchinterval(_SWITCH)
    token = secrets.token_urlsafe(24)
    with listening(port) as found:
        port = found.getsockname()[1]
        config = uvicorn.Config(application(session, token, port), **SETTINGS)
        server = uvicorn.Server(config)
        ready(f"http://{ADDRESS}:{port}/{token}/")
        server.run(sockets=[found])


def listening(port: int) -> socket.socket:
    """A socket of this machine alone, already listening, so that a browser may be opened at once.

    Raises:
        InputError: if another program has the port, or this one may not.
    """
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":  # where it would let two programs listen
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((ADDRESS, port))
        found.listen()
    except OSError as error:
        found.close()
        raise InputError(
            f"--port {port}: cannot listen there ({error.strerror}): take another port, or leave it out for a free one"
        ) from None
    return found


def application(session: Session, token: str, port: int) -> ASGIApp:
    """What is served: one page and the answers of its session, below the token, and nothing else."""
    from anyio import CapacityLimiter
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import HTMLResponse
    from starlette.routing import Route, WebSocketRoute

    hosts = [f"{name}:{port}" for name in _NAMES]
    text = html(session, " ".join(f"ws://{host}" for host in hosts))
    turns = CapacityLimiter(_AT_ONCE)

    async def page(request: Request) -> HTMLResponse:
        return HTMLResponse(text, headers=_HEADERS | {"Content-Security-Policy": "frame-ancestors 'none'"})

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        await _live(socket, session, turns)

    app = Starlette(routes=[Route(f"/{token}/", page), WebSocketRoute(f"/{token}/live", live)])
    return _Guard(app, token, hosts)


class _Guard:
    """Lets through only what this machine's browser asks of the page itself, at the address that was printed."""

    def __init__(self, app: ASGIApp, token: str, hosts: list[str]) -> None:
        self._app, self._token, self._hosts = app, token, hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        from starlette.responses import PlainTextResponse
        from starlette.websockets import WebSocketClose

        said = self._refusal(scope)
        if said is None:
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()
            await WebSocketClose(1008, said)(scope, receive, send)  # before it is accepted: 403
        else:
            await PlainTextResponse(said, 403, _HEADERS)(scope, receive, send)

    def _refusal(self, scope: Scope) -> str | None:
        """Why something is not answered; None if it is."""
        heads = [(name, value.decode("latin-1")) for name, value in scope["headers"]]
        host = [value for name, value in heads if name == b"host"]
        if len(host) != 1 or host[0] not in self._hosts:  # else a foreign name could be turned to this machine
            return "Refused: this page is for the browser of this machine only."
        first = scope["path"].split("/")[1] if "/" in scope["path"] else ""
        if not secrets.compare_digest(first.encode(), self._token.encode()):
            return "Refused: open the whole address that trainmj explore has printed."
        origin = [value for name, value in heads if name == b"origin"]
        if scope["type"] == "websocket" and origin != [f"http://{host[0]}"]:
            return "Refused: only the page itself may ask."
        return None


class _Newest:
    """Messages of a page of which only the newest of each kind waits: those before it are not worth an answer."""

    def __init__(self) -> None:
        from anyio import Event

        self._waiting: dict[str, dict[str, Any]] = {}
        self._came = Event()

    def put(self, message: dict[str, Any]) -> None:
        if message["ask"] == "show":
            self._waiting.pop("rest", None)  # of values that are no longer looked at
        self._waiting[message["ask"]] = message
        self._came.set()

    async def take(self) -> dict[str, Any]:
        from anyio import Event

        await self._came.wait()
        message = self._waiting.pop("show" if "show" in self._waiting else next(iter(self._waiting)))
        if not self._waiting:
            self._came = Event()
        return message


async def _live(socket: WebSocket, session: Session, turns: Any) -> None:
    """Answer a page until it is closed."""
    from anyio import create_task_group, to_thread

    newest = _Newest()

    async def answer() -> None:
        while True:
            message = await newest.take()
            found = await to_thread.run_sync(answered, session, message, limiter=turns, abandon_on_cancel=True)
            await socket.send_text(f'{{"n":{message["n"]},{found[1:]}')

    async with create_task_group() as tasks:
        tasks.start_soon(answer)
        while (told := await socket.receive())["type"] == "websocket.receive":
            message = message_of(told.get("text") or "")  # of bytes there is none
            if message is None:
                await socket.close(1003, "no such message")
                break
            newest.put(message)
        tasks.cancel_scope.cancel()


def message_of(text: str) -> dict[str, Any] | None:
    """A message of the page, if it is one.

    ``{"ask": "show", "n": 3, "changes": {"mass_t": 34}, "last": "mass_t", "wanted": ["Outcome"]}``, where "rest" asks
    for more of what was shown, and "save" for the scenario.
    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if (
        not isinstance(found, dict)
        or found.get("ask") not in ("show", "rest", "save")
        or type(found.get("n")) is not int
    ):
        return None
    changes, wanted = found.get("changes"), found.get("wanted", [])
    if not isinstance(wanted, list) or not all(isinstance(title, str) for title in wanted):
        return None
    if not isinstance(changes, dict) or not all(type(v) in (int, float, str) for v in changes.values()):
        return None
    return found


def answered(session: Session, message: dict[str, Any]) -> str:
    """The answer to a message, whatever happens."""
    try:
        if message["ask"] == "save":
            return session.saved(message["changes"])
        return session.answer(message["changes"], str(message.get("last", "")), message.get("wanted"))
    except Exception as error:  # noqa: BLE001 the page says that it failed, the terminal why, and both go on
        traceback.print_exc()
        return json.dumps({"wrong": {"": f"failed: {type(error).__name__}; the terminal says more"}})
