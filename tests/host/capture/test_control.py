"""Wishes and listeners: a stronger wish wins, a late or slow listener gets the state."""

import threading

import pytest

from turnlight.capture.control import Control, Wish
from turnlight.capture.events import ShotSkipped, Snapshot, StateChanged, as_json
from turnlight.capture.hub import MOST_WAITING, Hub
from turnlight.capture.state import State
from turnlight.errors import RigError, RunError


@pytest.fixture
def running() -> Control:
    control = Control()
    control.start()
    control.enter(State.RUNNING)
    return control


def test_a_weaker_wish_does_not_undo_a_stronger(running: Control) -> None:
    running.ask("stop now", Wish.STOP_NOW)
    running.pause()
    running.resume()
    assert running.stopping_now
    with pytest.raises(RigError, match="The operator stopped the rig"), running.releasing():
        pass
    assert running.take_wish() is Wish.STOP_NOW
    assert running.take_wish() is None
    with running.releasing():
        pass


def test_a_pause_can_be_taken_back(running: Control) -> None:
    running.pause()
    assert running.state is State.PAUSING
    running.resume()
    assert (running.state, running.take_wish()) == (State.RUNNING, None)


def test_the_run_waits_for_a_wish_or_a_drop(running: Control) -> None:
    running.enter(State.PAUSED)
    threading.Timer(0.05, lambda: running.ask_for("drop", 3)).start()
    assert running.take_wish(wait=True) is None
    assert running.take_drops() == [3]
    threading.Timer(0.05, running.resume).start()
    assert running.take_wish(wait=True) is Wish.RESUME
    assert running.state is State.RUNNING


def test_what_a_state_does_not_allow_is_refused(running: Control) -> None:
    with pytest.raises(RunError, match="`start` can be asked for only when it is idle"):
        running.start()
    with pytest.raises(RunError, match="`dismiss` can be asked for only when it is faulted or"):
        running.dismiss()


def test_a_slow_listener_gets_a_snapshot_in_place_of_what_it_missed() -> None:
    hub = Hub()
    slow = hub.subscribe()
    for number in range(MOST_WAITING):
        hub.publish(ShotSkipped(number, "dark"))
    waiting = []
    while (event := slow.get(0)) is not None:
        waiting.append(event)
    assert isinstance(waiting[0], Snapshot)
    assert len(waiting) == 1
    assert len(waiting[0].skipped) == MOST_WAITING


def test_events_are_json_with_a_kind() -> None:
    assert as_json(StateChanged(State.PAUSED)) == {"kind": "state", "state": "paused"}
    assert as_json(Snapshot(State.IDLE))["folder"] is None
