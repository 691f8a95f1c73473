"""A simulated AVR board and the trace of its pins, in cycles of its 16 MHz clock."""

import random
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from terminal import Terminal, seal

from turnlight.simulation.board import SimulatedBoard

BUILD = Path(__file__).parents[2] / "firmware" / "build"
BOARDS = ("atmega2560", "atmega328p")
CYCLES_PER_MS = 16_000
BYTE_CYCLES = 640


@dataclass(frozen=True)
class Happening:
    cycle: int
    what: str
    value: int


class TracedBoard:
    """A board whose terminal and trace a test reads."""

    def __init__(self, board: SimulatedBoard, terminal: Terminal, path: Path) -> None:
        self.board = board
        self.terminal = terminal
        self._path = path

    def trace(self, *kinds: str) -> list[Happening]:
        """Everything of these kinds since power-up."""
        self.terminal.say("?")  # its answer comes when the trace has been written
        rows = (line.split(" ") for line in self._path.read_text().splitlines())
        return [
            Happening(int(cycle), what, int(value)) for cycle, what, value in rows if what in kinds
        ]

    def home(self, steps_per_s: int) -> None:
        """Home, with this top speed from now on."""
        self.terminal.ask("hello")
        self.terminal.ask("set acceleration 200000")
        assert self.terminal.ask(f"set top_speed {steps_per_s * 9 // 4}").startswith("ok")
        self.terminal.ask("home")
        assert self.terminal.settle() == "ready"

    def stat_cycles(self, count: int) -> list[int]:
        """Of `stat` with a long number, at any moment: from its first bit to its answer's last."""
        chance = random.Random(6)
        self.terminal.count_from(30_000)
        first = self.trace("received")[-1].cycle + 1
        for _ in range(count):
            self.terminal.ask("stat")
            self.board.advance(chance.uniform(5, 10))
        return exchanges(self.trace("received", "sent"), first)

    def load(self, commands: int) -> Iterator[str]:
        """LED commands two at a time, as many as the chip can keep: one comes while the one before it
        is done, and the answers and frames follow. Yields the answers."""
        for burst in led_bursts(commands):
            self.terminal.send(burst)
            for _ in range(burst.count(b"\n")):
                yield self.terminal.hear()

    def press_estop_behind(self, data: bytes) -> None:
        """Press the emergency stop as the last of these bytes comes, with all that they ask for still
        to be done: the program finds both when it is let go on."""
        process = self.board._process
        process.send_signal(signal.SIGSTOP)
        self.terminal.send(data)
        threading.Timer(0.1, process.send_signal, [signal.SIGCONT]).start()
        self.board.press_estop(True)


@contextmanager
def traced_board(
    kind: str, folder: Path, build: str = "", paced: bool = False
) -> Iterator[TracedBoard]:
    """Power up a board; build: "-hang" for the one whose main loop can be hung."""
    path = folder / "trace"
    arguments = [BUILD / f"turnlight-{kind}{build}.elf", path, *(["paced"] if paced else [])]
    program = BUILD / f"turnlight-simavr-{kind}"
    with SimulatedBoard(program, *arguments) as board, Terminal(board) as terminal:
        yield TracedBoard(board, terminal, path)


def led_bursts(commands: int) -> Iterator[bytes]:
    """LED commands, two at a time."""
    lines = [seal(f"{n + 1} led {200 + n % 2} {0xFFFFFFFFF >> n % 8:X}") for n in range(commands)]
    for first in range(0, commands, 2):
        yield "".join(f"{line}\n" for line in lines[first : first + 2]).encode()


def plateau(steps: list[Happening], interval: int) -> list[int]:
    """The intervals at full speed: from the first to the last run of 32 that averages to it."""
    rises = [step.cycle for step in steps if step.value == 1]
    intervals = [later - earlier for earlier, later in pairwise(rises)]
    full = [
        i
        for i in range(len(intervals) - 32)
        if abs(sum(intervals[i : i + 32]) - 32 * interval) < 128
    ]
    return intervals[full[0] + 32 : full[-1]]


def exchanges(bytes_: list[Happening], first: int) -> list[int]:
    """Cycles from the start of each line to the end of its answer."""
    cycles, start, last = [], 0, "sent"
    for byte in bytes_:
        if byte.what == "received" and last == "sent":
            start = byte.cycle - BYTE_CYCLES
        last = byte.what
        if byte.what == "sent" and byte.value == ord("\n") and start >= first:
            cycles.append(byte.cycle + BYTE_CYCLES - start)
    return cycles
