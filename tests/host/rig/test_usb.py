"""Boards and cameras on a bus of our own behind the real pyusb, and ports behind the real pyserial."""

import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import usb.backend
import usb.core
import usb.util
from serial.tools.list_ports_common import ListPortInfo

from turnlight.errors import CameraError, LinkError
from turnlight.rig import usb as rig_usb

MEGA = (0x2341, 0x0042)
OAK_ASLEEP, OAK = (0x03E7, 0x2485), (0x03E7, 0xF63B)
WEBCAM, STICK = (0x046D, 0x0825), (0x0781, 0x5581)
SPEED = {OAK: usb.util.SPEED_SUPER, MEGA: usb.util.SPEED_FULL}
CLASS = {WEBCAM: 0x0E, STICK: 0x08}


class Bus(usb.backend.IBackend):
    """A bus with these devices plugged in."""

    def __init__(self, *plugged_in: tuple[int, int]) -> None:
        self.plugged_in = plugged_in
        self.reset: list[tuple[int, int]] = []
        self.refuses: int | None = None

    def enumerate_devices(self) -> Iterator[tuple[int, int]]:
        return iter(self.plugged_in)

    def get_device_descriptor(self, dev: tuple[int, int]) -> Any:
        zeros = (
            "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 "
            "bcdDevice iManufacturer iProduct iSerialNumber port_number"
        )
        return SimpleNamespace(
            **dict.fromkeys(zeros.split(), 0), idVendor=dev[0], idProduct=dev[1], bus=1,
            address=7 + self.plugged_in.index(dev), port_numbers=(1,), bNumConfigurations=1,
            speed=SPEED.get(dev, usb.util.SPEED_HIGH),
        )  # fmt: skip

    def get_configuration_descriptor(self, _dev: tuple[int, int], _config: int) -> Any:
        names = "bLength bDescriptorType wTotalLength bConfigurationValue iConfiguration bmAttributes bMaxPower"
        return SimpleNamespace(
            **dict.fromkeys(names.split(), 0), bNumInterfaces=1, extra_descriptors=[]
        )

    def get_interface_descriptor(self, dev: tuple[int, int], intf: int, alt: int, _c: int) -> Any:
        if intf or alt:
            raise IndexError
        names = "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints"
        names += " bInterfaceSubClass bInterfaceProtocol iInterface"
        return SimpleNamespace(
            **dict.fromkeys(names.split(), 0), bInterfaceClass=CLASS.get(dev, 0xFF),
            extra_descriptors=[],
        )  # fmt: skip

    def open_device(self, dev: tuple[int, int]) -> tuple[int, int]:
        if self.refuses:
            raise usb.core.USBError("refused", errno=self.refuses)
        return dev

    def close_device(self, handle: tuple[int, int]) -> None: ...

    def reset_device(self, handle: tuple[int, int]) -> None:
        self.reset.append(handle)


def test_boards_and_cameras_are_found_and_nothing_else() -> None:
    found = rig_usb.devices(Bus(STICK, MEGA, OAK, WEBCAM))
    assert [str(device) for device in found] == [
        "Arduino Mega 2560 (2341:0042, USB 1 (12 Mbit/s))",
        "OAK camera (03e7:f63b, USB 3 (5 Gbit/s))",
        "UVC camera (046d:0825, USB 2 (480 Mbit/s))",
    ]
    assert [device.kind for device in found] == ["board", "camera", "camera"]
    assert found[1].node == Path("/dev/bus/usb/001/009")
    assert 'ATTR{idVendor}=="03e7"' in found[1].rule
    assert not found[1].permitted  # there is no such file


def test_an_oak_in_a_slow_port_is_told_from_one_that_is_asleep(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asleep, awake, webcam = rig_usb.devices(Bus(OAK_ASLEEP, OAK, WEBCAM))
    assert (asleep.slow, awake.slow, webcam.slow) == (False, False, False)
    monkeypatch.setitem(SPEED, OAK, usb.util.SPEED_HIGH)
    assert rig_usb.devices(Bus(OAK))[0].slow


def test_the_libusb_that_comes_along_can_be_asked() -> None:
    assert isinstance(rig_usb.devices(), list)


def test_a_wedged_camera_is_reset() -> None:
    bus = Bus(MEGA, OAK, STICK)
    assert [device.name for device in rig_usb.reset_cameras(bus)] == ["OAK camera"]
    assert bus.reset == [OAK]


def test_a_camera_that_cannot_be_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CameraError, match="No camera is plugged in"):
        rig_usb.reset_cameras(Bus(MEGA))
    bus = Bus(OAK)
    bus.refuses = 13
    with pytest.raises(CameraError, match=r'udev rule SUBSYSTEM=="usb", ATTR\{idVendor\}=="03e7"'):
        rig_usb.reset_cameras(bus)
    monkeypatch.setattr(os, "access", lambda *_: True)
    with pytest.raises(CameraError, match="unplug it and plug it in again"):
        rig_usb.reset_cameras(bus)


def port(device: str, identity: tuple[int, int] | None, serial_number: str | None = None) -> Any:
    info = ListPortInfo(device)
    info.vid, info.pid = identity or (None, None)
    info.serial_number = serial_number
    return info


@pytest.fixture
def ports(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    plugged_in: list[Any] = [port("/dev/ttyS0", None)]
    monkeypatch.setattr(rig_usb.list_ports, "comports", lambda: plugged_in)
    return plugged_in


def test_a_port_is_found_by_its_board_whatever_its_number(ports: list[Any]) -> None:
    ports += [port("/dev/ttyUSB0", (0x1A86, 0x7523)), port("/dev/ttyACM3", MEGA, "75A")]
    assert rig_usb.serial_port("usb:2341:0042") == "/dev/ttyACM3"
    assert rig_usb.serial_port("usb:2341:0042:75A") == "/dev/ttyACM3"
    assert rig_usb.serial_port("usb:1A86:7523") == "/dev/ttyUSB0"
    assert rig_usb.serial_port("/dev/ttyS0") == "/dev/ttyS0"


def test_ports_that_are_not_found(ports: list[Any]) -> None:
    with pytest.raises(LinkError, match=r"No board usb:2341:0042 is plugged in \(found: none\)"):
        rig_usb.serial_port("usb:2341:0042")
    ports += [port("/dev/ttyACM0", MEGA, "75A"), port("/dev/ttyACM1", MEGA, "75B")]
    with pytest.raises(LinkError, match="usb:2341:0042:75A or usb:2341:0042:75B"):
        rig_usb.serial_port("usb:2341:0042")
    assert rig_usb.serial_port("usb:2341:0042:75B") == "/dev/ttyACM1"
    with pytest.raises(LinkError, match="found: usb:2341:0042 on /dev/ttyACM0"):
        rig_usb.serial_port("usb:1a86:7523")
    ports[1:] = [port(f"/dev/ttyUSB{i}", (0x1A86, 0x7523)) for i in range(2)]
    with pytest.raises(LinkError, match="/dev/serial/by-path"):
        rig_usb.serial_port("usb:1a86:7523")


@pytest.mark.parametrize("text", ["usb:", "usb:2341", "usb:mega:2560"])
def test_identities_that_make_no_sense(ports: list[Any], text: str) -> None:
    with pytest.raises(LinkError, match="does not name a board"):
        rig_usb.serial_port(text)
