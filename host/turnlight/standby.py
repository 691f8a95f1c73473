"""The rig between runs: connected and warm, its button watched, and lent to whoever needs it."""

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeVar

from svbrdf.materials import MaterialError
from turnlight import app
from turnlight.capture.manifest import Manifest
from turnlight.config import RigConfig
from turnlight.errors import RunError, TurnlightError
from turnlight.notify import watchdog_s
from turnlight.rig.rig import Rig

POLL_S = 0.1
TRY_AGAIN_S = 3.0
_LOOK_S, _LEND_S = 3.0, 60.0
"""How long is waited for whoever has the rig."""

T = TypeVar("T")


class Standby:
    """Owns one rig for as long as a service lives.

    A run that finds the rig connected begins at once; one that ends badly leaves it to be connected
    anew. sample: what is likely to be captured next, which a simulated rig has to know beforehand.
    """

    def __init__(
        self, config: RigConfig, sample: app.Sample, on_button: Callable[[], None]
    ) -> None:
        self.trouble: str | None = None
        """Why the rig is not connected."""
        self._wanted = (config, sample)
        self._held: tuple[RigConfig, app.Sample] | None = None
        self._on_button = on_button
        self._lock = threading.RLock()
        self._parts = contextlib.ExitStack()
        self._rig: Rig | None = None
        self._beaten_s = time.monotonic()
        self._look_began_s: float | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._stand_by, name="standby", daemon=True)

    def start(self) -> None:
        """Begin to watch the button."""
        self._thread.start()

    def close(self) -> None:
        """Let go of the rig, LEDs off."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()
        with self._lock:
            self._let_go()

    @property
    def config(self) -> RigConfig:
        return self._wanted[0]

    @property
    def alive(self) -> bool:
        """Does the rig's thread go round, and is no look stuck? Who has the rig lent may take long."""
        began_s = min(self._beaten_s, self._look_began_s or math.inf)
        return time.monotonic() - began_s < watchdog_s() / 2

    def expect(self, config: RigConfig, sample: app.Sample) -> None:
        """Make ready for a run with this sample."""
        self._wanted = (config, sample)

    @contextlib.contextmanager
    def rig_for(self, manifest: Manifest) -> Iterator[Rig]:
        """The rig for one run, released from any stop; an engine's `BuildRig`.

        Raises what connecting raises.
        """
        sample = app.Sample(manifest.sample, manifest.thickness_mm, manifest.material)
        with self._lock:
            try:
                rig = self._connected(manifest.config, sample)
                try:
                    _greet(rig)
                except TurnlightError:  # it went away since it was last seen
                    self._let_go()
                    rig = self._connected(manifest.config, sample)
                yield rig
            except BaseException:
                self._let_go()
                raise

    def look(self, work: Callable[[Rig], T]) -> T:
        """Do something short with the rig at rest. RunError while it is lent; else what `work` raises."""
        self._take(_LOOK_S)
        self._look_began_s = time.monotonic()
        try:
            rig = self._connected(*self._wanted)
            return work(rig)
        except (TurnlightError, MaterialError):
            self._let_go()
            raise
        finally:
            self._look_began_s = None
            self._lock.release()

    @contextlib.contextmanager
    def lend(self) -> Iterator[Rig]:
        """The rig for something long that is no run; it is connected anew afterwards.

        Raises RunError while someone else has it, and what connecting raises.
        """
        self._take(_LEND_S)
        try:
            rig = self._connected(*self._wanted)
            _greet(rig)
            yield rig
        finally:
            self._let_go()
            self._lock.release()

    def _take(self, timeout_s: float) -> None:
        if not self._lock.acquire(timeout=timeout_s):
            raise RunError("The rig is at work; wait until it is done, or stop it.")

    def _stand_by(self) -> None:
        rest_s = POLL_S
        while not self._closing.wait(rest_s):
            self._beaten_s = time.monotonic()
            rest_s = POLL_S
            if not self._lock.acquire(blocking=False):
                continue
            try:
                pressed = self._poll()
            except (TurnlightError, MaterialError) as error:
                self.trouble = str(error)
                self._let_go()
                rest_s = TRY_AGAIN_S
                continue
            finally:
                self._lock.release()
            if pressed:
                self._on_button()

    def _poll(self) -> bool:
        """Has the button been pressed? Tells the rig that we are alive."""
        rig = self._connected(*self._wanted)
        rig.controller.beat()
        if rig.config.controller.simulated:
            rig.clock.sleep(POLL_S)
        return any(event.kind == "button" for event in rig.controller.take_events())

    def _connected(self, config: RigConfig, sample: app.Sample) -> Rig:
        wanted = (config, sample)
        if self._rig is not None and not _same(self._held, wanted):
            self._let_go()
        if self._rig is None:
            self._rig = self._parts.enter_context(app.build_rig(config, sample))
            self._held = wanted
            self.trouble = None
        return replace(self._rig, config=config)

    def _let_go(self) -> None:
        with contextlib.suppress(TurnlightError):
            self._parts.close()
        self._rig = self._held = None


def _greet(rig: Rig) -> None:
    rig.controller.hello()
    rig.controller.clear()
    rig.controller.take_events()


def _same(held: tuple[RigConfig, app.Sample] | None, wanted: tuple[RigConfig, app.Sample]) -> bool:
    """Would the same rig be built? A real one does not depend on what lies on it."""
    if held is None:
        return False
    (before, lay), (after, lies) = held, wanted
    if before.controller.simulated:
        return before == after and (lay.material, lay.thickness_mm) == (
            lies.material,
            lies.thickness_mm,
        )
    return (before.camera, before.controller, before.led_count) == (
        after.camera,
        after.controller,
        after.led_count,
    )
