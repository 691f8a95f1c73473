"""A serial line that loses, changes and invents bytes, both ways."""

import os
import pty
import random
import select
import threading
import tty
from typing import Self


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

    def __exit__(self, *_: object) -> None:
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
