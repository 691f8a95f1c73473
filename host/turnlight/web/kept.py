"""What many pages ask for is made once."""

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
        with self._lock:
            kept = self._made.get(key)
            if kept is not None:
                mine = None
            else:
                kept = mine = self._made[key] = Future()
                if len(self._made) > self._most:
                    self._made.pop(next(iter(self._made)))
        if mine is not None:
            try:
                mine.set_result(make())
            except BaseException as error:
                with self._lock:
                    self._made.pop(key, None)
                mine.set_exception(error)
        return kept.result()

    def now(self, key: Hashable) -> T | None:
        """The value if it has been made; never waits for it."""
        kept = self._made.get(key)
        ready = kept is not None and kept.done() and kept.exception() is None
        return kept.result() if kept is not None and ready else None
