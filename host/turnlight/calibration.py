"""What was measured of a rig: a versioned TOML file beside the rig's own, with an uncertainty per number.

Frames: the world of the reference sample (its z axis is the table's axis), and the platter's, which is
that of its printed markers. Every `_sigma` is one standard deviation in the unit of its number; 0 says
that the number is the configured one and was not measured.
"""

import tomllib
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from turnlight.errors import ConfigError

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Sigma = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Pair = tuple[Finite, Finite]
Triple = tuple[Finite, Finite, Finite]
Quintuple = tuple[Finite, Finite, Finite, Finite, Finite]
StepName = Literal["dark", "geometry", "lights", "white", "colour"]


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Measured(_Section):
    """When one step of the calibration was done, and what it saw."""

    date: datetime
    text: str


class Lens(_Section):
    """Pinhole with Brown-Conrady distortion, as OpenCV has it, for a sensor of the given size."""

    width_px: Positive
    height_px: Positive
    focal_px: Pair
    focal_sigma_px: Pair = (0, 0)
    centre_px: Pair
    """Continuous: the first pixel's centre is at 1/2."""
    centre_sigma_px: Pair = (0, 0)
    distortion: Quintuple = (0, 0, 0, 0, 0)
    """k1, k2, p1, p2, k3."""
    distortion_sigma: Quintuple = (0, 0, 0, 0, 0)
    vignetting: Pair = (0, 0)
    """a, b of 1 + a r^2 + b r^4, what a pixel reads relative to the centre; r is 1 in the corners."""
    vignetting_sigma: Pair = (0, 0)


class CameraPose(_Section):
    """Where the camera stands in the world, and how it is turned: rotation vector, world to camera axes
    (x right, y down, z forward).
    """

    position_mm: Triple
    position_sigma_mm: Triple = (0, 0, 0)
    rotation_deg: Triple
    rotation_sigma_deg: Triple = (0, 0, 0)


class Table(_Section):
    """How the platter sits on its axis, and where its markers are."""

    axis_mm: Pair = (0, 0)
    """Where the axis passes through the platter's top, in the platter's frame."""
    axis_sigma_mm: Pair = (0, 0)
    tilt_deg: Pair = (0, 0)
    """Slope of the platter's top against the plane normal to the axis, along the platter's x and y."""
    tilt_sigma_deg: Pair = (0, 0)
    radial_runout_mm: Finite = 0
    """Largest shift of the platter from its mean circle that was seen in a turn."""
    marker_corners_mm: tuple[tuple[Pair, Pair, Pair, Pair], ...]
    marker_sigma_mm: Sigma = 0


class Led(_Section):
    """One LED; its light falls off with the square of the distance and cos^exponent about its aim."""

    position_mm: Triple
    position_sigma_mm: Triple = (0, 0, 0)
    aim_mm: Pair = (0, 0)
    """Where on the reference sample's plane the LED's lobe points."""
    aim_sigma_mm: Pair = (0, 0)
    exponent: Positive = 1
    exponent_sigma: Sigma = 0
    power: Positive
    """What a white Lambertian patch at the origin facing the LED reads in green at 10 ms, gain 1."""
    power_sigma: Sigma = 0
    colour: Triple = (1, 1, 1)
    """The camera's reading of white by channel, relative to green."""
    colour_sigma: Triple = (0, 0, 0)
    flat_field_residual: Sigma = 0
    """Root mean square of what this model leaves of the white target, relative."""


class Dark(_Section):
    """What the camera reads without light, linear, as a share of full scale; and its noise per pixel."""

    level: Triple = (0, 0, 0)
    level_sigma: Triple = (0, 0, 0)
    noise: Sigma = 0
    room: Triple = (0, 0, 0)
    """What the room's light adds on white, at 10 ms, gain 1."""


class Colour(_Section):
    """From the camera's white-balanced linear RGB to linear sRGB; every row adds up to 1."""

    matrix: tuple[Triple, Triple, Triple]
    matrix_sigma: tuple[Triple, Triple, Triple]
    delta_e00_mean: Sigma
    """CIEDE2000 over the chart's patches, each predicted without itself."""
    delta_e00_max: Sigma


class Calibration(_Section):
    """A rig's calibration; `measured` names the steps behind it, the rest is as configured."""

    format: Literal[1] = 1
    rig: str
    measured: Mapping[StepName, Measured] = {}
    lens: Lens
    camera: CameraPose
    table: Table
    led: tuple[Led, ...]
    paper: Sigma = 0
    """Reflectance of the platter's bare paper, by which a check shot knows the lights again."""
    dark: Dark = Dark()
    colour: Colour | None = None


def calibration_path(rig_file: Path) -> Path:
    """my_rig.toml has its calibration in my_rig.calibration.toml."""
    return rig_file.with_suffix(".calibration.toml")


def load_calibration(path: Path) -> Calibration:
    """Read and check a calibration file; ConfigError says what is wrong and what to do."""
    try:
        return Calibration.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"Cannot read the calibration {path}: {error}.") from error
    except tomllib.TOMLDecodeError as error:
        raise _unusable(path, str(error)) from error
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise _unusable(path, f"{key}: {first['msg'].lower()}") from error


def encode_calibration(calibration: Calibration) -> bytes:
    """The calibration file's content; numbers to nine digits."""
    content = _rounded(calibration.model_dump(exclude_none=True))
    heading = (
        f"# Measured by `turnlight calibrate` on the rig {calibration.rig}; not to be edited.\n"
    )
    assert isinstance(content, dict)
    return (heading + tomli_w.dumps(content)).encode()


def triple(values: npt.ArrayLike) -> tuple[float, float, float]:
    """Three numbers of an array."""
    x, y, z = np.ravel(np.asarray(values, dtype=float)).tolist()
    return x, y, z


def _rounded(value: object) -> object:
    match value:
        case dict():
            return {key: _rounded(item) for key, item in value.items()}
        case tuple() | list():
            return [_rounded(item) for item in value]
        case float():
            return float(f"{value:.9g}")
        case _:
            return value


def _unusable(path: Path, reason: str) -> ConfigError:
    return ConfigError(
        f"{path} cannot be used ({reason}); run turnlight calibrate again, or move it away to work "
        "with the configured geometry."
    )
