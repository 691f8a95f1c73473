"""The reference rig with a small sensor, so that a whole capture takes seconds, and its faults."""

import contextlib
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from svbrdf import materials, procedural
from turnlight import app
from turnlight.capture.develop import Developer
from turnlight.capture.engine import Engine
from turnlight.capture.events import Event, Faulted, Interrupted, ShotFailed
from turnlight.capture.manifest import Manifest
from turnlight.capture.plan import Shot, plan
from turnlight.capture.session import Session
from turnlight.capture.state import State
from turnlight.config import RigConfig
from turnlight.estimate.estimator import Estimator
from turnlight.preset import Preset
from turnlight.rig.rig import Rig
from turnlight.simulation.board import BoardState, SimulatedBoard, simulated_board
from turnlight.simulation.camera import SimulatedCamera
from turnlight.simulation.faults import DeadLeds, FaultyCamera

REPOSITORY = Path(__file__).parents[2]
THICKNESS_MM = 2.0
LOOK_MS = 20.0
"""Of virtual time, after which it is looked again whether an LED is lit."""
PLAIN = Preset(shots=3, exposure="fixed", enough_change=0)


@pytest.fixture(params=["simulated", "simulated:atmega2560"])
def port(request: pytest.FixtureRequest) -> str:
    """The native firmware, and the one for the reference board on a simulated chip."""
    port: str = request.param
    return port


@pytest.fixture
def small_rig(tmp_path: Path, port: str) -> Path:
    return rig_file(tmp_path / "small.toml", 1014, 760, port)


def rig_file(path: Path, width_px: int, height_px: int, port: str = "simulated") -> Path:
    text = (REPOSITORY / "rig_config/simulated.toml").read_text()
    text = text.replace('port = "simulated"', f'port = "{port}"')
    for key, value in (("width_px", width_px), ("height_px", height_px)):
        text = re.sub(rf"^{key} = \d+$", f"{key} = {value}", text, flags=re.MULTILINE)
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def small_rig_file() -> Callable[[Path], Path]:
    return lambda path: rig_file(path, 676, 507)


@pytest.fixture
def same_maps() -> Callable[[Path], None]:
    return assert_maps_are_those_of_the_frames


def assert_maps_are_those_of_the_frames(folder: Path) -> None:
    """Bit for bit what an estimator makes of the saved frames, in an order of its own."""
    session, estimator = Session.open(folder), Estimator()
    developer = Developer(session)
    for saved in reversed(list(session.saved())):
        maps = estimator.add(developer.develop(saved).picture)
    for name, png in materials.encode(maps).items():
        assert png == (folder / f"maps/{name}.png").read_bytes(), name


class Bench:
    """A simulated rig that outlives its connections, the engine that drives it, and its faults."""

    def __init__(self, config: RigConfig, folder: Path, board: SimulatedBoard) -> None:
        self.config = config
        self.folder = folder
        self.board = board
        self.port = board.port
        self.leds = DeadLeds(board)
        material = procedural.material(app.SIMULATED_SEED, 256)
        optics = SimulatedCamera(config, material, THICKNESS_MM, self.leds, 0)
        self.camera = FaultyCamera(optics, board)
        self.new_estimator: Callable[[], Estimator] = Estimator
        self.engine = Engine(self._rig, self._estimator)
        self.struck_s: float | None = None
        self.found_after_s: float | None = None
        self._dark_us: int | None = None
        self._struck_us = 0
        self._advance = board.advance
        board.advance = self._advance_and_look  # type: ignore[method-assign]
        self._watch = self.engine.subscribe(self._note_what_is_found)
        self.told = self.engine.subscribe()  # after it: who waits for an event finds it noted

    def start(self, preset: Preset = PLAIN) -> None:
        sample = app.Sample("oak", THICKNESS_MM)
        self.engine.start(app.new_job(self.config, sample, preset, self.folder))

    def strike(self) -> None:
        """A fault happens now."""
        if self.struck_s is None:
            self._struck_us = self.board.state().time_us
            self.struck_s = self._now_s()
            self._look_for_light(self.board.state())

    def _note_what_is_found(self) -> None:
        while (event := self._watch.get(0)) is not None:
            found = isinstance(event, ShotFailed | Interrupted)
            if found and self.struck_s is not None and self.found_after_s is None:
                self.found_after_s = self._now_s() - self.struck_s

    @property
    def dark_after_ms(self) -> float:
        """Virtual time from the fault until no LED was lit."""
        self._look_for_light(self.board.state())
        assert self._dark_us is not None, "an LED is lit"
        return (self._dark_us - self._struck_us) / 1000

    def _advance_and_look(self, ms: float) -> BoardState:
        while ms > LOOK_MS:
            self._look_for_light(self._advance(LOOK_MS))
            ms -= LOOK_MS
        state = self._advance(ms)
        self._look_for_light(state)
        return state

    def _look_for_light(self, state: BoardState) -> None:
        if self.struck_s is not None and self._dark_us is None and not any(state.leds):
            self._dark_us = state.time_us

    def _now_s(self) -> float:
        """On the rig, and the work of this program: a busy machine does not count."""
        return self.board.state().time_us / 1e6 + time.process_time()

    def until(self, kind: type | State, timeout_s: float = 60) -> list[Event]:
        """The events up to and with the first of this kind, or the entering of this state."""
        seen: list[Event] = []
        while (event := self.told.get(timeout_s)) is not None:
            seen.append(event)
            if event == kind or getattr(event, "state", None) is kind or type(event) is kind:
                return seen
            assert not isinstance(event, Faulted) or kind is State.FAULTED, event
        raise AssertionError(f"no {kind} after {seen[-5:]}")

    def plan(self, shots: int) -> tuple[Shot, ...]:
        return plan(self.config, shots, THICKNESS_MM)

    def assert_maps_are_those_of_the_frames(self) -> None:
        assert_maps_are_those_of_the_frames(self.folder)

    @property
    def session(self) -> Session:
        return Session.open(self.folder)

    def _estimator(self) -> Estimator:
        return self.new_estimator()

    @contextlib.contextmanager
    def _rig(self, _: Manifest) -> Iterator[Rig]:
        controller = self.config.controller.model_copy(update={"port": self.port})
        with app.connect(self.config.model_copy(update={"controller": controller})) as connection:
            clock = app.BoardClock(self.board)
            connection.controller._clock = clock
            yield Rig(self.config, connection.controller, self.camera, clock)


@pytest.fixture
def bench(tmp_path: Path, port: str) -> Iterator[Bench]:
    config = RigConfig.load(rig_file(tmp_path / "rig.toml", 676, 507, port))
    board = simulated_board(config.controller)
    assert board is not None
    with board:
        bench = Bench(config, tmp_path / "session", board)
        yield bench
        bench.engine.close()
