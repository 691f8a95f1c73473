from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from svbrdf.maps import Maps, flat
from svbrdf.renderer import render
from turnlight.config import RigConfig
from turnlight.errors import ImageError
from turnlight.frame import Exposure, Frame
from turnlight.picture.pinhole import plane_homography, platter_pose, project
from turnlight.picture.rectify import ambient, rectify
from turnlight.picture.warp import Image
from turnlight.simulation.camera import develop
from turnlight.simulation.optics import scene, sensor_radiance

ROOT = Path(__file__).parents[3]
LED = 5
TEN_MS = Exposure(10_000, 1.0)
RESOLUTION = 256


def rig(width: int = 1014, height: int = 760) -> RigConfig:
    config = RigConfig.load(ROOT / "rig_config/simulated.toml")
    camera = config.camera.model_copy(update={"width_px": width, "height_px": height})
    return config.model_copy(update={"camera": camera})


@cache
def lettered() -> Maps:
    """No symmetry in it: an F of another colour, a shiny disc, bumps everywhere."""
    maps = flat(RESOLUTION, RESOLUTION, roughness=0.6)
    paint = np.full((RESOLUTION, RESOLUTION, 3), 70, np.uint8)
    cv2.putText(paint, "F", (40, 130), cv2.FONT_HERSHEY_SIMPLEX, 4.0, (200, 120, 40), 16)
    diffuse = cv2.GaussianBlur(paint, (0, 0), 1.0).astype(np.float32) / 255
    gloss = cv2.circle(np.ones((RESOLUTION, RESOLUTION), np.float32), (190, 190), 40, 0.5, -1)
    random = np.random.default_rng(0)
    slopes = cv2.GaussianBlur(random.normal(size=(RESOLUTION, RESOLUTION, 2)), (0, 0), 4.0)
    normal = np.concatenate([slopes * 2, np.ones((RESOLUTION, RESOLUTION, 1))], axis=-1)
    normal = (normal / np.linalg.norm(normal, axis=-1, keepdims=True)).astype(np.float32)
    roughness = (maps.roughness[..., 0] * cv2.GaussianBlur(gloss, (0, 0), 1.0))[..., None]
    return Maps(normal, diffuse, roughness.astype(np.float32), maps.specular)


def photograph(
    config: RigConfig,
    angle_deg: float,
    *,
    thickness_mm: float = 2.0,
    lit: bool = True,
    exposure: Exposure = TEN_MS,
    hidden: tuple[int, ...] = (),
    seed: int = 0,
) -> Frame:
    leds = tuple(255 if lit and i == LED else 0 for i in range(config.led_count))
    radiance = sensor_radiance(scene(config, lettered(), thickness_mm), angle_deg, leds)
    to_pixels = plane_homography(config, platter_pose(config, angle_deg), 0.0)
    for corners in config.platter.marker_corners_mm()[list(hidden)]:
        quad = project(to_pixels, corners).astype(int)
        cv2.fillConvexPoly(radiance, quad, (0.4, 0.4, 0.4))
    camera = config.camera
    pixels = develop(radiance, camera, exposure, np.random.default_rng(seed))
    return Frame(pixels, camera.bit_depth, camera.gamma, exposure, 0)


def ideal(config: RigConfig, angle_deg: float, thickness_mm: float = 2.0) -> Image:
    """The same shot rendered already rectified: light and view in the sample's frame alone."""
    led = config.led_positions_mm(thickness_mm)[LED]
    light = config.to_sample_frame(led, angle_deg)
    view = config.to_sample_frame(config.camera_position_mm(thickness_mm), angle_deg)
    half_side = config.sample.side_mm / 2
    x = (np.arange(RESOLUTION) + 0.5) / RESOLUTION * 2 - 1
    points = np.stack([*np.meshgrid(x, -x), np.zeros((RESOLUTION, RESOLUTION))], axis=-1)
    offset = (light - points) * half_side
    distance = np.linalg.norm(offset, axis=-1, keepdims=True)
    target = config.to_sample_frame(-config.lift_mm(thickness_mm), angle_deg)
    axis = (light - target) / np.linalg.norm(light - target)
    irradiance = np.pi * (250 / distance) ** 2 * (offset / distance @ axis)[..., None]
    return np.asarray(render(lettered(), light, view, irradiance), np.float32)


def psnr(image: Image, reference: Image) -> float:
    error = (image - np.clip(reference, 0, 1))[2:-2, 2:-2]
    return float(-10 * np.log10(np.mean(error**2)))


def off_by(measured_deg: float, angle_deg: float) -> float:
    return abs((measured_deg - angle_deg + 180) % 360 - 180)


@pytest.mark.parametrize("angle_deg", [0.0, 37.3, 90.0, 179.98, 180.0, -91.5, 359.99, 700.0])
def test_picture_is_the_samples_own_render_at_any_angle(angle_deg: float) -> None:
    config = rig()
    frame = photograph(config, angle_deg)
    dark = photograph(config, 0.0, lit=False, seed=1)
    result = rectify(frame, dark, config, 2.0, RESOLUTION)
    assert psnr(result.picture.image, ideal(config, angle_deg)) > 41
    assert off_by(result.measured_angle_deg, angle_deg) < 0.005
    assert -180 <= result.measured_angle_deg <= 180
    assert result.markers_seen == 8
    assert result.marker_residual_px < 0.1


def test_the_full_sensor_sees_sharper() -> None:
    config = rig(4056, 3040)
    frame = photograph(config, 25.0)
    dark = photograph(config, 0.0, lit=False, seed=1)
    result = rectify(frame, dark, config, 2.0, RESOLUTION)
    assert psnr(result.picture.image, ideal(config, 25.0)) > 43.5
    assert off_by(result.measured_angle_deg, 25.0) < 0.005


def test_black_is_zero_in_the_mean() -> None:
    config = rig()
    frames = [photograph(config, 10.0, lit=False, seed=seed) for seed in (0, 1)]
    image = rectify(*frames, config, 2.0, RESOLUTION).picture.image
    assert image.min() < 0 < image.max()
    assert abs(image.mean()) < 2e-5


@pytest.mark.parametrize("thickness_mm", [0.0, 2.0, 12.0])
def test_thickness_is_handled(thickness_mm: float) -> None:
    config = rig()
    frame = photograph(config, 50.0, thickness_mm=thickness_mm)
    dark = photograph(config, 50.0, thickness_mm=thickness_mm, lit=False)
    reference = ideal(config, 50.0, thickness_mm)
    right = rectify(frame, dark, config, thickness_mm, RESOLUTION).picture.image
    wrong = rectify(frame, dark, config, thickness_mm + 0.5, RESOLUTION).picture.image
    assert psnr(right, reference) > 41
    assert psnr(wrong, reference) < psnr(right, reference) - 9


@pytest.mark.parametrize("hidden", [(0, 1, 2, 3), (0, 2, 4, 6), (3, 4, 5, 6, 7)])
def test_half_the_markers_and_more_may_be_hidden(hidden: tuple[int, ...]) -> None:
    config = rig()
    frame = photograph(config, -33.0, hidden=hidden)
    result = rectify(frame, photograph(config, 0.0, lit=False), config, 2.0, RESOLUTION)
    assert result.markers_seen == 8 - len(hidden)
    assert off_by(result.measured_angle_deg, -33.0) < 0.03
    assert psnr(result.picture.image, ideal(config, -33.0)) > 40


def test_a_marker_in_the_wrong_place_is_left_out() -> None:
    config = rig()
    frame = photograph(config, 0.0)
    pixels = frame.pixels.copy()
    quad = project(
        plane_homography(config, platter_pose(config, 0.0), 0.0),
        config.platter.marker_corners_mm()[3],
    )
    left, top = quad.min(axis=0).astype(int) - 5
    right, bottom = quad.max(axis=0).astype(int) + 6
    pixels[top + 25 : bottom + 25, left:right] = frame.pixels[top:bottom, left:right]
    pixels[top : top + 25, left:right] = frame.pixels[top, left]
    result = rectify(replace(frame, pixels=pixels), None, config, 2.0, RESOLUTION)
    assert result.markers_seen == 7
    assert off_by(result.measured_angle_deg, 0.0) < 0.03


def test_too_few_markers_is_one_clear_sentence() -> None:
    config = rig()
    frame = photograph(config, 0.0, hidden=(0, 1, 2, 3, 4, 5))
    with pytest.raises(ImageError, match=r"Only 2 of the platter's markers .* 3 are needed"):
        rectify(frame, None, config, 2.0, RESOLUTION)
    black = replace(frame, pixels=np.zeros_like(frame.pixels))
    with pytest.raises(ImageError, match="Only 0 "):
        rectify(black, None, config, 2.0, RESOLUTION)


def test_gain_undoes_exposure_and_gain() -> None:
    config = rig()
    long = photograph(config, 0.0, exposure=Exposure(4_000, 1.0))
    short = photograph(config, 0.0, exposure=Exposure(1_000, 2.0))
    first = rectify(long, None, config, 2.0, 64).picture
    second = rectify(short, None, config, 2.0, 64).picture
    assert (first.gain, second.gain) == pytest.approx((2.5, 5.0))
    np.testing.assert_allclose(first.image * first.gain, second.image * second.gain, atol=0.05)


def test_dark_is_subtracted_and_never_below_zero() -> None:
    config = rig()
    dark = photograph(config, 0.0, lit=False)
    with_ambient = rectify(photograph(config, 0.0), None, config, 2.0, 64).picture.image
    without = rectify(photograph(config, 0.0), dark, config, 2.0, 64).picture.image
    albedo = cv2.resize(lettered().diffuse * 0.96 + 0.04, (64, 64), interpolation=cv2.INTER_AREA)
    unclipped = with_ambient.max(axis=-1) < 0.95
    np.testing.assert_allclose(
        (with_ambient - without)[unclipped], 0.02 * albedo[unclipped], atol=0.004
    )
    nothing = rectify(dark, dark, config, 2.0, 64).picture.image
    assert nothing.min() == 0
    assert nothing.max() < 1e-6


def test_a_dark_frame_prepared_once_serves_every_frame_like_it() -> None:
    config = rig()
    dark = photograph(config, 0.0, lit=False)
    prepared = ambient(dark, config, 2.0, 64)
    for angle_deg in (0.0, 37.3):
        frame = photograph(config, angle_deg)
        once = rectify(frame, dark, config, 2.0, 64).picture.image
        assert np.array_equal(rectify(frame, prepared, config, 2.0, 64).picture.image, once)
    longer = photograph(config, 0.0, exposure=Exposure(20_000, 1.0))
    with pytest.raises(ImageError, match="same exposure and gain"):
        rectify(longer, prepared, config, 2.0, 64)


def test_a_dark_frame_without_visible_markers_is_subtracted_as_it_is() -> None:
    config = rig()
    frame = photograph(config, 10.0)
    black = replace(frame, pixels=np.full_like(frame.pixels, 4095 // 8))
    assert ambient(black, config, 2.0, 64) is None
    lifted = rectify(frame, black, config, 2.0, 64).picture.image
    plain = rectify(frame, None, config, 2.0, 64).picture.image
    np.testing.assert_allclose(lifted, np.maximum(plain - 0.125**2.2, 0), atol=1e-4)


def test_what_the_sensor_did_not_see_is_not_valid() -> None:
    config = rig()
    camera = config.camera.model_copy(update={"vertical_fov_deg": 12.0})
    sample = config.sample.model_copy(update={"side_mm": 100.0})
    platter = config.platter.model_copy(
        update={"marker_offset_mm": 20.0, "marker_side_mm": 10.0, "radius_mm": 40.0}
    )
    near = config.model_copy(update={"camera": camera, "platter": platter, "sample": sample})
    target = near.model_copy(update={"sample": sample.model_copy(update={"side_mm": 10.0})})
    picture = rectify(photograph(target, 0.0), None, near, 2.0, 64).picture
    assert not picture.valid[0, 0] and not picture.valid[-1, -1]
    assert picture.valid[32, 32]
    assert (picture.image[~picture.valid] == 0).all()
    everything = rectify(photograph(config, 0.0), None, config, 2.0, 64).picture
    assert everything.valid.all()


def test_clipped_pixels_stay_valid() -> None:
    config = rig()
    picture = rectify(
        photograph(config, 0.0, exposure=Exposure(40_000, 1.0)), None, config, 2.0, 64
    ).picture
    assert picture.image.max() == pytest.approx(1.0)
    assert picture.valid.all()


def test_clipped_is_said_of_every_value_that_draws_on_a_clipped_pixel() -> None:
    config = rig()
    exposure, short = Exposure(15_000, 1.0), Exposure(3_000, 1.0)
    picture = rectify(photograph(config, 0.0, exposure=exposure), None, config, 2.0, 256).picture
    unclipped = rectify(photograph(config, 0.0, exposure=short), None, config, 2.0, 256).picture
    assert not unclipped.clipped.any()
    assert 0.01 < picture.clipped.mean() < 0.5
    bright = (unclipped.image * 5).max(axis=-1)
    assert picture.clipped[bright > 1.2].all()
    inside = np.s_[4:-4, 4:-4]  # at the edge a value draws on the paper beside it, which clips
    around = cv2.dilate(bright, np.ones((7, 7)))
    assert not picture.clipped[inside][around[inside] < 0.7].any()


def test_frames_that_do_not_fit_are_refused() -> None:
    config = rig()
    frame = photograph(config, 0.0)
    with pytest.raises(ImageError, match="1014x760 pixels but the rig file says 507x380"):
        rectify(frame, None, rig(507, 380), 2.0, 64)
    other = replace(frame, exposure=Exposure(5_000, 1.0))
    with pytest.raises(ImageError, match="same exposure and gain"):
        rectify(frame, other, config, 2.0, 64)


def test_dtypes_and_shapes() -> None:
    config = rig()
    picture = rectify(photograph(config, 0.0), None, config, 2.0, 100).picture
    assert picture.image.shape == (100, 100, 3)
    assert picture.image.dtype == np.float32
    assert picture.valid.shape == (100, 100)
    assert picture.valid.dtype == np.bool_
    assert picture.clipped.shape == (100, 100)
    assert picture.clipped.dtype == np.bool_
