"""The rig as configured: checked data from one TOML file, with its unit in every name.

World frame: origin where the table's axis meets the surface of a sample of the reference thickness,
z up, x right, y away from the operator. Knows nothing of hardware. Where a calibration lies beside the
file, its numbers take the place of the configured geometry.
"""

import difflib
import functools
import math
import tomllib
from pathlib import Path
from typing import Annotated, Literal, Self

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from turnlight.calibration import (
    Calibration,
    CameraPose,
    Led,
    Lens,
    Table,
    calibration_path,
    load_calibration,
    triple,
)
from turnlight.errors import ConfigError
from turnlight.preset import Preset

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = npt.NDArray[np.float64]


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class SampleConfig(_Section):
    side_mm: Positive
    """Side of the square sample."""
    reference_thickness_mm: Annotated[float, Field(ge=0, le=50)]
    """Thickness of the sample for which the positions below were measured."""


class ControllerConfig(_Section):
    port: str
    """Serial port; "usb:2341:0042" or "usb:2341:0042:SERIAL" for the board with this vendor, product and
    serial number, wherever it is plugged in; "simulated" for the native firmware in virtual time,
    "simulated:atmega2560" for that board's own on a simulated chip."""
    baud: Annotated[int, Field(gt=0)]
    settle_ms: Annotated[float, Field(ge=0, le=1000)]
    """Wait after a LED is lit before an exposure may begin."""

    @property
    def simulated(self) -> bool:
        return self.port.partition(":")[0] == "simulated"


class CameraConfig(_Section):
    driver: Literal["simulated", "oak", "uvc"]
    device: str = ""
    """Which camera: the id of an OAK (empty: the only one), or a path such as /dev/v4l/by-id/...-index0."""
    lens_position: Annotated[int | None, Field(ge=0, le=1023)] = None
    """Fixed focus in the camera's own steps; leave it out for a lens that cannot be moved."""
    white_balance_k: Annotated[int | None, Field(ge=1000, le=12000)] = None
    """Fixed white balance; leave it out for a camera that has none."""
    bayer: Literal["RGGB", "BGGR", "GRBG", "GBRG"] | None = None
    """Colours of the sensor's upper left four pixels, for a camera that gives raw data."""
    width_px: Annotated[int, Field(ge=64, le=16384)]
    height_px: Annotated[int, Field(ge=64, le=16384)]
    vertical_fov_deg: Annotated[float, Field(gt=1, lt=150)]
    distance_mm: Positive
    """From the origin, which the camera looks at."""
    polar_deg: Annotated[float, Field(ge=0, lt=85)]
    azimuth_deg: Finite
    exposure_us: Annotated[int, Field(gt=0, le=800_000)]
    """At most 0.8 s: the controller puts its LEDs out when its host is silent for a second."""
    gain: Positive
    bit_depth: Annotated[int, Field(ge=8, le=16)]
    gamma: Positive
    """Pixel value = round(full scale x radiance^(1/gamma)); 1 for linear data."""

    @model_validator(mode="after")
    def _raw_is_raw(self) -> Self:
        raw = self.bayer is not None and self.bit_depth == 10 and self.gamma == 1
        if self.driver == "oak" and not raw:
            raise ValueError(
                'driver = "oak" gives raw data: set bayer, bit_depth = 10 and gamma = 1'
            )
        if self.driver == "oak" and self.lens_position is not None and self.lens_position > 255:
            raise ValueError("the lens of an oak camera has the positions 0 to 255")
        return self

    @property
    def focal_px(self) -> float:
        """Focal length in pixels of the undistorted pinhole."""
        return self.height_px / 2 / math.tan(math.radians(self.vertical_fov_deg) / 2)


class LedRing(_Section):
    count: Annotated[int, Field(gt=0, le=64)]
    polar_deg: Annotated[float, Field(ge=0, lt=90)]
    first_azimuth_deg: Finite
    distance_mm: Positive
    """From the origin, which every LED faces with a Lambertian lobe."""
    power: Positive
    """What a white Lambertian patch at the origin facing the LED reads at 10 ms, gain 1."""


class PlatterConfig(_Section):
    """The table's top: eight square markers around the sample, at the sample's underside."""

    dictionary: Literal["DICT_4X4_50", "DICT_APRILTAG_36h11"]
    marker_side_mm: Positive
    marker_offset_mm: Positive
    """Marker centres sit at this times (-1,1) (0,1) (1,1) (1,0) (1,-1) (0,-1) (-1,-1) (-1,0), ids 0 to 7."""
    radius_mm: Positive

    def marker_corners_mm(self) -> Vector:
        """(8, 4, 2) corners in the table's frame at angle 0: top left, top right, bottom right, bottom left."""
        grid = [(-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0)]
        centres = np.array(grid, dtype=float) * self.marker_offset_mm
        corners = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)]) * self.marker_side_mm / 2
        return centres[:, None] + corners[None]


class SimulationConfig(_Section):
    """For a simulated rig alone."""

    truth_seed: Annotated[int, Field(ge=0)]
    """The rig that is simulated differs from this file by errors drawn from this seed."""


class RigConfig(_Section):
    """One rig. `load` reads it from TOML."""

    name: str
    sample: SampleConfig
    controller: ControllerConfig
    camera: CameraConfig
    platter: PlatterConfig
    ring: Annotated[list[LedRing], Field(min_length=1)]
    """LEDs are numbered through the rings in order."""
    simulation: SimulationConfig | None = None
    calibration: Calibration | None = None
    """Read from the file beside the rig's."""
    preset: Annotated[dict[str, Preset], Field(min_length=1)] = {"standard": Preset()}
    """Ways to capture a sample, by name; the first is taken where none is asked for."""

    def preset_named(self, name: str | None) -> Preset:
        """The preset of this name, or the first; ConfigError says which there are."""
        if name is None:
            return next(iter(self.preset.values()))
        if name not in self.preset:
            raise ConfigError(
                f"The rig {self.name} has no preset {name}; choose {', '.join(self.preset)}, "
                f"or add [preset.{name}] to its file."
            )
        return self.preset[name]

    @classmethod
    def load(cls, path: Path) -> "RigConfig":
        """Read and check a rig's TOML, and the calibration beside it if there is one.

        ConfigError names file, key and remedy.
        """
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"Cannot read the rig file {path}: {_reason(error)}.") from error
        try:
            config = cls.model_validate(tomllib.loads(text))
        except tomllib.TOMLDecodeError as error:
            raise ConfigError(f"{path} is not valid TOML: {error}.") from error
        except ValidationError as error:
            raise ConfigError(f"{path}: {_explain(error)}.") from error
        beside = calibration_path(path)
        return config.calibrated(load_calibration(beside)) if beside.exists() else config

    def calibrated(self, calibration: Calibration | None) -> "RigConfig":
        """The same rig with this calibration, or none; ConfigError if it is another rig's."""
        if calibration and (calibration.rig, len(calibration.led)) != (self.name, self.led_count):
            raise ConfigError(
                f"The calibration is of the rig {calibration.rig} with {len(calibration.led)} LEDs, "
                f"not of {self.name} with {self.led_count}; run turnlight calibrate again."
            )
        return self.model_copy(update={"calibration": calibration})

    @property
    def geometry(self) -> Calibration:
        """The calibration; as configured where nothing has been measured."""
        if self.calibration is not None:
            return self.calibration
        return _as_configured(self.name, self.camera, self.platter, tuple(self.ring))

    @property
    def led_count(self) -> int:
        return sum(ring.count for ring in self.ring)

    def camera_position_mm(self, thickness_mm: float) -> Vector:
        """(3,) camera centre, in the world frame of a sample this thick."""
        return np.array(self.geometry.camera.position_mm) - self.lift_mm(thickness_mm)

    def led_positions_mm(self, thickness_mm: float) -> Vector:
        """(leds, 3) LED centres, in the world frame of a sample this thick."""
        positions = np.array([led.position_mm for led in self.geometry.led])
        return positions - self.lift_mm(thickness_mm)

    def led_aims_mm(self, thickness_mm: float) -> Vector:
        """(leds, 3) points that the LEDs' lobes are directed at, in the same frame."""
        aims = np.array([(*led.aim_mm, 0.0) for led in self.geometry.led])
        return aims - self.lift_mm(thickness_mm)

    def led_exponents(self) -> Vector:
        """(leds,) exponents of the cosine lobes; 1 is Lambertian."""
        return np.array([led.exponent for led in self.geometry.led])

    def led_powers(self) -> Vector:
        """(leds,) what white at the reference sample's centre reads, in green, facing each LED."""
        return np.array([led.power for led in self.geometry.led])

    def led_colours(self) -> Vector:
        """(leds, 3) the camera's reading of white under each LED, relative to green."""
        return np.array([led.colour for led in self.geometry.led])

    def marker_corners_mm(self) -> Vector:
        """(8, 4, 2) as `PlatterConfig.marker_corners_mm` has them, where they really are."""
        return np.array(self.geometry.table.marker_corners_mm)

    def lift_mm(self, thickness_mm: float) -> Vector:
        """(3,) how far the sample's surface lies above that of the reference sample."""
        return np.array([0.0, 0.0, thickness_mm - self.sample.reference_thickness_mm])

    def to_sample_frame(self, world_mm: Vector, angle_deg: float) -> Vector:
        """(..., 3) world positions in mm to the frame of the sample turned by angle_deg, in half sides."""
        table = self.geometry.table
        platter = world_mm @ self.platter_rotation(angle_deg) + [*table.axis_mm, 0.0]
        result: Vector = platter / (self.sample.side_mm / 2)
        return result

    def platter_rotation(self, angle_deg: float) -> Vector:
        """(3, 3) from the axes of the platter turned by angle_deg to those of the world."""
        turn = math.radians(angle_deg)
        cosine, sine = math.cos(turn), math.sin(turn)
        rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        along_x, along_y = np.radians(self.geometry.table.tilt_deg)
        tilt = np.asarray(cv2.Rodrigues(np.array([along_y, -along_x, 0.0]))[0], dtype=float)
        return rotation @ tilt


@functools.lru_cache(maxsize=8)  # a plan asks for it thousands of times
def _as_configured(
    name: str, camera: CameraConfig, platter: PlatterConfig, rings: tuple[LedRing, ...]
) -> Calibration:
    rotation, _ = cv2.Rodrigues(_looking_at_origin(camera))
    corners = platter.marker_corners_mm()
    return Calibration(
        rig=name,
        lens=Lens(
            width_px=camera.width_px,
            height_px=camera.height_px,
            focal_px=(camera.focal_px, camera.focal_px),
            centre_px=(camera.width_px / 2, camera.height_px / 2),
        ),
        camera=CameraPose(
            position_mm=_spherical(camera.distance_mm, camera.polar_deg, camera.azimuth_deg),
            rotation_deg=triple(np.degrees(rotation)),
        ),
        table=Table(marker_corners_mm=corners.tolist()),
        led=tuple(
            Led(
                position_mm=_spherical(
                    r.distance_mm, r.polar_deg, r.first_azimuth_deg + i * 360 / r.count
                ),
                power=r.power,
            )
            for r in rings
            for i in range(r.count)
        ),
    )


def _looking_at_origin(camera: CameraConfig) -> Vector:
    """(3, 3) from world to camera axes: what is farther away is higher."""
    outward = np.array(_spherical(1.0, camera.polar_deg, camera.azimuth_deg))
    azimuth = math.radians(camera.azimuth_deg)
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    return np.stack([right, np.cross(-outward, right), -outward])


def _spherical(
    distance_mm: float, polar_deg: float, azimuth_deg: float
) -> tuple[float, float, float]:
    polar, azimuth = math.radians(polar_deg), math.radians(azimuth_deg)
    flat = distance_mm * math.sin(polar)
    return flat * math.cos(azimuth), flat * math.sin(azimuth), distance_mm * math.cos(polar)


def _reason(error: Exception) -> str:
    return error.strerror or str(error) if isinstance(error, OSError) else "it is not UTF-8 text"


def _explain(error: ValidationError) -> str:
    unknown_first = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
    first = unknown_first[0]
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "missing":
        return f"the key {key} is missing; add it (rig_config/simulated.toml shows every key)"
    if first["type"] == "extra_forbidden":
        return f"the key {key} is not known{_suggestion(str(first['loc'][-1]))}"
    if first["type"] == "value_error":
        return f"in {key}, {first['ctx']['error']}"
    return f"{key} = {first['input']!r} will not do: {first['msg'].lower()}"


def _suggestion(name: str) -> str:
    sections: list[type[BaseModel]] = [
        RigConfig, SampleConfig, ControllerConfig, CameraConfig, LedRing, PlatterConfig, Preset,
        SimulationConfig,
    ]  # fmt: skip
    known = [field for section in sections for field in section.model_fields]
    stem = name.rsplit("_", 1)[0]
    same_stem = [field for field in known if field.rsplit("_", 1)[0] == stem]
    close = same_stem or difflib.get_close_matches(name, known, n=1)
    return f"; perhaps {close[0]} is meant (units are part of the name)" if close else ""
