"""Access to the flight: only our own page may connect, not pages of others that the browser has open as well.

A browser lets any page connect to a WebSocket on this machine; the header `Origin` says which page it was (RFC 6455,
section 10.2). In DNS rebinding, the name of a foreign page is made to resolve to this machine while the page is open;
the header `Host` then has that name. Viser checks neither.
"""

import contextlib
import ipaddress
import socket
from collections.abc import Iterator
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from sbs_sim.cockpit.page_head import with_page_head
from sbs_sim.errors import SbsError


def refusal(request: Request, host: str) -> str:
    """Why a request is refused; empty if it is not.

    Parameters
    ----------
    request : Request
    host : str
        Where the page is served.
    """
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    if len(hosts) != 1 or not _is_here(hosts[0], host):
        return f"Host {', '.join(hosts) or 'missing'}: allowed are an address, localhost, and the name of this machine"
    if "Upgrade" in request.headers and any(origin.partition("://")[2] != hosts[0] for origin in origins):
        return f"Origin {', '.join(origins)}: allowed is the page itself, {hosts[0]}"
    return ""  # what sends no origin is no browser


def _is_here(given: str, host: str) -> bool:
    """True if a name with its port cannot be another's for this machine."""
    try:
        name = urlsplit(f"//{given}").hostname or ""
        if name in ("localhost", host.lower(), socket.gethostname().lower()):
            return True
        ipaddress.ip_address(name)  # which no name server can turn to somewhere else
    except ValueError:
        return False
    return True


@contextlib.contextmanager
def access_check(host: str) -> Iterator[None]:
    """Have servers of viser that are made meanwhile answer such requests with 403.

    Viser makes its server with `websockets.asyncio.server.serve` and leaves no other way to have a say in the opening
    handshake; later would be too late, for the first messages of a client come with it.

    Raises
    ------
    SbsError
        No server was made that way.
    """
    serve = websockets.asyncio.server.serve
    made = []

    def guard(handler: Any, *address: Any, process_request: Any, **options: Any) -> Any:
        def check(connection: ServerConnection, request: Request) -> Response | None:
            if why := refusal(request, host):
                return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
            response: Response | None = process_request(connection, request)
            if response is not None:  # a page of others must not frame this one to have it clicked on
                response.headers["Content-Security-Policy"] = "frame-ancestors 'self'"
                response = with_page_head(response)
            return response

        made.append(True)
        return serve(handler, *address, process_request=check, **options)

    websockets.asyncio.server.serve = guard  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]
    if not made:
        raise SbsError(
            "this version of viser serves its page in a way that cannot be protected: use the pinned version"
        )
