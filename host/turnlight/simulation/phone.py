"""A simulated phone: photographs of a sample inside the printed frame, on a desk.

Limits: no interreflection, no depth of field, paper and desk are matt.
"""

import io
import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage

from svbrdf.maps import Maps
from svbrdf.renderer import render
from turnlight.picture.marked_frame import MarkedFrame
from turnlight.picture.pinhole import Lens, Matrix, Pose, distort, grid_to_plane, project, undistort
from turnlight.picture.warp import NODE_PX, Image, dense

FULL_FRAME_DIAGONAL_MM = 43.2666
JPEG_QUALITY = 85
_IRRADIANCE_GRID = 96
_REACH = 3.0
"""Half side of the desk that light is worked out for, in sides of the frame."""
_PAPER_PER_MM = 10.0
_PAGE_MARGIN_MM = 12.0
_BAND_ROWS = 128
Sensor = Callable[[int, int], Image]
"""The light on a sensor's rows, from a first to before a last one: (rows, width, 3) linear."""
_FOCAL_35, _MAKE, _MODEL, _EXIF = 0xA405, 0x010F, 0x0110, 0x8769


@dataclass(frozen=True)
class Phone:
    """lens: of the sensor at full size. flash_mm: (2,) of its flash from its lens, x right, y down."""

    width_px: int
    height_px: int
    lens: Lens
    flash_mm: Matrix
    model: str
    tells_focal: bool = True


@dataclass(frozen=True)
class Conditions:
    """How one photo is taken.

    pose: the frame's, to the camera's axes, mm. light_mm: of a lamp in the frame's coordinates, None for
    the phone's own flash. shadow: a hand's (reach, width, direction): mm past the opening's edge that it
    comes, mm, radians; darkness is what is left of the light. motion_px, motion_rad: what the hand moved
    during the exposure. exposure: reading of bare white paper at the middle. ambient: share of the light.
    hidden: places of markers that something covers. sunk_mm: how far the sample lies below the frame.
    sample_blur: of the sample alone, in shares of its side.
    """

    pose: Pose
    light_mm: Matrix | None = None
    exposure: float = 0.6
    ambient: float = 0.03
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    blur_px: float = 0.8
    motion_px: float = 0.0
    motion_rad: float = 0.0
    shadow: tuple[float, float, float] | None = None
    darkness: float = 0.4
    hidden: tuple[int, ...] = ()
    noise: float = 0.01
    sunk_mm: float = 0.0
    sample_blur: float = 0.0


@dataclass(frozen=True)
class PhoneShot:
    """A photo and the truth about it.

    jpeg: the file. corners_px: (8, 4, 2) of the markers on its pixels. light, view: (3,) in half sides.
    ideal: (n, n, 3) linear, what a perfect rectification of a perfect sensor gives, without tint.
    white: (n, n, 1) what a white patch that faces the light reads, without tint.
    """

    jpeg: bytes
    corners_px: Matrix
    light: npt.NDArray[np.float32]
    view: npt.NDArray[np.float32]
    ideal: Image
    white: Image


def phone(rng: np.random.Generator, width_px: int = 4032, height_px: int = 3024) -> Phone:
    """A phone like those that are sold: 24 to 28 mm equivalent, up to 3 % of distortion."""
    diagonal = math.hypot(width_px, height_px)
    focal = diagonal / FULL_FRAME_DIAGONAL_MM * rng.uniform(24, 28)
    centre = np.array([width_px, height_px]) * (0.5 + rng.normal(0, 0.003, 2))
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1.0]])
    distortion = np.array([rng.uniform(-0.06, 0.06), rng.uniform(-0.02, 0.02), 0, 0, 0])
    flash = np.array([rng.uniform(8, 18), rng.uniform(-8, 8)])
    return Phone(
        width_px, height_px, Lens(matrix, distortion), flash, f"Phone {rng.integers(1000)}"
    )


def pose(
    rng: np.random.Generator, phone: Phone, frame: MarkedFrame, elevation_deg: float, fill: float
) -> Pose:
    """Looking at the frame from a random side. fill: of the picture's height, what the frame takes."""
    azimuth, roll = rng.uniform(0, 2 * math.pi), rng.normal(0, 0.15)
    elevation = math.radians(elevation_deg)
    distance = phone.lens.matrix[0, 0] * frame.outer_mm / (fill * phone.height_px)
    away = np.array([
        math.cos(elevation) * math.cos(azimuth),
        math.cos(elevation) * math.sin(azimuth),
        math.sin(elevation),
    ])  # fmt: skip
    forward = -away
    up = np.array([0, 0, 1.0]) if elevation_deg < 80 else np.array([-away[0], -away[1], 0])
    if np.linalg.norm(np.cross(forward, up)) < 1e-6:
        up = np.array([0, 1.0, 0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    turn = np.array([
        [math.cos(roll), -math.sin(roll), 0],
        [math.sin(roll), math.cos(roll), 0],
        [0, 0, 1],
    ])  # fmt: skip
    rotation = turn @ np.stack([right, down, forward])
    aim = np.append(rng.normal(0, 0.03, 2) * frame.side_mm, 0)
    return rotation, -rotation @ (aim + away * distance)


def photograph(
    phone: Phone,
    frame: MarkedFrame,
    material: Maps,
    how: Conditions,
    rng: np.random.Generator,
    *,
    resolution: int = 512,
    reflectance: float = 0.85,
) -> PhoneShot:
    """Take one photo."""
    rotation, translation = how.pose
    half = frame.side_mm / 2
    camera_mm = -rotation.T @ translation
    light_mm = how.light_mm
    if light_mm is None:
        light_mm = camera_mm + rotation.T @ np.append(phone.flash_mm, 0)
    reach = _REACH * frame.outer_mm / 2
    lit = _let_through(how, frame, reach)
    cosine = light_mm[2] / np.linalg.norm(light_mm)
    level = how.exposure / reflectance / cosine * np.dot(light_mm, light_mm)
    light = (light_mm / half).astype(np.float32)
    view = (camera_mm / half).astype(np.float32)
    direct, ambient = (1 - how.ambient) * level, how.ambient * how.exposure / reflectance
    sample, white = _sample(material, light, view, half, lit, direct, ambient, reach)
    lit_desk = _flat(lit, light_mm, reach) * direct + ambient
    sensor = _sensor(phone, frame, how, rng, reach, lit_desk, sample, reflectance)
    homography = phone.lens.matrix @ np.column_stack([rotation[:, :2], translation])
    corners = distort(phone.lens, project(homography, frame.marker_corners_mm()))
    small = (resolution, resolution)
    return PhoneShot(
        _jpeg(phone, _developed(phone, sensor, how, rng)),
        corners,
        light,
        view,
        _float(cv2.resize(sample, small, interpolation=cv2.INTER_AREA)),
        _float(cv2.resize(white, small, interpolation=cv2.INTER_AREA))[..., None],
    )


def _grid(reach: float, size: int) -> Matrix:
    """(size, size, 2) mm of the desk's points, row 0 at +y."""
    pixels = np.stack(np.meshgrid(*[np.arange(size) + 0.5] * 2), axis=-1)
    return project(grid_to_plane(2 * reach, size), pixels)


def _let_through(how: Conditions, frame: MarkedFrame, reach: float) -> Image:
    """(g, g) share of the light that the hand lets through."""
    points = _grid(reach, 4 * _IRRADIANCE_GRID)
    through = np.ones(points.shape[:2], np.float32)
    if how.shadow is not None:
        past_mm, width_mm, direction = how.shadow
        toward = np.array([math.cos(direction), math.sin(direction)])
        along = points @ toward
        across = points @ np.array([-toward[1], toward[0]])
        tip = frame.side_mm / 2 - past_mm
        outside = np.hypot(np.minimum(along - tip, 0), across) - width_mm / 2
        covered = np.clip(0.5 - outside / 6.0, 0, 1)
        through -= ((1 - how.darkness) * covered).astype(np.float32)
    return through


def _flat(through: Image, light_mm: Matrix, reach: float) -> Image:
    """(g, g) what a patch in the desk's plane receives of a light of unit power, mm^-2."""
    offset = light_mm - np.concatenate([
        _grid(reach, len(through)), np.zeros((*through.shape, 1))
    ], axis=-1)  # fmt: skip
    square = np.sum(offset**2, axis=-1)
    return np.asarray(through * offset[..., 2] / square**1.5, np.float32)


def _sample(
    material: Maps,
    light: npt.NDArray[np.float32],
    view: npt.NDArray[np.float32],
    half: float,
    through: Image,
    direct: float,
    ambient: float,
    reach: float,
) -> tuple[Image, Image]:
    """The sample's radiance (n, n, 3) and what white that faces the light reads (n, n)."""
    size = material.resolution[0]
    points = _grid(half, size)
    offset = light * half - np.concatenate([points, np.zeros((size, size, 1))], axis=-1)
    white = direct / np.sum(offset**2, axis=-1)
    at = ((points * [1, -1] / reach + 1) / 2 * len(through) - 0.5).astype(np.float32)
    shade = cv2.remap(through, at[..., 0], at[..., 1], cv2.INTER_LINEAR)
    radiance = render(material, light, view, np.float32(math.pi) * (white * shade)[..., None])
    albedo = material.diffuse * (1 - material.specular) + material.specular
    return np.asarray(radiance + ambient * albedo, np.float32), white.astype(np.float32)


def _sensor(
    phone: Phone,
    frame: MarkedFrame,
    how: Conditions,
    rng: np.random.Generator,
    reach: float,
    irradiance: Image,
    sample: Image,
    reflectance: float,
) -> Sensor:
    rotation, translation = how.pose
    printed = _printed(frame, how.hidden) * np.float32(reflectance)
    grain = cv2.GaussianBlur(rng.random((512, 512), np.float32), (0, 0), 3) * np.float32(0.8)
    edge = frame.outer_mm / 2 + _PAGE_MARGIN_MM
    if how.sample_blur > 0:
        sample = _float(cv2.GaussianBlur(sample, (0, 0), how.sample_blur * len(sample)))

    def places(height_mm: float, top: int, rows: int) -> Image:
        origin = translation + rotation[:, 2] * height_mm
        back = np.linalg.inv(phone.lens.matrix @ np.column_stack([rotation[:, :2], origin]))
        return dense(
            lambda p: project(back, undistort(phone.lens, p + np.array([0, top]))),
            phone.width_px,
            rows,
        )

    def rows(top: int, bottom: int) -> Image:
        at = places(0, top, bottom - top)
        x, y = np.abs(at[..., 0]), np.abs(at[..., 1])
        albedo = _seen(grain, at, frame.outer_mm, cv2.BORDER_WRAP)
        page = (x < edge) & (y < edge)
        columns = _columns(page)
        paper = _seen(printed, at[:, columns], frame.outer_mm / 2)
        albedo[:, columns] = np.where(page[:, columns], paper, albedo[:, columns])
        albedo *= _seen(irradiance, at, reach)
        image = np.repeat(albedo[..., None], 3, axis=-1)
        inside = (x < frame.side_mm / 2) & (y < frame.side_mm / 2)
        columns = _columns(inside)
        below = at if how.sunk_mm == 0 else places(-how.sunk_mm, top, bottom - top)
        shown = _seen(sample, below[:, columns], frame.side_mm / 2)
        image[:, columns] = np.where(inside[:, columns, None], shown, image[:, columns])
        return image

    return rows


def _printed(frame: MarkedFrame, hidden: tuple[int, ...]) -> Image:
    printed = frame.draw(_PAPER_PER_MM)
    for place in hidden:
        left, low = frame.marker_corners_mm()[place, 3] + frame.outer_mm / 2
        side = frame.marker_mm
        rows = slice(
            round((frame.outer_mm - low - side) * _PAPER_PER_MM),
            round((frame.outer_mm - low) * _PAPER_PER_MM),
        )
        printed[rows, round(left * _PAPER_PER_MM) : round((left + side) * _PAPER_PER_MM)] = 0.5
    return printed


def _seen(
    texture: Image, places: Image, half_side: float, border: int = cv2.BORDER_REPLICATE
) -> Image:
    """A texture about the middle of the desk, at places in mm."""
    if places.size == 0:
        return np.zeros((*places.shape[:2], *texture.shape[2:]), np.float32)
    scale = np.float32(texture.shape[0] / (2 * half_side))
    at = places * np.array([scale, -scale], np.float32)
    at += np.float32(texture.shape[0] / 2 - 0.5)
    seen = cv2.remap(texture, at, None, cv2.INTER_LINEAR, borderMode=border)  # type: ignore[call-overload]
    return np.asarray(seen, np.float32)


def _columns(mask: npt.NDArray[np.bool_]) -> slice:
    """Those in which there is any."""
    found = np.flatnonzero(mask.any(axis=0))
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 0)


def _developed(
    phone: Phone, sensor: Sensor, how: Conditions, rng: np.random.Generator
) -> npt.NDArray[np.uint8]:
    """In bands of rows, because large arrays are slow."""
    width, height = phone.width_px, phone.height_px
    tile = rng.standard_normal((height // 4 + 1, width // 4 + 1, 3), np.float32)
    tile = np.tile(tile * np.float32(how.noise), (1, 4, 1))[:, :width]
    margin = math.ceil(how.motion_px / 2) + math.ceil(5 * how.blur_px)
    pixels = np.empty((height, width, 3), np.uint8)
    for top in range(0, height, _BAND_ROWS):
        bottom = min(top + _BAND_ROWS, height)
        first = max(top - margin, 0) // NODE_PX * NODE_PX
        image = sensor(first, min(bottom + margin, height))
        if how.motion_px > 0:
            image = _float(cv2.filter2D(image, -1, _streak(how.motion_px, how.motion_rad)))
        image = _float(cv2.GaussianBlur(image, (0, 0), how.blur_px))[top - first : bottom - first]
        image *= np.array(how.tint, np.float32)
        noise = tile[np.arange(top, bottom) % len(tile)]
        image += noise * np.sqrt(np.maximum(image, 0) + np.float32(0.01))
        pixels[top:bottom] = _coded(image)
    return pixels


def _streak(length_px: float, angle: float) -> Image:
    size = 2 * math.ceil(length_px / 2) + 3
    kernel = np.zeros((size, size), np.float32)
    middle = size / 2 - 0.5
    step = np.array([math.cos(angle), math.sin(angle)]) * length_px / 2
    ends = [tuple(np.rint((middle + s * step) * 256).astype(int).tolist()) for s in (-1, 1)]
    cv2.line(kernel, ends[0], ends[1], (1.0,), 1, cv2.LINE_AA, 8)
    return np.asarray(kernel / kernel.sum(), np.float32)


def _float(image: npt.NDArray[np.integer | np.floating]) -> Image:
    return np.asarray(image, np.float32)


def _coded(linear: Image) -> npt.NDArray[np.uint8]:
    """sRGB, 8 bit, through a table."""
    levels = np.arange(4097) / 4096
    coded = np.where(levels <= 0.0031308, 12.92 * levels, 1.055 * levels ** (1 / 2.4) - 0.055)
    table = np.rint(coded * 255).astype(np.uint8)
    return np.asarray(table[(np.clip(linear, 0, 1) * 4096 + 0.5).astype(np.uint16)])


def _jpeg(phone: Phone, pixels: npt.NDArray[np.uint8]) -> bytes:
    exif = PillowImage.Exif()
    exif[_MAKE], exif[_MODEL] = "Simulated", phone.model
    if phone.tells_focal:
        diagonal = math.hypot(phone.width_px, phone.height_px)
        equivalent = phone.lens.matrix[0, 0] / diagonal * FULL_FRAME_DIAGONAL_MM
        exif.get_ifd(_EXIF)[_FOCAL_35] = round(equivalent)
    file = io.BytesIO()
    PillowImage.fromarray(pixels).save(file, "JPEG", quality=JPEG_QUALITY, exif=exif)
    return file.getvalue()
