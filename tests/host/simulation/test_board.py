"""The simulated board's side channel, and time."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from turnlight.errors import RigError
from turnlight.simulation.board import BoardClock, SimulatedBoard


@pytest.fixture
def board() -> Iterator[SimulatedBoard]:
    with SimulatedBoard() as board:
        yield board


def test_time_moves_only_when_told(board: SimulatedBoard) -> None:
    assert board.state().time_us == 0
    time.sleep(0.02)
    assert board.state().time_us == 0
    assert board.advance(12.345).time_us == 12345


def test_the_clock_sleeps_in_virtual_time(board: SimulatedBoard) -> None:
    clock = BoardClock(board)
    started_s = time.monotonic()
    clock.sleep(600)
    assert clock.now_s() == 600
    assert time.monotonic() - started_s < 60


def test_a_slip_turns_the_table(board: SimulatedBoard) -> None:
    before_deg = board.state().angle_deg
    assert board.slip(-1.5).angle_deg == before_deg - 1.5
    assert board.slip(360.0).angle_deg == before_deg - 1.5


def test_all_leds_are_dark_at_power_up(board: SimulatedBoard) -> None:
    assert board.state().leds == (0,) * 36


def test_what_the_side_channel_does_not_know_is_an_error(board: SimulatedBoard) -> None:
    for command in (
        "dance",
        "advance",
        "advance -1",
        "advance nan",
        "slip 1e9",
        "estop 2",
        "state 1",
    ):
        with pytest.raises(RigError, match="does not take"):
            board._command(command)
    assert board.state().time_us == 0


def test_the_program_ends_with_the_block() -> None:
    with SimulatedBoard() as board:
        process = board._process
        assert process.poll() is None
    assert process.poll() == 0
    with pytest.raises(RigError, match="has ended"):
        board.state()


def test_firmware_that_is_not_built_is_named(tmp_path: Path) -> None:
    with pytest.raises(RigError, match="run `make firmware`"):
        SimulatedBoard(tmp_path / "turnlight-native")
