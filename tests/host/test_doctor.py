"""The doctor's eyes for hardware: what is plugged in, who may open it, and a board that restarts."""

import dataclasses
import functools
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from turnlight import app, doctor
from turnlight.doctor import Check
from turnlight.rig.camera.oak import OakCamera
from turnlight.rig.usb import UsbDevice
from turnlight.simulation.board import SimulatedBoard

STAND_IN = Path(__file__).parent / "rig/camera/oak_stand_in.py"
RIGS = Path(__file__).parents[2] / "rig_config"
OAK = UsbDevice("camera", "OAK camera", 0x03E7, 0xF63B, "USB 3 (5 Gbit/s)", Path("/dev/null"))
MEGA = UsbDevice("board", "Arduino Mega 2560", 0x2341, 0x42, "USB 1 (12 Mbit/s)", Path("/dev/null"))
PlugIn = Callable[..., None]


@pytest.fixture
def plug_in(monkeypatch: pytest.MonkeyPatch) -> PlugIn:
    return lambda *devices: monkeypatch.setattr(doctor.usb, "devices", lambda: list(devices))


def check(rig: str, name: str) -> Check:
    return next(c for c in doctor.doctor(RIGS / f"{rig}.toml") if c.name == name)


def test_board_and_camera_are_named_with_their_speed(plug_in: PlugIn) -> None:
    plug_in(MEGA, OAK)
    seen = check("oak", "usb")
    assert seen.ok
    assert seen.text == (
        "Arduino Mega 2560 (2341:0042, USB 1 (12 Mbit/s)), OAK camera (03e7:f63b, USB 3 (5 Gbit/s))"
    )


def test_what_is_wrong_on_usb(plug_in: PlugIn, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_in(MEGA)
    assert "No OAK camera is plugged in (found: Arduino Mega" in check("oak", "usb").text
    plug_in(dataclasses.replace(OAK, speed="USB 2 (480 Mbit/s)"))
    assert "a USB 3 port with a USB 3 cable" in check("oak", "usb").text
    plug_in(OAK)
    assert "No UVC camera is plugged in" in check("uvc", "usb").text
    monkeypatch.setattr(os, "access", lambda *_: False)
    seen = check("oak", "usb")
    assert not seen.ok
    assert 'SUBSYSTEM=="usb", ATTR{idVendor}=="03e7"' in seen.text


def test_a_board_that_restarts_when_its_port_is_opened_is_noticed(tmp_path: Path) -> None:
    """The simulated board has just booted too; by its port alone it passes for a real one."""
    with SimulatedBoard() as board:
        text = (RIGS / "simulated.toml").read_text()
        assert text.count('port = "simulated"') == 1
        rig = tmp_path / "rig.toml"
        rig.write_text(text.replace('port = "simulated"', f'port = "{board.port}"'))
        seen = {c.name: c for c in doctor.doctor(rig)}
        assert seen["controller"].ok
        assert "it restarts when its port is opened" in seen["controller"].text
        assert "both simulated or both real" in seen["camera"].text
        board.advance(10_000)
        seen = {c.name: c for c in doctor.doctor(rig)}
        assert "restarts" not in seen["controller"].text


def test_an_oak_says_who_it_is_how_it_is_connected_and_what_it_sees(
    tmp_path: Path, plug_in: PlugIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stand-in for the camera, and a simulated board that passes for a real one."""
    plug_in(MEGA, OAK)
    monkeypatch.setattr(app, "OakCamera", functools.partial(OakCamera, program=(str(STAND_IN),)))
    told = tmp_path / "behaviour"
    told.write_text("good")
    with SimulatedBoard() as board:
        text = (RIGS / "oak.toml").read_text()
        for old, new in (
            ('port = "usb:2341:0042"', f'port = "{board.port}"'),
            ('device = ""', f'device = "{told}"'),
            ("width_px = 4056", "width_px = 64"),
            ("height_px = 3040", "height_px = 64"),
        ):
            assert text.count(old) == 1
            text = text.replace(old, new)
        rig = tmp_path / "rig.toml"
        rig.write_text(text)
        seen = {c.name: c for c in doctor.doctor(rig)}
        assert seen["camera"].text == (
            "a frame of 64 x 64 pixels at 10000 us arrives from the stand-in, USB SUPER; "
            "it says of itself that it sees 1.2 degrees in height, and the rig file 54.0"
        )
        assert not any(board.state().leds)
