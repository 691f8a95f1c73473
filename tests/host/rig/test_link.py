"""The serial link against the real firmware, on a good line."""

import os
import pty
import termios
import threading
import time
from collections.abc import Iterator

import pytest

from turnlight.errors import LinkError
from turnlight.rig.line import Event
from turnlight.rig.link import RefusedError, SerialLink
from turnlight.simulation.board import SimulatedBoard


@pytest.fixture
def link(board: SimulatedBoard) -> Iterator[SerialLink]:
    link = SerialLink(board.port, 250000)
    yield link
    link.close()


def test_a_command_is_answered_with_its_fields(link: SerialLink, board: SimulatedBoard) -> None:
    assert link.request("led", 255, "800000001")["lit"] == "800000001"
    assert [led for led, level in enumerate(board.state().leds) if level] == [0, 35]


def test_a_refusal_carries_its_word(link: SerialLink) -> None:
    with pytest.raises(RefusedError, match="refused `move`") as refused:
        link.request("move", 9000)
    assert refused.value.word == "home"


def test_the_stop_byte_latches_a_fault(link: SerialLink, board: SimulatedBoard) -> None:
    link.request("led", 255, "1")
    link.stop_now()
    assert link.request("stat")["is"] == "stop"
    assert not any(board.state().leds)
    link.request("clear")
    assert link.request("stat")["is"] == "unhomed"


def test_a_silent_host_loses_its_lights(link: SerialLink, board: SimulatedBoard) -> None:
    link.request("led", 255, "1")
    assert board.advance(900).leds[0] == 255
    link.request("beat")
    assert board.advance(900).leds[0] == 255
    assert board.advance(200).leds[0] == 0
    assert link.request("stat")["is"] == "lease"


def test_events_come_once_and_are_acknowledged(link: SerialLink, board: SimulatedBoard) -> None:
    link.request("hello")
    board.press_button(True)
    board.advance(400)
    board.press_button(False)
    board.advance(400)
    assert [event.kind for event in _events(link, 2)] == ["boot", "button"]
    for _ in range(4):
        link.request("beat")
        board.advance(400)
    assert _events(link, 0) == []


def test_sequence_numbers_go_around(link: SerialLink) -> None:
    link._sequence = 65534
    for _ in range(3):
        link.request("beat")
    assert 0 < link._sequence < 10


def test_requests_from_several_threads_do_not_mix(link: SerialLink) -> None:
    def fire(ids: range) -> None:
        for level in ids:
            assert link.request("led", 1, f"{level:X}")["lit"] == f"{level:09X}"

    threads = [threading.Thread(target=fire, args=(range(n, 60, 3),)) for n in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert int(link.request("stat", "all")["done"]) == 61 + len(link.take_events())


def test_closing_leaves_dtr_alone(link: SerialLink, board: SimulatedBoard) -> None:
    descriptor = os.open(board.port, os.O_RDWR | os.O_NOCTTY)
    assert not termios.tcgetattr(descriptor)[2] & termios.HUPCL
    os.close(descriptor)


def test_a_link_may_be_closed_twice_and_the_port_opened_again(board: SimulatedBoard) -> None:
    for _ in range(2):
        link = SerialLink(board.port, 250000)
        link.request("hello")
        link.close()
        link.close()


def test_a_stop_from_another_thread_may_come_as_the_port_is_closed(board: SimulatedBoard) -> None:
    for _ in range(20):
        link = SerialLink(board.port, 250000)
        stopped: list[Exception] = []
        stopping = threading.Thread(target=_stop_until_closed, args=(link, stopped))
        stopping.start()
        time.sleep(0.005)
        link.close()
        stopping.join()
        assert [type(error) for error in stopped] == [LinkError]


def _stop_until_closed(link: SerialLink, stopped: list[Exception]) -> None:
    try:
        while True:
            link.stop_now()
    except Exception as error:
        stopped.append(error)


def test_a_port_that_is_not_there_is_named() -> None:
    with pytest.raises(LinkError, match="The serial port /dev/ttyNONE is not there; plug"):
        SerialLink("/dev/ttyNONE", 250000)


def test_a_port_in_use_is_named(link: SerialLink, board: SimulatedBoard) -> None:
    with pytest.raises(LinkError, match="is in use; close the other program"):
        SerialLink(board.port, 250000)


def test_a_file_is_no_serial_port() -> None:
    with pytest.raises(LinkError, match="cannot be used as a serial port"):
        SerialLink(__file__, 250000)


def test_a_controller_that_does_not_answer_is_named() -> None:
    master, slave = pty.openpty()
    link = SerialLink(os.ttyname(slave), 250000, retry_after_s=0.02, give_up_after_s=0.1)
    with pytest.raises(LinkError, match="does not answer; check its power"):
        link.request("hello")
    link.close()
    os.close(master)
    os.close(slave)


def test_an_unplugged_controller_is_named(board: SimulatedBoard, link: SerialLink) -> None:
    link.request("hello")
    board.close()
    started_s = time.monotonic()
    with pytest.raises(LinkError, match="has gone; plug the controller in again"):
        link.request("beat")
    with pytest.raises(LinkError, match="has gone"):
        link.request("beat")
    assert time.monotonic() - started_s < 3  # after which a silent one would be given up


def _events(link: SerialLink, count: int) -> list[Event]:
    """Events travel by the reader thread: wait for as many as are due."""
    events = link.take_events()
    deadline_s = time.monotonic() + 20
    while len(events) < count and time.monotonic() < deadline_s:
        time.sleep(0.005)
        events += link.take_events()
    return events
