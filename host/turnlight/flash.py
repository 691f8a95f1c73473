"""New firmware for the controller: avrdude writes it, and the controller says that it runs it."""

import contextlib
import fcntl
import json
import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from turnlight.config import RigConfig
from turnlight.errors import FirmwareError, LinkError
from turnlight.rig.link import SerialLink
from turnlight.rig.usb import serial_port

IMAGES = Path(__file__).parents[2] / "firmware" / "build"
_AVRDUDE_LIMIT_S = 120
_BOOT_LIMIT_S = 8.0


@dataclass(frozen=True)
class BootLoader:
    """What avrdude calls the way to a board's boot loader."""

    programmer: str
    baud: int


BOARDS = {"atmega2560": BootLoader("wiring", 115200), "atmega328p": BootLoader("arduino", 115200)}


@dataclass(frozen=True)
class Image:
    """A firmware image, and what its `hello` answers."""

    path: Path
    board: str
    firmware: str
    build: str

    def __str__(self) -> str:
        return f"firmware {self.firmware}, build {self.build}, for {self.board}"


def image_for(board: str, folder: Path = IMAGES) -> Image:
    """The image that was built for a board. Raises FirmwareError if there is none."""
    if board not in BOARDS:
        raise FirmwareError(
            f'There is no firmware for a board "{board}"; it runs on {" and ".join(BOARDS)}.'
        )
    path = folder / f"turnlight-{board}.hex"
    try:
        says = json.loads(path.with_suffix(".json").read_text())
        if not path.is_file():
            raise FileNotFoundError(path)
        return Image(path, says["board"], says["firmware"], says["build"])
    except (OSError, ValueError, KeyError) as error:
        raise FirmwareError(f"The firmware {path} is not built; run `make firmware`.") from error


def flash(config: RigConfig, board: str | None = None, *, quiet: bool = True) -> Image:
    """Write the firmware and have the controller confirm it; returns what it runs now.

    board: its chip, for a controller that does not answer yet; otherwise it is asked. quiet: False
    lets avrdude show its progress on standard error. Raises LinkError if the port cannot be opened,
    another program's run included; FirmwareError if the rig is busy, there is no image, avrdude fails
    or the controller does not confirm.
    """
    if config.controller.simulated:
        raise FirmwareError(
            "This rig's controller is simulated and has no board to write to; "
            "name the real rig's file with --rig."
        )
    port = serial_port(config.controller.port)
    found = _board_at_rest(port, config.controller.baud, board)
    if board is not None and board != found:
        raise FirmwareError(
            f"The controller on {port} is an {found}, not an {board}; leave --board out."
        )
    image = image_for(found)
    with _kept_from_others(port):
        _write(image, port, quiet)
    _confirm(image, port, config.controller.baud)
    return image


def _board_at_rest(port: str, baud: int, board: str | None) -> str:
    """The board on the port, which must neither turn nor shine."""
    with contextlib.closing(SerialLink(port, baud)) as link:
        try:
            hello = link.request("hello")
        except LinkError as error:
            if board is not None:
                return board
            raise FirmwareError(
                f"The controller on {port} does not answer; if it has never had this firmware, say "
                f"which board it is: --board {' or --board '.join(BOARDS)}."
            ) from error
        state = link.request("stat", "all")
    if state["is"] in ("moving", "homing") or int(state["lit"], 16):
        raise FirmwareError(
            "The rig is at work; let the run end, or stop it, before new firmware is written."
        )
    return hello["board"]


@contextlib.contextmanager
def _kept_from_others(port: str) -> Iterator[None]:
    """No program that asks for the port alone gets it meanwhile; avrdude does not ask."""
    descriptor = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise LinkError(
            f"The serial port {port} is in use; close the other program that has it open."
        ) from error
    finally:
        os.close(descriptor)


def _write(image: Image, port: str, quiet: bool) -> None:
    loader = BOARDS[image.board]
    command = [
        "avrdude", "-p", image.board, "-c", loader.programmer, "-P", port, "-b", str(loader.baud),
        "-D", "-U", f"flash:w:{image.path}:i",
    ]  # fmt: skip
    try:
        result = subprocess.run(
            command,
            stderr=subprocess.PIPE if quiet else None,
            text=True,
            timeout=_AVRDUDE_LIMIT_S,
            check=False,
        )
    except FileNotFoundError as error:
        raise FirmwareError("avrdude is not there; install it: apt install avrdude.") from error
    except subprocess.TimeoutExpired as error:
        raise FirmwareError(
            f"avrdude has not ended in {_AVRDUDE_LIMIT_S} s; plug the board in again and repeat."
        ) from error
    if result.returncode != 0:
        said = (result.stderr or "").strip().splitlines()
        raise FirmwareError(
            "avrdude could not write the firmware"
            + (f" ({said[-1].strip()})" if said else "")
            + "; take out the capacitor that keeps the board from resetting, if it has one, "
            "and repeat."
        )


def _confirm(image: Image, port: str, baud: int) -> None:
    try:
        with contextlib.closing(SerialLink(port, baud, give_up_after_s=_BOOT_LIMIT_S)) as link:
            hello = link.request("hello")
    except LinkError as error:
        raise FirmwareError(
            f"The firmware was written, but the controller on {port} does not answer with it; "
            "repeat, and check that --board is what it is."
        ) from error
    if (hello["board"], hello["firmware"], hello["build"]) != (
        image.board,
        image.firmware,
        image.build,
    ):
        raise FirmwareError(
            f"The controller runs firmware {hello['firmware']}, build {hello['build']}, for "
            f"{hello['board']}, and not the {image} that was written; repeat."
        )
