"""A rig, ready to be used: controller and camera, with the clock that both live by."""

from dataclasses import dataclass

from turnlight.config import RigConfig
from turnlight.rig.camera.camera import Camera
from turnlight.rig.clock import Clock
from turnlight.rig.controller import Controller


@dataclass(frozen=True)
class Rig:
    """What `config` describes, connected."""

    config: RigConfig
    controller: Controller
    camera: Camera
    clock: Clock
    firmware: str = ""
    """The version that the controller answered with."""
