"""What a session costs beside its motion and exposure, and what it keeps in memory: `make bench`."""

import contextlib
import os
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Self

import pytest

from svbrdf import procedural
from svbrdf.maps import Maps, flat
from turnlight import app
from turnlight.capture.engine import Engine
from turnlight.capture.events import Event, Finished, ShotDone, ShotStep
from turnlight.capture.manifest import Manifest
from turnlight.capture.state import Step
from turnlight.config import RigConfig
from turnlight.estimate.estimator import Estimator
from turnlight.frame import Exposure, Frame
from turnlight.picture.picture import Picture
from turnlight.preset import Preset
from turnlight.rig.clock import Clock, WallClock
from turnlight.rig.rig import Rig
from turnlight.simulation.board import SimulatedBoard
from turnlight.simulation.camera import SimulatedCamera

RIG = Path(__file__).parents[2] / "rig_config/simulated.toml"
THICKNESS_MM = 2.0
SHOTS = 24
MANY = 200
COLUMNS = 100
MIB = 1 << 20
TICK_S = 0.005
MOST = 1.1
"""That a session may take, times its motion and exposure."""


class LiveBoard:
    """A simulated board whose time is this computer's, so that its table turns while the host works."""

    def __init__(self, board: SimulatedBoard) -> None:
        self._board = board
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._live)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def state(self):
        return self._board.state()

    def advance(self, ms: float):
        time.sleep(ms / 1000)
        return self._board.state()

    def _live(self) -> None:
        here_s = time.monotonic()
        while not self._end.wait(TICK_S):
            now_s = time.monotonic()
            self._board.advance((now_s - here_s) * 1000)
            here_s = now_s


class TakenBefore:
    """A camera that has its frames ready, since rendering them is no part of a session."""

    description = "frames taken before"

    def __init__(self, config: RigConfig, board) -> None:
        self._board = board
        camera = SimulatedCamera(
            config, procedural.material(app.SIMULATED_SEED, 512), THICKNESS_MM, self, 0
        )
        self._lit, exposure = True, Exposure(config.camera.exposure_us, config.camera.gain)
        self._frames = [camera.capture(exposure) for _ in range(2)]
        self._lit = False
        self._dark = camera.capture(exposure)
        self._taken = 0

    def state(self):
        leds = tuple(255 * (self._lit and n == 3) for n in range(36))
        return replace(self._board.state(), leds=leds, angle_deg=0.0)

    def advance(self, _: float):
        return self.state()

    def capture(self, exposure: Exposure) -> Frame:
        state = self._board.state()
        self._board.advance(exposure.exposure_us / 1000)
        self._taken += 1
        frame = self._frames[self._taken % 2] if any(state.leds) else self._dark
        return replace(frame, exposure=exposure, started_us=state.time_us)

    def recover(self) -> None: ...

    def close(self) -> None: ...


class NoEstimator:
    """For runs of which only the motion matters."""

    def reset(self) -> None: ...

    def add(self, _: Picture) -> Maps:
        return flat(8, 8)


@contextlib.contextmanager
def engine_on(
    config: RigConfig, camera, board: SimulatedBoard, clock: Clock, estimator
) -> Iterator[Engine]:
    controller = config.controller.model_copy(update={"port": board.port})

    @contextlib.contextmanager
    def rig(_: Manifest) -> Iterator[Rig]:
        with app.connect(config.model_copy(update={"controller": controller})) as connection:
            connection.controller._clock = clock
            yield Rig(config, connection.controller, camera, clock)

    with contextlib.closing(Engine(rig, estimator)) as engine:
        yield engine


def follow(engine: Engine, config: RigConfig, shots: int, folder: Path) -> Iterator[Event]:
    told = engine.subscribe()
    preset = Preset(shots=shots, exposure="fixed", enough_change=0)
    engine.start(app.new_job(config, app.Sample("bench", THICKNESS_MM), preset, folder))
    for event in told:
        yield event
        if isinstance(event, Finished):
            return


def motion_and_exposure_s(folder: Path) -> float:
    """What the table, the LEDs and the shutter take: the same run where the host's work takes no time."""
    config = sized(RigConfig.load(RIG), 676, 507)
    with SimulatedBoard() as board:
        camera, clock = TakenBefore(config, board), app.BoardClock(board)
        with engine_on(config, camera, board, clock, NoEstimator) as engine:
            began_us = board.state().time_us
            list(follow(engine, config, SHOTS, folder))
            return (board.state().time_us - began_us) / 1e6


def sized(config: RigConfig, width_px: int, height_px: int) -> RigConfig:
    camera = config.camera.model_copy(update={"width_px": width_px, "height_px": height_px})
    return config.model_copy(update={"camera": camera})


@pytest.mark.bench
@pytest.mark.timeout(600)
def test_a_session_beside_its_motion_and_exposure(tmp_path: Path) -> None:
    moved_s = motion_and_exposure_s(tmp_path / "moved")
    config, estimator = RigConfig.load(RIG), Estimator()
    with SimulatedBoard() as board, LiveBoard(board) as live:
        camera = TakenBefore(config, live)
        with engine_on(config, camera, board, WallClock(), lambda: estimator) as engine:
            began_s, work_s = time.monotonic(), time.process_time()
            events = list(follow(engine, config, SHOTS, tmp_path / "session"))
            took_s, work_s = time.monotonic() - began_s, time.process_time() - work_s
    steps = [event for event in events if isinstance(event, ShotStep)]
    width, height = config.camera.width_px, config.camera.height_px
    print(
        f"\n{SHOTS} shots of {width}x{height}; m: table moves, x: lit and exposed, s: saved, e: encoded"
    )
    print("\n".join(timeline(steps)))
    print(
        f"session {took_s:.1f} s, motion and exposure {moved_s:.1f} s: {took_s / moved_s:.2f} x "
        f"(the host's work {work_s:.1f} s of a processor; load of this machine "
        f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores)"
    )
    assert took_s <= MOST * moved_s


def timeline(steps: list[ShotStep]) -> list[str]:
    """A row per shot, from its planning to its encoding, in seconds since the first."""
    first_s, last_s = steps[0].at_s, steps[-1].at_s
    column = lambda at_s: round((at_s - first_s) / (last_s - first_s) * (COLUMNS - 1))  # noqa: E731
    spans = [
        (Step.PLANNED, Step.SETTLED, "m"),
        (Step.SETTLED, Step.VERIFIED, "x"),
        (Step.VERIFIED, Step.SAVED, "s"),
        (Step.SAVED, Step.ENCODED, "e"),
    ]
    rows = []
    for number in sorted({step.number for step in steps}):
        at_s = {step.step: step.at_s for step in steps if step.number == number}
        row = [" "] * COLUMNS
        for start, end, letter in spans:
            for place in range(column(at_s[start]), column(at_s[end]) + 1):
                row[place] = letter
        rows.append(f"{number:4} |{''.join(row)}|")
    return rows


@pytest.mark.bench
@pytest.mark.timeout(1200)
def test_memory_over_two_hundred_shots(tmp_path: Path) -> None:
    config = sized(RigConfig.load(RIG), 676, 507)
    resident: list[int] = []
    with SimulatedBoard() as board:
        camera, clock = TakenBefore(config, board), app.BoardClock(board)
        with engine_on(config, camera, board, clock, Estimator) as engine:
            for event in follow(engine, config, MANY, tmp_path / "session"):
                if isinstance(event, ShotDone):
                    resident.append(resident_bytes())
    tenth = resident[MANY // 10 - 1]
    print(f"\nresident after {MANY // 10} shots {tenth / MIB:.0f} MiB, after {MANY} shots")
    print(f"{resident[-1] / MIB:.0f} MiB: {resident[-1] / tenth:.2f} x")
    assert resident[-1] < 1.1 * tenth


def resident_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
