"""The service as a process: uvicorn, systemd's watchdog, and what the operator is told at the start."""

import asyncio
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import uvicorn
from fastapi import FastAPI

from turnlight.errors import ServiceError
from turnlight.notify import ALIVE, READY, notify, watchdog_s
from turnlight.web import door as doors
from turnlight.web.api import build
from turnlight.web.desk import Desk
from turnlight.web.door import LARGEST_MESSAGE, Door

PORT = 8137
WEBSOCKETS = "websockets-sansio"
_STARTING_S = 0.05
_AT_MOST_WAITING = 128


@dataclass(frozen=True)
class Address:
    """Where to serve. port: 0 for any that is free; names: host names besides this computer's own."""

    host: str = "127.0.0.1"
    port: int = PORT
    token_file: Path | None = None
    names: tuple[str, ...] = ()


def serve(
    rig_file: Path,
    root: Path,
    address: Address,
    material: Path | None = None,
    tell: Callable[[str], None] = print,
) -> None:
    """Serve until a signal ends it. Raises ServiceError, SessionError or ConfigError at the start."""
    token = doors.token_for(address.host, address.token_file)
    door = Door(token, doors.own_names() | {name.lower() for name in address.names})
    with listen(address) as listening:
        port = listening.getsockname()[1]
        host = f"[{address.host}]" if ":" in address.host else address.host
        with Desk(rig_file, root, material) as desk:
            server = uvicorn.Server(options(build(desk, door)))
            tell(f"The page of the rig {desk.config.name} is at http://{host}:{port}/")
            if not doors.is_loopback(address.host):
                tell(
                    f"Its token is in {address.token_file}. Over plain HTTP whoever listens on this "
                    "network can read it; put a reverse proxy with TLS before it."
                )
            asyncio.run(_run(server, desk, listening))


async def _run(server: uvicorn.Server, desk: Desk, listening: socket.socket) -> None:
    watch = asyncio.create_task(_watch(server, desk))
    try:
        await server.serve(sockets=[listening])
    finally:
        watch.cancel()


async def _watch(server: uvicorn.Server, desk: Desk) -> None:
    """Tell systemd when the page is served, and that page, rig and run are alive from then on."""
    while not server.started:
        await asyncio.sleep(_STARTING_S)
    notify(READY, "STATUS=Ready.")
    while True:
        if desk.standby.alive and desk.engine.alive:
            notify(ALIVE)
        await asyncio.sleep(watchdog_s() / 12)


def options(app: FastAPI) -> uvicorn.Config:
    """How a page is served: little is said, and little waited for."""
    return uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        ws=WEBSOCKETS,
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,
        server_header=False,
        timeout_keep_alive=20,
        timeout_graceful_shutdown=2,
        proxy_headers=False,
    )


def listen(address: Address) -> socket.socket:
    """Raises ServiceError if the address is not to be had."""
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    try:
        return socket.create_server(
            (address.host, address.port), family=family, backlog=_AT_MOST_WAITING
        )
    except (OSError, OverflowError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise ServiceError(
            f"Cannot serve at {address.host} port {address.port}: {reason}; choose another with "
            "--host or --port."
        ) from error
