"""The desk: one rig, one engine, one folder of sessions, and what may be asked of them by any hand."""

import functools
import itertools
import logging
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from turnlight import app
from turnlight.calibration import Calibration, StepName
from turnlight.capture.engine import Engine
from turnlight.capture.plan import Shot
from turnlight.capture.run import Job
from turnlight.capture.state import State
from turnlight.config import RigConfig
from turnlight.errors import RunError, TurnlightError
from turnlight.estimate.estimator import Estimator
from turnlight.standby import Standby
from turnlight.web.calibration import AtHand, Calibrator
from turnlight.web.images import Images
from turnlight.web.library import Library
from turnlight.web.looks import Light, lights
from turnlight.web.refining import Refiner
from turnlight.web.reports import Reports
from turnlight.web.sample import NextSample, remember, remembered

FIRST_LOOK_S = 1.5
SWITCH_S = 0.0005
"""For how long a request waits for the interpreter while a run, or a look at the rig, computes in it. Python's
own 5 ms come once for each file that a request looks at, and a list of sessions looks at thousands."""
_LOG = logging.getLogger(__name__)


@dataclass
class Desk:
    """What a service has. material: what lies on a simulated rig's table.

    Use as a context manager; the rig is let go of at the end, and a run is stopped. Raises ConfigError or
    SessionError.
    """

    rig_file: Path
    root: Path
    material: Path | None = None
    images: Images = field(default_factory=Images)

    def __post_init__(self) -> None:
        self.config = RigConfig.load(self.rig_file)
        self.library = Library(self.root)
        self.root = self.library.root
        self.reports = Reports(self.library, self.images)
        self.next = remembered(self.root, self.config)
        self.lights: tuple[Light, ...] = ()
        self._looking = threading.Lock()
        self._look_wanted = threading.Event()
        self._leaving = False
        self.estimator = functools.cache(Estimator)
        self.standby = Standby(*self._expected(), self._pressed)
        self.engine = Engine(self.standby.rig_for, self.estimator)
        self.calibrator = Calibrator(
            self.rig_file, self.config.geometry, self.standby.lend, self._calibrated
        )
        self.refiner = Refiner()
        self._starting = threading.Lock()
        self._first_look = threading.Thread(target=self._look_first, name="look", daemon=True)
        self._planner = ThreadPoolExecutor(1, "plan")
        self._planned = self._planner.submit(self._plan, self.next)

    def __enter__(self) -> "Desk":
        self._switch_s = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH_S)
        self.standby.start()
        self._first_look.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._leaving = True
        self._look_wanted.set()
        self.calibrator.close()
        self.engine.close()
        self._planner.shutdown(cancel_futures=True)
        self.standby.close()
        self._first_look.join()  # whoever is in C++ when Python ends aborts the program
        self.library.close()
        sys.setswitchinterval(self._switch_s)

    def set_next(self, sample: NextSample) -> None:
        """Remember what is captured next. Raises ConfigError or SessionError."""
        sample.preset_of(self.config)
        sample.config(self.config)
        remember(self.root, sample)
        self.next = sample
        self._prepare()

    def start(self) -> str:
        """Begin a run with the sample that was said last; the new session's name.

        Raises RunError when one is on, ConfigError.
        """
        planned = self._planned.result()
        manifest = planned.manifest.model_copy(update={"started": datetime.now(UTC)})
        folder = _free(self.root / app.default_folder(manifest.sample).name)
        self._run(Job(manifest, folder))
        return folder.name

    def plan(self) -> tuple[Shot, ...]:
        """The shots that the next run would take. Raises ConfigError."""
        return self._planned.result().manifest.plan

    def go_on(self, name: str, retake: Sequence[int], drop: Sequence[int], finish: bool) -> None:
        """Go on with a session. Raises SessionError or RunError."""
        if "start" not in self.engine.verbs:
            raise RunError("Another run is on; finish it first.")
        if self.refiner.busy_with(name):
            raise RunError("This session is being refined; wait until that is done.")
        self._run(app.old_job(self.library.folder(name), retake, drop, finish))

    def calibrate(self, step: StepName, at_hand: AtHand) -> None:
        """Measure this step, whose target is on the table. Raises RunError while the rig is at work."""
        with self._starting:
            if self.engine.current.state is not State.IDLE:
                raise RunError("A run is on; finish it first.")
            self.calibrator.start(step, at_hand)

    @property
    def at_work(self) -> bool:
        """Does a run or a calibration have the rig?"""
        return self.calibrator.running or self.engine.current.state is not State.IDLE

    def running(self, name: str) -> bool:
        """Is this the session that the engine works on?"""
        now = self.engine.current
        return now.state is not State.IDLE and now.folder == self.root / name

    def delete(self, name: str) -> None:
        """Raises RunError while it is being captured or refined, SessionError if there is none."""
        if self.running(name):
            raise RunError("This session is being captured; stop the run first.")
        if self.refiner.busy_with(name):
            raise RunError("This session is being refined; wait until that is done.")
        self.library.delete(name)

    def refine(self, name: str) -> None:
        """Raises RunError while a run is on or another session is refined, SessionError if there is none."""
        with self._starting:
            if self.engine.current.state is not State.IDLE:
                raise RunError("A run is on; refine when it is done.")
            self.refiner.start(self.library.folder(name))

    def look_soon(self) -> None:
        """Someone waits for the first look."""
        self._look_wanted.set()

    def look(self) -> tuple[Light, ...]:
        """Go through the lights anew unless the rig is at work; who comes meanwhile waits for that."""
        if not self.at_work:
            if self._looking.acquire(blocking=False):
                try:
                    self.lights = tuple(lights(self.standby, self.root, self.estimator))
                finally:
                    self._looking.release()
            else:
                with self._looking:
                    pass
        return self.lights

    def _run(self, job: Job) -> None:
        with self._starting:
            if self.calibrator.running:
                raise RunError(
                    "The rig is being calibrated; wait until the step is done, or stop it."
                )
            self.engine.start(job)

    def _calibrated(self) -> Calibration:
        """From now on by the new calibration."""
        self.config = RigConfig.load(self.rig_file)
        self._prepare()
        return self.config.geometry

    def _prepare(self) -> None:
        """Plan and rig for the next sample, before anyone asks."""
        self._planned = self._planner.submit(self._plan, self.next)
        self.standby.expect(*self._expected())

    def _plan(self, sample: NextSample) -> Job:
        return sample.job(self.config, self.material, self.root)

    def _look_first(self) -> None:
        """What takes long the first time, before anyone asks; but a page that is being opened goes first."""
        self._look_wanted.wait(FIRST_LOOK_S)
        if not self._leaving:
            self.look()
            self.library.read()

    def _pressed(self) -> None:
        try:
            self.start()
        except TurnlightError as error:
            _LOG.warning("The button was pressed, but: %s", error)

    def _expected(self) -> tuple[RigConfig, app.Sample]:
        return self.next.config(self.config), self.next.sample(self.material)


def _free(folder: Path) -> Path:
    """The folder, or one of that name with a number behind it where a run has begun in the same second."""
    names = (folder.with_name(f"{folder.name}-{number}") for number in itertools.count(2))
    return next(path for path in itertools.chain([folder], names) if not path.exists())
