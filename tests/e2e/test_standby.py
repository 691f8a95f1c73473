"""The service: the rig's button starts a capture, and systemd is told all the while."""

import itertools
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from turnlight import app, standby
from turnlight.capture.events import Finished
from turnlight.config import RigConfig
from turnlight.preset import Preset
from turnlight.simulation.board import SimulatedBoard


@pytest.fixture
def heard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """What systemd has been told."""
    address = str(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", address)
    messages: list[str] = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(address)

        def listen() -> None:
            while message := systemd.recv(1000):
                messages.append(message.decode())

        listener = threading.Thread(target=listen)
        listener.start()
        yield messages
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
            end.sendto(b"", address)
        listener.join()


@pytest.fixture
def boards(monkeypatch: pytest.MonkeyPatch) -> list[SimulatedBoard]:
    """Every board that is switched on, the latest last."""
    switched_on: list[SimulatedBoard] = []

    class Remembered(SimulatedBoard):
        def __init__(self) -> None:
            super().__init__()
            switched_on.append(self)

    monkeypatch.setattr(app, "SimulatedBoard", Remembered)
    return switched_on


def test_the_button_starts_a_capture(
    small_rig: Path,
    tmp_path: Path,
    heard: list[str],
    boards: list[SimulatedBoard],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    config = RigConfig.load(small_rig)
    quick = Preset(shots=1, exposure="fixed")
    config = config.model_copy(update={"preset": {"quick": quick}})
    polls = 0

    def press_at_the_third_poll(_: float) -> None:
        nonlocal polls
        polls += 1
        boards[-1].advance(100)
        if polls in (3, 5):
            boards[-1].press_button(polls == 3)

    clock = SimpleNamespace(sleep=press_at_the_third_poll, monotonic=time.monotonic)
    monkeypatch.setattr(standby, "time", clock)
    told = standby.stand_by(config, tmp_path / "sessions")
    assert (
        next(told) == f"Press the button on the rig simulated to capture into {tmp_path}/sessions."
    )
    events = list(itertools.takewhile(lambda event: not isinstance(event, str), told))
    (finished,) = (event for event in events if isinstance(event, Finished))
    assert finished.folder.parent == tmp_path / "sessions"
    assert (finished.folder / "maps/normal.png").exists()
    assert heard[0] == "READY=1"
    assert heard.count("WATCHDOG=1") > polls + 5
    assert f"STATUS=Capturing into {finished.folder}." in heard
    told.close()


def test_a_rig_that_is_not_there_is_waited_for(
    small_rig: Path, tmp_path: Path, heard: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = RigConfig.load(small_rig)
    gone = config.controller.model_copy(update={"port": "/dev/ttyNOTHERE"})
    monkeypatch.setattr(standby, "_TRY_AGAIN_S", 0.05)
    told = standby.stand_by(config.model_copy(update={"controller": gone}), tmp_path)
    for _ in range(2):
        assert str(next(told)).startswith("Press the button")
        assert "/dev/ttyNOTHERE" in str(next(told))
    told.close()
    assert "WATCHDOG=1" in heard
