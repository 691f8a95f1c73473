"""The event stream: each WebSocket gets the engine's events, a snapshot first, and how other work stands
whenever that changes; nothing is taken in."""

import asyncio
import contextlib
import json
from collections import deque
from collections.abc import Callable, Sequence
from typing import Protocol

from fastapi import FastAPI, WebSocket, WebSocketDisconnect
from pydantic import BaseModel

from turnlight.capture.engine import Engine
from turnlight.capture.events import Event, as_json

ALIVE_S = 5.0
MOST_LISTENERS = 200
_REMEMBERED = 32
_ALIVE = json.dumps({"kind": "alive"})


class Work(Protocol):
    """What goes on beside runs. `now` is replaced, not changed, and `wake` is called, when it changes."""

    @property
    def now(self) -> BaseModel: ...
    def listen(self, wake: Callable[[], None]) -> Callable[[], None]: ...


class Words:
    """What is told as JSON, put into words once for all sockets."""

    def __init__(self) -> None:
        self._latest: deque[tuple[Event | BaseModel, str]] = deque(maxlen=_REMEMBERED)

    def of(self, told: Event | BaseModel) -> str:
        for known, text in self._latest:
            if known is told:
                return text
        text = told.model_dump_json() if isinstance(told, BaseModel) else json.dumps(as_json(told))
        self._latest.appendleft((told, text))
        return text


class Bell:
    """Wakes who waits in the running loop: one knock from another thread, however many they are."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._knocked = False
        self.waiting: set[asyncio.Event] = set()

    def ring(self) -> None:
        """From any thread."""
        if not self._knocked:
            self._knocked = True
            with contextlib.suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        self._knocked = False
        for news in self.waiting:
            news.set()


def add_stream(api: FastAPI, engine: Engine, beside: Sequence[Work]) -> None:
    """Serve what happens at /api/events."""
    listeners: dict[WebSocket, Bell] = {}
    words = Words()

    @api.websocket("/api/events")
    async def events(socket: WebSocket) -> None:
        if len(listeners) >= MOST_LISTENERS:
            await socket.close(1013, "Too many pages are open.")
            return
        await socket.accept()
        bell = listeners[socket] = next(iter(listeners.values()), None) or Bell()
        try:
            await _until_gone(socket, engine, beside, words, bell)
        finally:
            del listeners[socket]


async def _until_gone(
    socket: WebSocket, engine: Engine, beside: Sequence[Work], words: Words, bell: Bell
) -> None:
    talking = [_tell(socket, engine, beside, words, bell), _hear(socket)]
    tasks = [asyncio.create_task(one) for one in talking]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _tell(
    socket: WebSocket, engine: Engine, beside: Sequence[Work], words: Words, bell: Bell
) -> None:
    news = asyncio.Event()
    news.set()
    bell.waiting.add(news)
    subscription = engine.subscribe(bell.ring)
    leavers = [work.listen(bell.ring) for work in beside]
    told: dict[int, BaseModel] = {}
    try:
        while True:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(news.wait(), ALIVE_S)
            if not news.is_set():
                await socket.send_text(_ALIVE)
            news.clear()
            while (event := subscription.get(0)) is not None:
                await socket.send_text(words.of(event))
            for number, work in enumerate(beside):
                if (now := work.now) is not told.get(number):
                    told[number] = now
                    await socket.send_text(words.of(now))
    finally:
        for leave in leavers:
            leave()
        subscription.close()
        bell.waiting.discard(news)


async def _hear(socket: WebSocket) -> None:
    """What a page says is of no interest; that it has gone is."""
    with contextlib.suppress(WebSocketDisconnect):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass
