"""Each fault of a bench at a random shot: found in time, lights out, named with a remedy, and got over."""

import os
import pty
import random
import select
import threading
import tty
from collections.abc import Callable
from pathlib import Path

import pytest

from svbrdf.maps import Maps
from turnlight.capture.durable import write
from turnlight.capture.events import (
    Event,
    Finished,
    Interrupted,
    ShotFailed,
    ShotSkipped,
    ShotStep,
)
from turnlight.capture.state import Step
from turnlight.errors import SessionError
from turnlight.estimate.estimator import Estimator
from turnlight.picture.picture import Picture
from turnlight.simulation.faults import CameraFault

from .conftest import LOOK_MS

SHOTS = 3
FOUND_WITHIN_S = 2.0
LEASE_MS = 1000.0
NOISE = 0.01


def exposed(events: list[Event]) -> int:
    return sum(isinstance(e, ShotStep) and e.step is Step.EXPOSED for e in events)


def assert_whole(bench, events: list[Event], repeated: int = 1) -> None:
    """Every shot is in the maps, and at most `repeated` of them were taken twice."""
    assert isinstance(events[-1], Finished), events[-3:]
    manifest = bench.session.manifest
    assert [r.shot.index for r in manifest.used] == list(range(SHOTS))
    assert manifest.finished is not None
    assert exposed(events) <= SHOTS + repeated
    assert not any(bench.board.state().leds)


def assert_found_in_time(bench) -> None:
    assert bench.found_after_s < FOUND_WITHIN_S
    assert bench.dark_after_ms <= LEASE_MS + LOOK_MS


def strike_at(bench, shot: int, fault: Callable[[], None] = lambda: None) -> None:
    """Let this happen once, while the shot is being exposed; the dark frame is number 0."""
    capture = bench.camera.capture

    def capture_and_strike(exposure):
        if bench.camera.taken == shot and bench.struck_s is None:
            bench.strike()
            fault()
        return capture(exposure)

    bench.camera.capture = capture_and_strike


def assert_says(cause: str, *parts: str) -> None:
    assert all(part in cause for part in parts), cause
    assert cause.endswith(".")
    assert ";" in cause  # cause; remedy


@pytest.fixture
def shot() -> int:
    number = random.SystemRandom().randrange(1, SHOTS + 1)
    print(f"the fault is at shot {number}")
    return number


@pytest.mark.parametrize(
    ("fault", "parts"),
    [
        (CameraFault.STALL, ("gives no frames", "check its cable")),
        (CameraFault.DROP, ("A frame was lost", "check its cable")),
        (CameraFault.WRONG_EXPOSURE, ("exposed 20000 us", "run turnlight doctor")),
        (CameraFault.TORN, ("frame is torn", "check the camera's cable")),
    ],
)
def test_a_bad_frame_is_taken_again(
    bench, shot: int, fault: CameraFault, parts: tuple[str, ...]
) -> None:
    bench.camera.faults[shot] = fault  # the dark frame is number 0
    strike_at(bench, shot)
    bench.start()
    events = bench.until(Finished)
    (failed,) = [e for e in events if isinstance(e, ShotFailed)]
    assert (failed.number, failed.attempt) == (shot, 1)
    assert_found_in_time(bench)
    assert_says(failed.cause, *parts)
    assert_whole(bench, events)


def test_an_unplugged_camera_interrupts_and_resume_goes_on(bench, shot: int) -> None:
    bench.camera.faults[shot] = CameraFault.UNPLUG
    strike_at(bench, shot)
    bench.start()
    before = bench.until(Interrupted)
    interrupted = before[-1]
    assert_found_in_time(bench)
    assert interrupted.number == shot
    assert interrupted.safe == shot - 1
    assert str(interrupted) == (
        f"Interrupted at {shot}/{SHOTS}: The camera has gone; plug it in again. "
        f"{shot - 1} shots safe."
    )
    assert not any(bench.board.state().leds)
    assert bench.engine.current.cause == interrupted.cause
    bench.engine.resume()
    assert isinstance(bench.until(Interrupted)[-1], Interrupted)  # still unplugged
    bench.camera.plugged_in = True
    bench.camera.faults.clear()
    bench.engine.resume()
    assert_whole(bench, [*before, *bench.until(Finished)])


def test_a_board_that_resets_is_homed_and_the_shot_repeated(bench, shot: int) -> None:
    strike_at(bench, shot, bench.board.reset)
    bench.start()
    events = bench.until(Finished)
    failed = [e for e in events if isinstance(e, ShotFailed)]
    assert [e.number for e in failed] == [shot]
    assert_says(failed[0].cause, "home")
    assert_found_in_time(bench)
    assert_whole(bench, events)


def test_an_emergency_stop_interrupts(bench, shot: int) -> None:
    strike_at(bench, shot, lambda: bench.board.press_estop(True))
    bench.start()
    before = bench.until(Interrupted)
    assert before[-1].safe == shot - 1
    assert_says(before[-1].cause, "emergency stop", "release it")
    assert_found_in_time(bench)
    assert not any(bench.board.state().leds)
    bench.board.press_estop(False)
    bench.engine.resume()
    assert_whole(bench, [*before, *bench.until(Finished)])


def test_a_person_who_stops_a_rig_that_has_stopped_itself_is_not_overruled(
    bench, shot: int
) -> None:
    def fall_silent_and_hold_the_button() -> None:
        bench.board.advance(LEASE_MS + 1)
        bench.board.press_button(True)
        bench.board.advance(LEASE_MS + 100)
        bench.board.press_button(False)

    strike_at(bench, shot, fall_silent_and_hold_the_button)
    bench.start()
    before = bench.until(Interrupted)
    assert [e.attempt for e in before if isinstance(e, ShotFailed)] == [1]
    assert before[-1].safe == shot - 1
    assert_says(before[-1].cause, "stopped, by its button", "then resume")
    assert bench.dark_after_ms <= LEASE_MS + LOOK_MS
    assert not any(bench.board.state().leds)
    bench.engine.resume()
    assert_whole(bench, [*before, *bench.until(Finished)])


def test_a_dead_led_is_named_and_its_shot_skipped(bench, shot: int) -> None:
    plan = bench.plan(SHOTS)
    bench.leds.dead = frozenset(plan[shot - 1].leds)
    strike_at(bench, shot)
    bench.start()
    events = bench.until(Finished)
    assert [e.attempt for e in events if isinstance(e, ShotFailed)] == [1, 2, 3]
    assert_found_in_time(bench)
    (skipped,) = [e for e in events if isinstance(e, ShotSkipped)]
    assert skipped.number == shot
    assert_says(skipped.cause, f"LED {plan[shot - 1].leds[0]} gives no light", "replace it")
    manifest = bench.session.manifest
    assert [s.index for s in manifest.skipped] == [shot - 1]
    assert len(manifest.used) == SHOTS - 1
    assert bench.engine.current.skipped == {shot: skipped.cause}


def test_a_full_disk_interrupts_and_loses_nothing(
    bench, shot: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = True

    def refuse(path: Path, content: bytes) -> None:
        if full and path.name == f"00{shot - 1}.png":
            bench.strike()
            raise SessionError(f"Cannot write {path}: the disk is full; free some space.")
        write(path, content)

    monkeypatch.setattr("turnlight.capture.durable.write", refuse)
    bench.start()
    before = bench.until(Interrupted)
    assert before[-1].safe == shot - 1
    assert_says(before[-1].cause, "the disk is full", "free some space")
    assert_found_in_time(bench)
    full = False
    bench.engine.resume()
    assert_whole(bench, [*before, *bench.until(Finished)])


def test_an_encoder_error_interrupts_and_the_maps_are_made_anew(bench, shot: int) -> None:
    class Failing(Estimator):
        left = shot

        def add(self, picture: Picture) -> Maps:
            Failing.left -= 1
            if Failing.left == 0:
                bench.strike()
                raise RuntimeError("out of memory")
            return super().add(picture)

    bench.new_estimator = Failing
    bench.start()
    before = bench.until(Interrupted)
    assert_says(before[-1].cause, "The network failed on shot", "out of memory", "resume")
    assert before[-1].safe >= shot
    assert_found_in_time(bench)
    bench.engine.resume()
    events = [*before, *bench.until(Finished)]
    assert_whole(bench, events, repeated=0)
    bench.assert_maps_are_those_of_the_frames()


def test_serial_noise_costs_no_shot(bench) -> None:
    """Noise may make a stop byte, which a person then resumes from."""
    with Line(bench.board.port, NOISE, seed=1) as line:
        bench.port = line.port
        bench.start()
        events: list[Event] = []
        while not (events and isinstance(events[-1], Finished)):
            events.append(bench.told.get(60))
            assert events[-1] is not None
            if isinstance(events[-1], Interrupted):
                bench.engine.resume()
        assert line.faults > 0
        failed = [e.number for e in events if isinstance(e, ShotFailed)]
        assert len(failed) == len(set(failed))
        assert_whole(bench, events, repeated=len(failed))
        bench.engine.close()


def test_an_unplugged_line_interrupts_and_resume_goes_on(bench, shot: int) -> None:
    capture = bench.camera.capture
    with Line(bench.board.port) as line:
        bench.port = line.port

        def unplug(exposure):
            frame = capture(exposure)
            if bench.camera.taken == shot + 1:
                bench.strike()
                line.unplug()
            return frame

        bench.camera.capture = unplug
        bench.start()
        before = bench.until(Interrupted)
    assert before[-1].safe == shot - 1
    assert_says(before[-1].cause, "has gone", "plug the controller in")
    bench.board.advance(LEASE_MS + 1)
    assert_found_in_time(bench)
    bench.port, bench.camera.capture = bench.board.port, capture
    bench.engine.resume()
    assert_whole(bench, [*before, *bench.until(Finished)])


class Line:
    """Relays bytes between `port`, which a link opens, and the port behind it, until unplugged.

    noise: share of bytes that are dropped or changed in one bit.
    """

    def __init__(self, target: str, noise: float = 0, seed: int = 0) -> None:
        self._noise, self._random = noise, random.Random(seed)
        self._outer, slave = pty.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        self._ends = [slave]
        self._inner = os.open(target, os.O_RDWR | os.O_NOCTTY)
        self._wake, self._waker = os.pipe()
        self.faults = 0
        self._thread = threading.Thread(target=self._relay)
        self._thread.start()

    def __enter__(self) -> "Line":
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()

    def unplug(self) -> None:
        if self._thread.is_alive():
            os.write(self._waker, b"x")
            self._thread.join()
            for end in (self._outer, self._inner, self._wake, self._waker, *self._ends):
                os.close(end)

    def _relay(self) -> None:
        other: dict[int, int] = {self._outer: self._inner, self._inner: self._outer}
        while True:
            ready, _, _ = select.select([*other, self._wake], [], [])
            if self._wake in ready:
                return
            for source in ready:
                os.write(other[source], self._worn(os.read(source, 256)))

    def _worn(self, data: bytes) -> bytes:
        worn = bytearray()
        for byte in data:
            if self._random.random() >= self._noise:
                worn.append(byte)
                continue
            self.faults += 1
            if self._random.random() < 0.5:
                worn.append(byte ^ 1 << self._random.randrange(8))
        return bytes(worn)
