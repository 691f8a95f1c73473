"""The host's link and the firmware, over a line on which one byte in a hundred is wrong."""

import random
from collections.abc import Callable

import pytest
from noisy_line import NoisyLine

from turnlight.rig.link import RefusedError, SerialLink
from turnlight.simulation.board import SimulatedBoard

_FAULT_RATE = 0.01
_COMMANDS = {"native": 20_000, "atmega2560": 2_000, "atmega328p": 500}
_BENCH_COMMANDS = 100_000
_LEDS = 36


@pytest.mark.timeout(400)
def test_every_command_is_done_exactly_once(backend: str, board: SimulatedBoard) -> None:
    print(_run(board, _COMMANDS[backend], seed=1))


@pytest.mark.bench
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("backend", ["native"], indirect=True)
def test_a_hundred_thousand_commands(board: SimulatedBoard) -> None:
    print(f"\n   {_run(board, _BENCH_COMMANDS, seed=2)}")


def _run(board: SimulatedBoard, commands: int, seed: int) -> str:
    """Random commands, each checked by what the rig physically does, and counted by the rig."""
    with NoisyLine(board.port, _FAULT_RATE, seed) as noisy:
        link = SerialLink(noisy.port, 250000, retry_after_s=0.02, give_up_after_s=60)
        host = _Host(board, link, random.Random(seed))
        first = link._sequence
        for command in range(1, commands + 1):
            host.do_something()
            if command % 100 == 0:
                done = int(host.insist("stat", "all")["done"])
                assert (done - (link._sequence - first)) % 65535 == 0
        link.close()
        assert noisy.faults > commands / 4
        return (
            f"{commands} commands, {noisy.faults} faulty bytes: none done twice, none lost, none "
            f"wrong; {host.stops} stray stop bytes latched and were cleared"
        )


class _Host:
    def __init__(self, board: SimulatedBoard, link: SerialLink, chance: random.Random) -> None:
        self._board = board
        self._link = link
        self._chance = chance
        self._shots = 0
        self.stops = 0

    def do_something(self) -> None:
        self._chance.choice([self._led, self._led, self._lamp, self._trig])()

    def insist(self, verb: str, *arguments: int | str) -> dict[str, str]:
        """Have it done, in spite of noise that is taken for the stop byte."""
        while True:
            try:
                return self._link.request(verb, *arguments)
            except RefusedError as refused:
                assert refused.word == "stop"
                self._clear()

    def _led(self) -> None:
        level, lit = self._chance.randrange(1, 256), self._chance.randrange(1, 1 << _LEDS)
        levels = tuple(level * (lit >> led & 1) for led in range(_LEDS))
        self._see(lambda: self._board.state().leds == levels, "led", level, f"{lit:X}")

    def _lamp(self) -> None:
        led, level = self._chance.randrange(_LEDS), self._chance.randrange(256)
        self._see(lambda: self._board.state().leds[led] == level, "lamp", led, level)

    def _trig(self) -> None:
        self._shots += 1
        self._see(lambda: self._board.state().strobes == self._shots, "trig", self._shots)

    def _see(self, right: Callable[[], bool], verb: str, *arguments: int | str) -> None:
        self.insist(verb, *arguments)
        while not right():  # a stop byte that came behind the command has undone it
            assert verb != "trig"
            assert self._link.request("stat")["is"] == "stop"
            self._clear()
            self.insist(verb, *arguments)

    def _clear(self) -> None:
        self.stops += 1
        self._link.request("clear")
