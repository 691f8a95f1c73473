"""USB: which board and camera are plugged in, how fast they are connected, and who may open them."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import libusb_package
import usb.core
import usb.util
from serial.tools import list_ports

from turnlight.errors import CameraError, LinkError

BY_IDENTITY = "usb:"
BOARDS = {
    (0x2341, 0x0042): "Arduino Mega 2560",
    (0x2341, 0x0010): "Arduino Mega 2560",
    (0x2341, 0x0043): "Arduino Uno",
    (0x2A03, 0x0042): "Arduino Mega 2560",
    (0x1A86, 0x7523): "board with a CH340",
    (0x0403, 0x6001): "board with an FT232",
    (0x10C4, 0xEA60): "board with a CP2102",
}
OAK_VENDOR = 0x03E7
OAK_ASLEEP = 0x2485
"""An OAK that has not been given its program yet shows itself at USB 2, whatever it is plugged into."""
_VIDEO_CLASS = 0x0E
_SPEEDS = {
    usb.util.SPEED_LOW: "USB 1 (1.5 Mbit/s)",
    usb.util.SPEED_FULL: "USB 1 (12 Mbit/s)",
    usb.util.SPEED_HIGH: "USB 2 (480 Mbit/s)",
    usb.util.SPEED_SUPER: "USB 3 (5 Gbit/s)",
    usb.util.SPEED_SUPER + 1: "USB 3 (10 Gbit/s)",
}


@dataclass(frozen=True)
class UsbDevice:
    """A board or a camera. node: the file that a program opens to talk to it."""

    kind: str
    name: str
    vendor: int
    product: int
    speed: str
    node: Path

    @property
    def slow(self) -> bool:
        """An OAK that would be faster in another port or with another cable."""
        awake = self.vendor == OAK_VENDOR and self.product != OAK_ASLEEP
        return awake and "USB 3" not in self.speed

    @property
    def permitted(self) -> bool:
        """Whether this user may open it."""
        return os.access(self.node, os.R_OK | os.W_OK)

    @property
    def rule(self) -> str:
        """See camera_rule."""
        return camera_rule(self.vendor)

    @property
    def not_permitted(self) -> str:
        """What to tell a user who may not open it."""
        return (
            f"The {self} may not be opened by this user; run sudo turnlight install-service "
            f"--rules-only, which adds the udev rule {self.rule}, and plug it in again."
        )

    def __str__(self) -> str:
        return f"{self.name} ({self.vendor:04x}:{self.product:04x}, {self.speed})"


def camera_rule(vendor: int) -> str:
    """The udev rule that lets the users of this seat, and those in `plugdev`, open a camera."""
    return (
        f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{vendor:04x}", '
        'MODE="0660", GROUP="plugdev", TAG+="uaccess"'
    )


def devices(backend: Any = None) -> list[UsbDevice]:
    """Boards and cameras that are plugged in. backend: pyusb's, by default the libusb that comes along."""
    return [known for _, known in _known(backend)]


def reset_cameras(backend: Any = None) -> list[UsbDevice]:
    """What unplugging and plugging in would do, for every camera. Raises CameraError if it cannot be."""
    cameras = [(device, known) for device, known in _known(backend) if known.kind == "camera"]
    if not cameras:
        raise CameraError(
            "No camera is plugged in, so none was reset; check its cable and its power."
        )
    for device, known in cameras:
        try:
            device.reset()
        except usb.core.USBError as error:
            raise CameraError(_why_not_reset(known, error)) from error
    return [known for _, known in cameras]


def serial_port(port: str) -> str:
    """The serial port that "usb:2341:0042" or "usb:2341:0042:SERIAL" stands for; others as they are.

    Raises LinkError if no such board is plugged in, or more than one.
    """
    if not port.startswith(BY_IDENTITY):
        return port
    vendor, product, serial_number = _identity(port)
    boards = [p for p in list_ports.comports() if p.vid is not None]
    found = [
        p
        for p in boards
        if (p.vid, p.pid) == (vendor, product) and serial_number in ("", p.serial_number)
    ]
    if len(found) == 1:
        return str(found[0].device)
    if found:
        numbers = " or ".join(f"{port}:{p.serial_number}" for p in found if p.serial_number)
        by_path = "a path under /dev/serial/by-path"
        raise LinkError(
            f"{len(found)} boards of the kind {port} are plugged in; "
            f"say in the rig's file which one is meant: port = {numbers or by_path}."
        )
    others = ", ".join(f"usb:{p.vid:04x}:{p.pid:04x} on {p.device}" for p in boards) or "none"
    raise LinkError(
        f"No board {port} is plugged in (found: {others}); check its cable, "
        "or correct `port` in the rig's file."
    )


def _known(backend: Any) -> Iterator[tuple[usb.core.Device, UsbDevice]]:
    backend = backend or libusb_package.get_libusb1_backend()
    for device in usb.core.find(find_all=True, backend=backend):
        identity = (device.idVendor, device.idProduct)
        if identity in BOARDS:
            kind, name = "board", BOARDS[identity]
        elif device.idVendor == OAK_VENDOR:
            kind, name = "camera", "OAK camera"
        elif _has_video(device):
            kind, name = "camera", "UVC camera"
        else:
            continue
        speed = _SPEEDS.get(device.speed, "unknown speed")
        node = Path(f"/dev/bus/usb/{device.bus:03}/{device.address:03}")
        yield device, UsbDevice(kind, name, *identity, speed, node)


def _has_video(device: usb.core.Device) -> bool:
    try:
        return any(i.bInterfaceClass == _VIDEO_CLASS for c in device for i in c)
    except usb.core.USBError:
        return False


def _identity(port: str) -> tuple[int, int, str]:
    words = port.removeprefix(BY_IDENTITY).split(":", 2)
    try:
        return int(words[0], 16), int(words[1], 16), words[2] if len(words) > 2 else ""
    except (ValueError, IndexError) as error:
        raise LinkError(
            f"{port} does not name a board; write port = usb:VENDOR:PRODUCT with the four hex digits "
            "that turnlight doctor shows of each."
        ) from error


def _why_not_reset(camera: UsbDevice, error: usb.core.USBError) -> str:
    if not camera.permitted:
        return camera.not_permitted
    cause = (error.strerror or str(error)).lower()
    return f"The {camera} could not be reset ({cause}); unplug it and plug it in again."
