"""A host that dies at any moment of a homing, a move or an exposure: the rig looks after itself."""

import random

import pytest
from terminal import Terminal, seal

from turnlight.simulation.board import SimulatedBoard

_MOMENTS = {"native": 200, "atmega2560": 200, "atmega328p": 40}
_LIMIT_MS = 1500


@pytest.mark.timeout(300)
def test_lights_and_motor_are_off_soon_after_the_host_dies(
    backend: str, board: SimulatedBoard
) -> None:
    moments = _MOMENTS[backend]
    chance = random.Random(3)
    lit = turning = 0
    with Terminal(board) as terminal:
        for _ in range(moments):
            _live(terminal, chance)
            steps, leds = board.state().steps, board.state().leds
            lit += any(leds)
            turning += board.advance(1).steps > steps
            after = board.advance(_LIMIT_MS - 1)
            assert not any(after.leds)
            assert board.advance(100).steps == after.steps
            terminal.say("?")  # ends what was begun
            terminal.ask("clear")
    assert lit > moments / 3
    assert turning > moments / 3


def _live(terminal: Terminal, chance: random.Random) -> None:
    """Some of a capture, cut off anywhere, even inside a line."""
    board = terminal.board
    terminal.ask("hello")
    if terminal.state() == "unhomed":
        terminal.ask("home")
    if chance.random() < 0.9:
        terminal.settle()
    if chance.random() < 0.7:
        terminal.ask(f"led 255 {chance.randrange(1, 1 << 36):X}")
    if chance.random() < 0.7:
        terminal.ask(f"move {chance.randrange(36000)}")
    if chance.random() < 0.4:
        terminal.ask("trig 1")
    for _ in range(chance.randrange(4)):
        board.advance(chance.uniform(0, 300))
        terminal.ask("beat")
    board.advance(chance.uniform(0, 500))
    unfinished = seal("1 move 9000")
    terminal.send(unfinished[: chance.randrange(len(unfinished))].encode())
