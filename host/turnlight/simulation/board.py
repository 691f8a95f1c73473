"""The simulated board: the firmware as a child process, and its side channel."""

import subprocess
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from turnlight.config import ControllerConfig
from turnlight.errors import ConfigError, RigError

BUILD = Path(__file__).parents[3] / "firmware" / "build"
PROGRAM = BUILD / "turnlight-native"
CHIPS = ("atmega2560", "atmega328p")


@dataclass(frozen=True)
class BoardState:
    """What is physically so, whatever the firmware believes.

    time_us: virtual time since power-up. angle_deg: the table's, 0 to 360.
    leds: (led_count,) level of each, 0 to 255. strobes, steps: pulses since power-up.
    """

    time_us: int
    angle_deg: float
    leds: tuple[int, ...]
    strobes: int
    steps: int


class SimulatedBoard:
    """The firmware in virtual time; `port` is its serial port.

    Use as a context manager: the program ends with the block, and with this process at the latest.
    """

    def __init__(self, program: Path = PROGRAM, *arguments: str | Path) -> None:
        """Start the native firmware, or another board's. Raises RigError if it has not been built."""
        try:
            self._process = subprocess.Popen(
                [program, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                bufsize=1,
            )
        except OSError as error:
            raise RigError(
                f"The simulated firmware cannot be started from {program}; run `make firmware`."
            ) from error
        self._lock = threading.Lock()
        self.port = self._read_line().removeprefix("pty ")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the program; may be called twice."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        self._process.wait()

    def state(self) -> BoardState:
        return self._command("state")

    def advance(self, ms: float) -> BoardState:
        """Let virtual time pass, to the microsecond."""
        return self._command(f"advance {ms:.3f}")

    def slip(self, angle_deg: float) -> BoardState:
        """Turn the table without the firmware's knowledge, as lost steps do."""
        return self._command(f"slip {round(angle_deg * 100)}")

    def press_estop(self, pressed: bool) -> BoardState:
        return self._command(f"estop {pressed:d}")

    def press_button(self, pressed: bool) -> BoardState:
        return self._command(f"button {pressed:d}")

    def hide_mark(self, hidden: bool) -> BoardState:
        """Blind the index sensor."""
        return self._command(f"hide_mark {hidden:d}")

    def spoil(self, address: int) -> BoardState:
        """Flip every bit of one EEPROM byte."""
        return self._command(f"spoil {address}")

    def reset(self) -> BoardState:
        """Restart the firmware as its watchdog would; the table stays where it is."""
        return self._command("reset")

    def _command(self, command: str) -> BoardState:
        assert self._process.stdin is not None
        with self._lock:
            try:
                self._process.stdin.write(command + "\n")
                answer = self._read_line()
            except (OSError, ValueError) as error:
                raise RigError(
                    "The simulated firmware has ended; start the program anew."
                ) from error
        outcome, *words = answer.split(" ")
        if outcome != "ok":
            raise RigError(
                f"The simulated firmware does not take `{command}`; run `make firmware`."
            )
        fields = dict(word.split("=", 1) for word in words)
        return BoardState(
            time_us=int(fields["time_us"]),
            angle_deg=int(fields["angle_udeg"]) / 1e6,
            leds=tuple(bytes.fromhex(fields["leds"])),
            strobes=int(fields["strobes"]),
            steps=int(fields["steps"]),
        )

    def _read_line(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RigError("The simulated firmware has ended; start the program anew.")
        return line.rstrip("\n")


def simulated_board(controller: ControllerConfig) -> SimulatedBoard | None:
    """The board that a rig file's port names: "simulated" runs the native firmware,
    "simulated:atmega2560" the one that the real board gets, on a simulated chip; None for a real
    port. Raises ConfigError for another chip, RigError if the firmware has not been built.
    """
    if not controller.simulated:
        return None
    chip = controller.port.partition(":")[2]
    if not chip:
        return SimulatedBoard()
    if chip not in CHIPS:
        raise ConfigError(
            f'No chip "{chip}" can be simulated; in the rig file, set port to "simulated" or '
            f'"simulated:{CHIPS[0]}".'
        )
    return SimulatedBoard(BUILD / f"turnlight-simavr-{chip}", BUILD / f"turnlight-{chip}.elf")


class BoardClock:
    """Virtual time as a Clock: sleeping advances the board, and takes no real time."""

    def __init__(self, board: SimulatedBoard) -> None:
        self._board = board

    def now_s(self) -> float:
        return self._board.state().time_us / 1e6

    def sleep(self, seconds: float) -> None:
        self._board.advance(seconds * 1000)
