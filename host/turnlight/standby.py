"""A rig without a terminal: the button on it starts a capture. What the service runs."""

import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from svbrdf.materials import MaterialError
from turnlight import app
from turnlight.capture.events import Event
from turnlight.config import RigConfig
from turnlight.errors import TurnlightError
from turnlight.notify import ALIVE, READY, notify

_POLL_S = 0.2
_TRY_AGAIN_S = 5.0


def stand_by(config: RigConfig, root: Path) -> Iterator[Event | str]:
    """Capture a sample into a new folder under `root` at each press of the rig's button, for ever.

    Gives the captures' events, and a sentence for whatever happens in between. systemd is told that we
    are alive at each poll and each event, so a program that hangs is started again.
    """
    notify(READY)
    while True:
        try:
            yield _tell(f"Press the button on the rig {config.name} to capture into {root}.")
            _await_button(config)
            sample = app.Sample("sample", config.sample.reference_thickness_mm)
            folder = root / f"sample-{datetime.now():%Y%m%d-%H%M%S}"
            _tell(f"Capturing into {folder}.")
            for event in app.capture(config, sample, config.preset_named(None), folder):
                notify(ALIVE)
                yield event
        except (TurnlightError, MaterialError) as error:
            yield _tell(str(error))
            _rest()


def _await_button(config: RigConfig) -> None:
    with app.connect(config) as connection:
        while True:
            notify(ALIVE)
            connection.controller.beat()
            if any(event.kind == "button" for event in connection.controller.take_events()):
                return
            time.sleep(_POLL_S)


def _rest() -> None:
    until_s = time.monotonic() + _TRY_AGAIN_S
    while time.monotonic() < until_s:
        notify(ALIVE)
        time.sleep(_POLL_S)


def _tell(sentence: str) -> str:
    notify(f"STATUS={sentence}")
    return sentence
