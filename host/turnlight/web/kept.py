"""What many pages ask for is made once."""

import asyncio
import threading
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from typing import Generic, TypeVar

T = TypeVar("T")


class Kept(Generic[T]):
    """The latest `most` values by key; for several threads."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._made: dict[Hashable, Future[T]] = {}

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """The value of `key`, made now if it has not been; who comes meanwhile waits. What `make` raises."""
        kept, first = self._of(key)
        if first:
            self._make(key, kept, make)
        return kept.result()

    async def soon(self, key: Hashable, make: Callable[[], T]) -> T:
        """As `once`, with `make` in a thread of its own; who waits takes none."""
        kept, first = self._of(key)
        if first:
            await asyncio.shield(asyncio.to_thread(self._make, key, kept, make))
        if not kept.done():
            await asyncio.shield(asyncio.wrap_future(kept))
        return kept.result()

    def _of(self, key: Hashable) -> tuple[Future[T], bool]:
        """What is or will be the value, and whether it is the caller's to make."""
        with self._lock:
            if key in self._made:
                return self._made[key], False
            kept = self._made[key] = Future()
            if len(self._made) > self._most:
                self._made.pop(next(iter(self._made)))
        return kept, True

    def _make(self, key: Hashable, kept: Future[T], make: Callable[[], T]) -> None:
        try:
            kept.set_result(make())
        except BaseException as error:
            with self._lock:
                self._made.pop(key, None)
            kept.set_exception(error)
