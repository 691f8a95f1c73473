"""A run in a process of its own, for test_kill to kill: `killable_run.py FOLDER RIG SHOTS STATE`.

Prints a line per event, brings the run into STATE when its first shot is saved, and ends with it.
"""

import contextlib
import sys
from pathlib import Path

from turnlight import app
from turnlight.capture.engine import Engine
from turnlight.capture.events import ShotStep, StateChanged
from turnlight.capture.state import State, Step
from turnlight.config import RigConfig
from turnlight.errors import RunError
from turnlight.preset import Preset


def main(folder: Path, rig: Path, shots: int, wanted: State) -> None:
    app.SIMULATED_RESOLUTION = 256
    engine = app.new_engine()
    told = engine.subscribe()
    if (folder / "session.json").exists():
        engine.start(app.old_job(folder))
    else:
        preset = Preset(shots=shots, exposure="fixed", enough_change=0)
        sample = app.Sample("oak", 2.0)
        engine.start(app.new_job(RigConfig.load(rig), sample, preset, folder))
    for event in told:
        if isinstance(event, StateChanged):
            print("state", event.state, flush=True)
            if event.state is State.IDLE and wanted is not State.IDLE:
                return
        if isinstance(event, ShotStep):
            print(event.step, event.number, flush=True)
            if event.step is not Step.SAVED:
                continue
            with contextlib.suppress(RunError):  # it may be past that by now
                steer(engine, wanted)


def steer(engine: Engine, wanted: State) -> None:
    match wanted:
        case State.PAUSING | State.PAUSED:
            engine.pause()
        case State.INTERRUPTED:
            engine.stop_now()
        case State.FINISHING | State.IDLE:
            engine.stop()
        case State.FAULTED:
            engine._run.rig.camera.capture = None


main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), State(sys.argv[4]))
