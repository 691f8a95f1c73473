"""From one run to whoever listens, from any thread: who comes late first gets the current state."""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import fields, replace

from turnlight.capture import events
from turnlight.capture.events import Event, Snapshot
from turnlight.capture.state import State

MOST_WAITING = 1000
"""Events that a listener may leave unread before it gets a snapshot in their place."""


class Subscription:
    """One listener's events in order, a Snapshot first. Iterate, or `get` with a time-out.

    wake: called, from any thread, whenever there is something to get.
    """

    def __init__(self, hub: "Hub", first: Snapshot, wake: Callable[[], None]) -> None:
        self._hub = hub
        self._wake = wake
        self._waiting: deque[Event] = deque([first])
        self._changed = threading.Condition()
        self._closed = False

    def get(self, timeout_s: float | None = None) -> Event | None:
        """The next event; None when none comes in time, or ever again."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed, timeout_s)
            return self._waiting.popleft() if self._waiting else None

    def __iter__(self) -> Iterator[Event]:
        while (event := self.get()) is not None:
            yield event

    def close(self) -> None:
        """Listen no more."""
        self._hub.leave(self)
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def put(self, event: Event, current: Snapshot) -> None:
        """For the hub: one more event, or `current` for a listener that has fallen far behind."""
        with self._changed:
            if len(self._waiting) >= MOST_WAITING:
                self._waiting.clear()
                self._waiting.append(current)
            else:
                self._waiting.append(event)
            self._changed.notify_all()
        self._wake()


class Hub:
    """Hands each event to every subscription."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._current = Snapshot(State.IDLE)
        self._told_s = time.monotonic()
        self._subscriptions: list[Subscription] = []

    @property
    def current(self) -> Snapshot:
        """The state after the last event."""
        with self._lock:
            return self._current

    @property
    def silent_s(self) -> float:
        """Since the last event."""
        with self._lock:
            return time.monotonic() - self._told_s

    def publish(self, event: Event) -> None:
        """Tell everyone."""
        with self._lock:
            self._current = _after(self._current, event)
            self._told_s = time.monotonic()
            for subscription in self._subscriptions:
                subscription.put(event, self._current)

    def subscribe(self, wake: Callable[[], None] = lambda: None) -> Subscription:
        with self._lock:
            subscription = Subscription(self, self._current, wake)
            self._subscriptions.append(subscription)
            return subscription

    def leave(self, subscription: Subscription) -> None:
        with self._lock:
            if subscription in self._subscriptions:
                self._subscriptions.remove(subscription)


def _after(now: Snapshot, event: Event) -> Snapshot:
    changed: dict[str, object] = {}
    match event:
        case events.StateChanged():
            changed = {"state": event.state, "cause": None}
        case events.Started():
            changed = {f.name: f.default for f in fields(Snapshot) if f.name != "state"}
            changed |= {"folder": event.folder, "sample": event.sample, "count": event.count}
            changed |= {"skipped": {}, "shots": event.safe}
        case events.Rebuilt():
            changed = {"shots": event.shots, "changes": event.changes}
        case events.ShotDone():
            changed = {"shots": tuple(sorted({*now.shots, event.number}))}
            if event.change is not None:
                changed["changes"] = (*now.changes, event.change)
        case events.ShotSkipped():
            changed = {"skipped": now.skipped | {event.number: event.cause}}
        case events.Enough():
            changed = {"enough": True}
        case events.Interrupted() | events.Faulted():
            changed = {"cause": event.cause}
    return replace(now, **changed)  # type: ignore[arg-type]
