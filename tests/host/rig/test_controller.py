"""The controller's typed methods against the real firmware in virtual time."""

import time
from collections.abc import Iterator

import pytest

from turnlight.errors import LinkError, RigError
from turnlight.rig.controller import Controller
from turnlight.rig.link import SerialLink
from turnlight.simulation.board import BoardClock, SimulatedBoard


@pytest.fixture
def controller(board: SimulatedBoard) -> Iterator[Controller]:
    controller = Controller(SerialLink(board.port, 250000), BoardClock(board))
    controller.hello()
    yield controller
    controller.close()


def test_hello_says_who_it_is(controller: Controller) -> None:
    hello = controller.hello()
    assert (hello.protocol, hello.board, hello.reset_cause) == (2, "native", "power")
    assert hello.led_count == 36
    assert len(hello.boot_id) == 8
    assert controller.hello() == hello


def test_a_move_ends_at_the_angle_asked(controller: Controller, board: SimulatedBoard) -> None:
    controller.home()
    for angle_deg in (90.0, 0.0, -45.0, 359.99, 720.5):
        controller.move(angle_deg)
        error_deg = (board.state().angle_deg - angle_deg + 180) % 360 - 180
        assert abs(error_deg) < 0.02
        assert not controller.status().moving


def test_a_quarter_turn_takes_no_real_time(
    controller: Controller, board: SimulatedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    controller.home()
    virtual_us = board.state().time_us
    monkeypatch.delattr(time, "sleep")
    controller.move(90.0)
    assert board.state().time_us - virtual_us > 500_000


def test_a_motion_that_nobody_waited_for_ends_before_the_homing(
    controller: Controller, board: SimulatedBoard
) -> None:
    controller.home()
    controller._ask("move", 18000)
    controller.home()
    assert controller.status().state == "ready"
    assert board.state().angle_deg == 0


def test_who_looks_away_while_the_table_homes_ends_the_waiting(
    controller: Controller, board: SimulatedBoard
) -> None:
    def look_away() -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        controller.home(look_away)
    assert controller.status().moving
    controller.home()
    assert controller.status().state == "ready"


def test_lights_are_the_ones_asked_and_no_others(
    controller: Controller, board: SimulatedBoard
) -> None:
    controller.light([3, 35])
    assert controller.status().leds == (3, 35)
    controller.light([4])
    assert [led for led, level in enumerate(board.state().leds) if level] == [4]
    assert board.state().leds[4] == 255
    controller.off()
    assert not any(board.state().leds)


def test_a_strobe_tells_what_was_so_as_it_fired(
    controller: Controller, board: SimulatedBoard
) -> None:
    controller.home()
    controller.move(30)
    controller.light([7, 8])
    strobe = controller.trigger(0)
    assert (strobe.shot_id, strobe.leds) == (0, (7, 8))
    assert strobe.angle_deg == pytest.approx(30, abs=0.02)
    assert 0 <= board.state().time_us - strobe.time_us < 10_000
    with pytest.raises(RigError, match="has been fired before; use a new shot number"):
        controller.trigger(0)
    assert board.state().strobes == 1


def test_lost_steps_show_when_the_mark_is_checked(
    controller: Controller, board: SimulatedBoard
) -> None:
    controller.home()
    controller.move(90)
    assert controller.check() == 0
    controller.move(90)
    board.slip(-2.7)
    assert controller.status().angle_deg == 90
    assert controller.check() == 120
    assert board.state().angle_deg == 0


def test_parameters_are_set_and_kept(controller: Controller, board: SimulatedBoard) -> None:
    before = controller.parameter("microsteps")
    assert (before.value, before.lowest, before.highest, before.default) == (16, 1, 256, 16)
    assert controller.set_parameter("microsteps", 8).value == 8
    with pytest.raises(RigError, match="does not fit its other parameters"):
        controller.set_parameter("microsteps", 256)
    with pytest.raises(RigError, match="no parameter of this name"):
        controller.parameter("colour")
    assert controller.hello().parameters == "kept"


def test_one_led_is_dimmed_alone(controller: Controller, board: SimulatedBoard) -> None:
    assert controller.light([3, 35]) == 0.007  # the supply has to rise
    assert controller.dim(4, 10) == 0.002
    assert controller.status().leds == (3, 4, 35)
    assert board.state().leds[4] == 10


def test_beats_keep_the_lights_on(controller: Controller, board: SimulatedBoard) -> None:
    controller.light([0])
    for _ in range(5):
        board.advance(800)
        controller.beat()
    assert board.state().leds[0] == 255
    board.advance(1100)
    assert controller.status().state == "lease"
    controller.off()  # says nothing: they are off
    with pytest.raises(RigError, match="this computer fell silent"):
        controller.light([0])


def test_a_stop_holds_until_cleared(controller: Controller) -> None:
    controller.home()
    controller.stop()
    with pytest.raises(RigError, match="The rig was stopped"):
        controller.move(10)
    controller.clear()
    controller.move(10)


def test_an_emergency_stop_in_a_move_is_named(
    controller: Controller, board: SimulatedBoard
) -> None:
    controller.home()
    board.press_estop(True)
    with pytest.raises(RigError, match="emergency stop is or was pressed"):
        controller.move(180)
    with pytest.raises(RigError, match="emergency stop"):
        controller.clear()
    board.press_estop(False)
    controller.clear()
    with pytest.raises(RigError, match="home the table first"):
        controller.move(180)


def test_a_blind_index_sensor_is_named(controller: Controller, board: SimulatedBoard) -> None:
    board.hide_mark(True)
    with pytest.raises(RigError, match="check the index sensor"):
        controller.home()
    board.hide_mark(False)
    controller.clear()
    controller.home()


def test_clearing_waits_until_a_braking_table_rests(
    controller: Controller, board: SimulatedBoard
) -> None:
    controller.home()
    controller._link.request("move", 17000)
    for _ in range(3):
        board.advance(100)
        controller.beat()
    while controller.status().moving:
        board.advance(990)
        board.advance(15)
    controller.clear()
    assert controller.status().homed


def test_a_restart_is_noticed(controller: Controller, board: SimulatedBoard) -> None:
    controller.home()
    board.reset()
    with pytest.raises(RigError, match="restarted and has lost the table's angle"):
        controller.move(10)
    assert controller.hello().reset_cause == "watchdog"
    controller.home()
    controller.move(10)


def test_button_presses_are_told_once(controller: Controller, board: SimulatedBoard) -> None:
    board.press_button(True)
    board.advance(50)
    board.press_button(False)
    board.advance(50)
    deadline_s = time.monotonic() + 20
    events = controller.take_events()
    while not events and time.monotonic() < deadline_s:
        events = controller.take_events()
    assert [event.kind for event in events] == ["button"]
    controller.beat()
    assert controller.take_events() == []


def test_closing_turns_the_lights_off(board: SimulatedBoard) -> None:
    controller = Controller(SerialLink(board.port, 250000), BoardClock(board))
    controller.light([1])
    controller.close()
    assert not any(board.state().leds)
    with pytest.raises(LinkError):
        controller.light([1])


def test_another_protocol_is_refused(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("turnlight.rig.controller.PROTOCOL", 3)
    with pytest.raises(
        RigError, match="speaks protocol 2 and this program 3; run turnlight firmware"
    ):
        controller.hello()
