"""The link and the firmware over a line that loses, changes and invents bytes, both ways."""

import os
import pty
import random
import select
import threading
import tty
from types import TracebackType
from typing import Self

import pytest

from turnlight.rig.link import RefusedError, SerialLink
from turnlight.simulation.board import SimulatedBoard

_SHOTS = 300


@pytest.mark.parametrize("seed", [1, 2])
def test_every_command_is_done_exactly_once(seed: int) -> None:
    with SimulatedBoard() as board, NoisyLine(board.port, 0.01, seed) as noisy:
        link = SerialLink(noisy.port, 250000, retry_after_s=0.03, give_up_after_s=10)
        first_sequence = link._sequence
        for shot in range(_SHOTS):
            lit = f"{1 << shot % 36:09X}"
            assert _insist(link, "led", 255, lit)["lit"] == lit
            reply = _insist(link, "trig", shot)
            assert int(reply["shot"]) == shot
            assert board.state().strobes == shot + 1
        done = int(_insist(link, "stat", "all")["done"])
        assert done == (link._sequence - first_sequence) % 65535
        assert noisy.faults > _SHOTS / 2
        link.close()


def _insist(link: SerialLink, verb: str, *arguments: int | str) -> dict[str, str]:
    """A noise byte can be the stop byte: clear it and go on."""
    while True:
        try:
            return link.request(verb, *arguments)
        except RefusedError as refused:
            assert refused.word == "stop"
            link.request("clear")


class NoisyLine:
    """Relays between `port`, which a link opens, and the real port behind it.

    rate: share of bytes, each way, that are dropped, flipped in one bit, or followed by a random one.
    """

    def __init__(self, target: str, rate: float, seed: int) -> None:
        self._rate = rate
        self._random = random.Random(seed)
        self._outer, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self._inner = os.open(target, os.O_RDWR | os.O_NOCTTY)
        self._wake_read, self._wake_write = os.pipe()
        self.port = os.ttyname(self._slave)
        self.faults = 0
        self._thread = threading.Thread(target=self._relay)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.write(self._wake_write, b"x")
        self._thread.join()
        for descriptor in (
            self._outer, self._slave, self._inner, self._wake_read, self._wake_write,
        ):  # fmt: skip
            os.close(descriptor)

    def _relay(self) -> None:
        other = {self._outer: self._inner, self._inner: self._outer}
        while True:
            ready, _, _ = select.select([*other, self._wake_read], [], [])
            if self._wake_read in ready:
                return
            for source in ready:
                os.write(other[source], self._disturb(os.read(source, 4096)))

    def _disturb(self, data: bytes) -> bytes:
        result = bytearray()
        for byte in data:
            if self._random.random() >= self._rate:
                result.append(byte)
                continue
            self.faults += 1
            fault = self._random.choice(["drop", "flip", "insert"])
            if fault == "flip":
                result.append(byte ^ (1 << self._random.randrange(8)))
            elif fault == "insert":
                result += bytes([byte, self._random.randrange(256)])
        return bytes(result)
