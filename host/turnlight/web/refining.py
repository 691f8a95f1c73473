"""Refinement from the page: one session at a time, in the background, its progress told."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from pydantic import BaseModel

from turnlight import app
from turnlight.errors import RunError, TurnlightError

RESOLUTION = 256
TOLD_EVERY = 0.02


class RefiningShape(BaseModel):
    """session: the one being refined, or refined last; share: how much of it is done, 1 at the end;
    problem: why it was not."""

    kind: Literal["refining"] = "refining"
    session: str | None = None
    share: float = 1.0
    problem: str | None = None


class Refiner:
    """Refines sessions as they are asked for."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._wakes: set[Callable[[], None]] = set()
        self._now = RefiningShape()

    @property
    def now(self) -> RefiningShape:
        """Replaced, not changed, whenever something happens."""
        return self._now

    def listen(self, wake: Callable[[], None]) -> Callable[[], None]:
        """`wake` is called, from any thread, after every change, until the returned function is."""
        self._wakes.add(wake)
        return lambda: self._wakes.discard(wake)

    def busy_with(self, name: str) -> bool:
        """Is this session being refined?"""
        return self._now.session == name and self._now.share < 1

    def start(self, folder: Path) -> None:
        """Begin to refine this session. Raises RunError while another is being refined."""
        with self._lock:
            if self._now.share < 1:
                raise RunError(f"{self._now.session} is being refined; wait until that is done.")
            self._tell(RefiningShape(session=folder.name, share=0.0))
        threading.Thread(target=self._refine, args=[folder], name="refine", daemon=True).start()

    def _refine(self, folder: Path) -> None:
        end = RefiningShape(session=folder.name, problem="A defect of the program has ended it.")
        try:
            app.refine(folder, True, RESOLUTION, self._progress)
            end = RefiningShape(session=folder.name)
        except TurnlightError as error:
            end = RefiningShape(session=folder.name, problem=str(error))
        finally:
            self._tell(end)

    def _progress(self, share: float) -> None:
        if self._now.share + TOLD_EVERY <= share < 1:
            self._tell(self._now.model_copy(update={"share": share}))

    def _tell(self, now: RefiningShape) -> None:
        self._now = now
        for wake in tuple(self._wakes):
            wake()
