"""The event stream: each WebSocket gets the engine's events, a snapshot first, then how a calibration
stands whenever that changes; nothing is taken in."""

import asyncio
import contextlib
from concurrent.futures import CancelledError

from fastapi import FastAPI, WebSocket, WebSocketDisconnect

from turnlight.capture.engine import Engine
from turnlight.capture.events import as_json
from turnlight.web.calibration import Calibrator

ALIVE_S = 5.0
MOST_LISTENERS = 200


def add_stream(api: FastAPI, engine: Engine, calibrator: Calibrator) -> None:
    """Serve what happens at /api/events."""
    listeners: set[WebSocket] = set()

    @api.websocket("/api/events")
    async def events(socket: WebSocket) -> None:
        if len(listeners) >= MOST_LISTENERS:
            await socket.close(1013, "Too many pages are open.")
            return
        await socket.accept()
        listeners.add(socket)
        try:
            await _until_gone(socket, engine, calibrator)
        finally:
            listeners.discard(socket)


async def _until_gone(socket: WebSocket, engine: Engine, calibrator: Calibrator) -> None:
    talking = [_tell(socket, engine, calibrator), _hear(socket)]
    tasks = [asyncio.create_task(one) for one in talking]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _tell(socket: WebSocket, engine: Engine, calibrator: Calibrator) -> None:
    loop, news = asyncio.get_running_loop(), asyncio.Event()
    news.set()

    def wake() -> None:
        with contextlib.suppress(RuntimeError, CancelledError):  # the loop has ended
            loop.call_soon_threadsafe(news.set)

    subscription = engine.subscribe(wake)
    leave = calibrator.listen(wake)
    told = None
    try:
        while True:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(news.wait(), ALIVE_S)
            if not news.is_set():
                await socket.send_json({"kind": "alive"})
            news.clear()
            while (event := subscription.get(0)) is not None:
                await socket.send_json(as_json(event))
            if (now := calibrator.now) is not told:
                told = now
                await socket.send_json(now.model_dump(mode="json"))
    finally:
        leave()
        subscription.close()


async def _hear(socket: WebSocket) -> None:
    """What a page says is of no interest; that it has gone is."""
    with contextlib.suppress(WebSocketDisconnect):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass
