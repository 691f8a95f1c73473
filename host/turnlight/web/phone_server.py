"""The phone's service as a process: on the network, and never without a token."""

import asyncio
import secrets
import socket
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

import uvicorn

from turnlight.handheld.handheld import Handheld
from turnlight.handheld.inbox import Arrival, Inbox
from turnlight.handheld.verdict import Verdict
from turnlight.handheld.watch import Watch
from turnlight.web import door as doors
from turnlight.web.door import Door
from turnlight.web.phone import build
from turnlight.web.server import Address, listen, options

PORT = 8138
COOKIE_NAME = "turnlight-handheld"
_EVERYWHERE = {"0.0.0.0": socket.AF_INET, "::": socket.AF_INET6}
_ELSEWHERE = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}
"""Addresses that nobody has (RFC 5737, RFC 3849)."""


@dataclass(frozen=True)
class Told:
    """Whom to tell what. link: once, when the page can be opened; news: of every photo."""

    link: Callable[[str], None]
    news: Callable[[Verdict | Arrival], None]


def serve_phone(handheld: Handheld, address: Address, watched: Path | None, told: Told) -> None:
    """Serve until a signal ends it; then everything that was received has had its turn.

    watched: a folder to take photos from as well. Raises ServiceError or SessionError at the start.
    """
    token = doors.token_for(address.host, address.token_file) if address.token_file else None
    token = token or secrets.token_urlsafe(24)
    names = doors.own_names() | {name.lower() for name in address.names}
    door = Door(token, names, COOKIE_NAME)
    with listen(address) as listening, Inbox(handheld, told.news) as inbox:
        link = f"http://{_reachable(address)}:{listening.getsockname()[1]}/#{token}"
        server = uvicorn.Server(options(build(inbox, door, link)))
        with Watch(watched, inbox.take) if watched else nullcontext():
            told.link(link)
            with suppress(KeyboardInterrupt):
                asyncio.run(server.serve(sockets=[listening]))


def _reachable(address: Address) -> str:
    """The host's address as others on its network see it."""
    if address.names:
        return address.names[0]
    host = address.host
    family = _EVERYWHERE.get(host)
    if family is not None:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            try:
                probe.connect((_ELSEWHERE[family], 9))  # of a datagram socket: nothing is sent
                host = probe.getsockname()[0]
            except OSError:
                host = "localhost"
    return f"[{host}]" if ":" in host else host
