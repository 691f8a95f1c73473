"""The sequencer: one shot after the other, verified, kept, and turned into better maps."""

import contextlib
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from svbrdf.lighting import Lighting
from svbrdf.maps import Maps
from turnlight.capture.manifest import ShotRecord
from turnlight.capture.plan import Shot, signed_turn_deg, turn_deg
from turnlight.capture.relight import relit
from turnlight.capture.session import Session
from turnlight.config import RigConfig
from turnlight.errors import CameraError, LinkError, RigError
from turnlight.frame import Exposure, Frame
from turnlight.picture.lighting import lighting
from turnlight.picture.picture import Picture
from turnlight.picture.rectify import Rectified, rectify
from turnlight.rig.camera.camera import Camera
from turnlight.rig.clock import Clock
from turnlight.rig.controller import Controller, Strobe

RESOLUTION = 512
LOST_STEPS_DEG = 0.5
ARRIVED_DEG = 0.05


class Estimator(Protocol):
    """What turns pictures into maps, one at a time."""

    def add(self, picture: Picture) -> Maps: ...


@dataclass(frozen=True)
class Rig:
    """Controller and camera, with the clock that both live by."""

    config: RigConfig
    controller: Controller
    camera: Camera
    clock: Clock


@dataclass(frozen=True)
class ShotDone:
    """A shot is on disk and the maps on disk know of it.

    number: 1 for the first of `count`. change: mean absolute difference from the maps before, None
    for the first. seconds_left: at the pace so far.
    """

    number: int
    count: int
    record: ShotRecord
    picture: Picture
    maps: Maps
    change: float | None
    seconds_left: float


def run(
    rig: Rig, session: Session, shots: Sequence[Shot], thickness_mm: float, estimator: Estimator
) -> Generator[ShotDone, None, None]:
    """Take the shots into the session; an event after each. The LEDs are off however this ends.

    A table that has lost steps is named in the shot's record and does not end the capture, because
    the picture is rectified by where the platter is seen to be. Raises RigError, CameraError,
    ImageError, LinkError or SessionError; what is on disk by then stays good.
    """
    began = time.monotonic()
    try:
        rig.controller.home()
        darks = _take_darks(rig, session, shots)
        maps: Maps | None = None
        for number, shot in enumerate(shots, 1):
            frame, strobe = _take(rig, shot)
            record = session.save_shot(shot, frame, strobe.angle_deg)
            dark = darks[frame.exposure]
            seen = rectify(frame, dark, rig.config, thickness_mm, RESOLUTION)
            record = _compare(session, record, seen)
            picture = replace(seen.picture, lighting=_lighting(rig, record, thickness_mm))
            before, maps = maps, estimator.add(picture)
            session.save_maps(maps, relit(maps))
            yield ShotDone(
                number=number,
                count=len(shots),
                record=record,
                picture=picture,
                maps=maps,
                change=change(before, maps) if before else None,
                seconds_left=(time.monotonic() - began) / number * (len(shots) - number),
            )
        session.finish()
    finally:
        with contextlib.suppress(LinkError):  # the rig switches itself off when the line is dead
            rig.controller.off()


def change(before: Maps, after: Maps) -> float:
    """Mean absolute difference of two map sets, over all values of all four maps."""
    names = ("normal", "diffuse", "roughness", "specular")
    apart = [np.abs(getattr(after, n) - getattr(before, n)).ravel() for n in names]
    return float(np.concatenate(apart).mean())


def _take_darks(rig: Rig, session: Session, shots: Sequence[Shot]) -> dict[Exposure, Frame]:
    """One frame without LEDs for each exposure in the plan."""
    rig.controller.off()
    rig.clock.sleep(rig.config.controller.settle_ms / 1000)
    darks: dict[Exposure, Frame] = {}
    for exposure in dict.fromkeys(Exposure(s.exposure_us, s.gain) for s in shots):
        frame = rig.camera.capture(exposure)
        if frame.exposure != exposure:
            raise _wrong_exposure(exposure, frame.exposure)
        session.save_dark(frame)
        darks[exposure] = frame
    return darks


def _take(rig: Rig, shot: Shot) -> tuple[Frame, Strobe]:
    """One frame that is proven to show what the shot asks for."""
    controller = rig.controller
    exposure = Exposure(shot.exposure_us, shot.gain)
    controller.move(shot.angle_deg)
    controller.light(shot.leds)
    rig.clock.sleep(rig.config.controller.settle_ms / 1000)
    strobe = controller.trigger(shot.index)
    frame = rig.camera.capture(exposure)
    after = controller.status()
    controller.off()
    if frame.exposure != exposure:
        raise _wrong_exposure(exposure, frame.exposure)
    if frame.started_us < strobe.time_us:
        raise CameraError(
            f"Shot {shot.index + 1}: the camera's frame was begun before the light had settled; "
            "run turnlight doctor to check the camera."
        )
    if after.state != "ready":
        raise RigError(
            f"Shot {shot.index + 1}: the rig reports {after.state} during the exposure; see that "
            "nothing is in its way and start again."
        )
    _check_setup(shot, strobe.leds, strobe.angle_deg)
    _check_setup(shot, after.leds, after.angle_deg)
    return frame, strobe


def _check_setup(shot: Shot, lit: tuple[int, ...], angle_deg: float) -> None:
    if lit != shot.leds:
        raise RigError(
            f"Shot {shot.index + 1}: LEDs {_list(shot.leds)} were asked for but {_list(lit)} were "
            "lit; run turnlight doctor to check the rig."
        )
    if turn_deg(shot.angle_deg, angle_deg) > ARRIVED_DEG:
        raise RigError(
            f"Shot {shot.index + 1}: the table was sent to {shot.angle_deg:.2f} degrees but is at "
            f"{angle_deg:.2f}; check that nothing moves it, then start again."
        )


def _compare(session: Session, record: ShotRecord, seen: Rectified) -> ShotRecord:
    """Keep what the picture shows, and name a table that is not where it says it is."""
    lost_deg = signed_turn_deg(record.reported_angle_deg, seen.measured_angle_deg)
    warning = None
    if abs(lost_deg) > LOST_STEPS_DEG:
        warning = (
            f"Lost steps: the table stands {lost_deg:+.1f} degrees from where the controller thinks "
            "it is; check the belt and that the table turns freely."
        )
    return session.save_measurement(
        record,
        seen.measured_angle_deg % 360,
        seen.markers_seen,
        seen.marker_residual_px,
        warning,
    )


def _lighting(rig: Rig, record: ShotRecord, thickness_mm: float) -> Lighting:
    assert record.measured_angle_deg is not None
    shot, exposure = record.shot, record.frame.exposure
    angle_deg = record.measured_angle_deg
    return lighting(rig.config, shot.leds, angle_deg, exposure, thickness_mm, RESOLUTION)


def _wrong_exposure(asked: Exposure, got: Exposure) -> CameraError:
    return CameraError(
        f"The camera was asked for {asked.exposure_us} us at gain {asked.gain:g} but exposed "
        f"{got.exposure_us} us at gain {got.gain:g}; run turnlight doctor to check the camera."
    )


def _list(leds: tuple[int, ...]) -> str:
    return ", ".join(map(str, leds)) or "none"
