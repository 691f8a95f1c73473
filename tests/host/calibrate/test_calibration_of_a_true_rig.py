"""What the issue asks of a calibration, on a simulated rig whose truth differs from its configuration."""

from datetime import UTC, datetime, timedelta

import cv2
import numpy as np
import pytest

from turnlight.calibrate.check import check, judge
from turnlight.calibrate.colour import delta_e00, lab
from turnlight.calibration import Measured
from turnlight.config import RigConfig
from turnlight.errors import CalibrationError
from turnlight.frame import Exposure
from turnlight.picture.lighting import lighting
from turnlight.picture.pinhole import camera_rotation, distort, lens
from turnlight.picture.rectify import rectify
from turnlight.simulation.sample import FlatSample
from turnlight.simulation.targets import white_board

from .conftest import Calibrated, calibrate, workshop


def directions_off_deg(config: RigConfig, truth: RigConfig) -> np.ndarray:
    found, real = config.led_positions_mm(2.0), truth.led_positions_mm(2.0)
    return np.degrees(
        np.arctan2(np.linalg.norm(np.cross(found, real), axis=1), np.sum(found * real, axis=1))
    )


def powers_off(config: RigConfig, truth: RigConfig) -> np.ndarray:
    return np.abs(config.led_powers() / truth.led_powers() - 1)


def camera_off_deg(config: RigConfig, truth: RigConfig) -> float:
    turn = camera_rotation(config) @ camera_rotation(truth).T
    return float(np.degrees(np.linalg.norm(cv2.Rodrigues(turn)[0])))


def axis_off_mm(config: RigConfig, truth: RigConfig) -> float:
    found, real = config.geometry.table.axis_mm, truth.geometry.table.axis_mm
    return float(np.linalg.norm(np.subtract(found, real)))


@pytest.mark.timeout(400)
def test_the_rig_is_found_as_it_is(calibrated: Calibrated) -> None:
    config, truth = calibrated.config, calibrated.truth
    assert directions_off_deg(config, truth).max() < 1.0
    assert powers_off(config, truth).max() < 0.02
    assert axis_off_mm(config, truth) < 0.1
    assert camera_off_deg(config, truth) < 0.2
    assert config.geometry.colour is not None
    assert config.geometry.colour.delta_e00_mean < 1.5


def test_before_it_nothing_of_that_was_so(calibrated: Calibrated) -> None:
    nominal, truth = workshop(), calibrated.truth
    assert directions_off_deg(nominal, truth).max() > 3.0
    assert powers_off(nominal, truth).max() > 0.08
    assert axis_off_mm(nominal, truth) > 0.2
    assert camera_off_deg(nominal, truth) > 0.5


def test_every_step_passes_its_own_criteria(calibrated: Calibrated) -> None:
    for step, outcome in calibrated.outcomes.items():
        assert all(c.passed for c in outcome.criteria), (step, outcome)


def test_the_stated_uncertainties_are_not_smaller_than_the_errors(calibrated: Calibrated) -> None:
    found, real = calibrated.config.geometry, calibrated.truth.geometry
    position = np.subtract(found.camera.position_mm, real.camera.position_mm)
    assert (np.abs(position) < 4 * np.array(found.camera.position_sigma_mm) + 0.01).all()
    focal = np.subtract(found.lens.focal_px, real.lens.focal_px)
    assert (np.abs(focal) < 4 * np.array(found.lens.focal_sigma_px)).all()
    off = np.subtract([led.position_mm for led in found.led], [led.position_mm for led in real.led])
    sigma = np.array([led.position_sigma_mm for led in found.led])
    assert np.mean(np.abs(off) < 2 * sigma) > 0.8
    power_sigma = np.array([led.power_sigma for led in found.led])
    apart = np.abs(calibrated.config.led_powers() - calibrated.truth.led_powers())
    assert np.mean(apart < 2 * power_sigma) > 0.8


def test_the_lens_bends_as_it_should(calibrated: Calibrated) -> None:
    camera = calibrated.config.camera
    x, y = np.meshgrid(np.linspace(0.2, 0.8, 7), np.linspace(0.2, 0.8, 7))
    at = np.stack([x * camera.width_px, y * camera.height_px], axis=-1)
    found, real = distort(lens(calibrated.config), at), distort(lens(calibrated.truth), at)
    drawn = np.linalg.norm(real - at, axis=-1).max()
    assert np.linalg.norm(found - real, axis=-1).max() < 0.35 * drawn


def test_markers_are_found_where_they_were_glued(calibrated: Calibrated) -> None:
    found, real = calibrated.config.marker_corners_mm(), calibrated.truth.marker_corners_mm()
    nominal = workshop().marker_corners_mm()
    assert np.abs(nominal - real).max() > 0.15
    assert np.sqrt(np.mean((found - real) ** 2)) < 0.06


def test_a_white_sample_is_one_once_prepared(calibrated: Calibrated) -> None:
    """Linear, dark-subtracted, flat-fielded, colour-corrected, in reflectance units."""
    bench, config = calibrated.bench, calibrated.config
    bench.place(FlatSample(white_board(0.7), 2.0, config.sample.side_mm))
    bench.turn(40.0)
    exposure = Exposure(5_000, 1.0)
    for led in (1, 10):
        frame, dark = bench.frame((led,), exposure), bench.frame((), exposure)
        seen = rectify(frame, dark, config, 2.0, 32, (led,))
        known = lighting(config, (led,), seen.measured_angle_deg, exposure, 2.0, 32).lights[0]
        ones = np.full((32, 32, 1), 2.0 / 32)
        grid = (np.cumsum(ones, axis=1) - 1 - 1 / 32, 1 + 1 / 32 - np.cumsum(ones, axis=0))
        points = np.concatenate([*grid, 0 * ones], axis=-1)
        toward = known.position - points
        cosine = toward[..., 2:] / np.linalg.norm(toward, axis=-1, keepdims=True)
        reflectance = (seen.picture.image / (known.white * cosine))[2:-2, 2:-2]
        np.testing.assert_allclose(reflectance, 0.7, rtol=0.04)
        assert reflectance.mean(axis=(0, 1)) == pytest.approx([0.7] * 3, rel=0.015)


def test_a_check_shot_knows_the_rig_again_and_sees_when_it_has_moved(
    calibrated: Calibrated,
) -> None:
    bench, config = calibrated.bench, calibrated.config
    bench.place(FlatSample(white_board(0.5), 2.0, config.sample.side_mm))
    bench.turn(0.0)
    frame = bench.frame((0,), Exposure(5_000, 1.0))
    same = check(frame, config, 0)
    assert same.camera_deg < 0.15
    assert same.camera_mm < 1.0
    assert same.light == pytest.approx(1, abs=0.05)
    before = config.geometry
    moved = before.camera.model_copy(
        update={"position_mm": tuple(np.add(before.camera.position_mm, [4.0, 0, 0]))}
    )
    dimmed = tuple(led.model_copy(update={"power": led.power * 1.5}) for led in before.led)
    other = config.calibrated(before.model_copy(update={"camera": moved, "led": dimmed}))
    now = check(frame, other, 0)
    assert now.camera_mm > 3.0
    assert now.light == pytest.approx(1 / 1.5, abs=0.05)


def test_the_doctor_names_age_and_disagreement(calibrated: Calibrated) -> None:
    bench, now = calibrated.bench, datetime.now(UTC)
    measured = {"geometry": Measured(date=now - timedelta(days=3), text="")}
    geometry = calibrated.config.geometry.model_copy(update={"measured": measured})
    config = calibrated.config.calibrated(geometry)
    bench.place(FlatSample(white_board(0.5), 2.0, config.sample.side_mm))
    bench.turn(0.0)
    frame = bench.frame((0,), Exposure(5_000, 1.0))
    assert judge(config, frame, 0, now).startswith("3 days old; the camera is seen 0.")
    with pytest.raises(CalibrationError, match=r"203 days old; run turnlight calibrate"):
        judge(config, frame, 0, now + timedelta(days=200))
    bright = tuple(led.model_copy(update={"power": led.power * 1.5}) for led in geometry.led)
    with pytest.raises(CalibrationError, match=r"LED 0 gives 6[0-9]% of the light"):
        judge(config.calibrated(geometry.model_copy(update={"led": bright})), frame, 0, now)
    away = tuple(np.add(geometry.camera.position_mm, [4.0, 0, 0]).tolist())
    camera = geometry.camera.model_copy(update={"position_mm": away})
    with pytest.raises(CalibrationError, match=r"The camera stands 4\.\d mm"):
        judge(config.calibrated(geometry.model_copy(update={"camera": camera})), frame, 0, now)


def test_colours_of_a_sample_come_out_as_they_are(calibrated: Calibrated) -> None:
    bench, config = calibrated.bench, calibrated.config
    colours = np.array([(0.4, 0.12, 0.08), (0.1, 0.3, 0.12), (0.08, 0.12, 0.35), (0.5, 0.4, 0.1)])
    maps = white_board(1.0)
    width = maps.resolution[1]
    maps.diffuse[:] = np.repeat(colours, width // 4, axis=0)[None]
    bench.place(FlatSample(maps, 2.0, config.sample.side_mm))
    bench.turn(0.0)
    exposure = Exposure(8_000, 1.0)
    frame, dark = bench.frame((9,), exposure), bench.frame((), exposure)
    seen = rectify(frame, dark, config, 2.0, 64, (9,)).picture.image
    bench.place(FlatSample(white_board(1.0), 2.0, config.sample.side_mm))
    board = bench.frame((9,), exposure)
    white = rectify(board, dark, config, 2.0, 64, (9,)).picture.image
    found = np.stack(
        [(seen / white)[20:44, 16 * i + 4 : 16 * i + 12].mean((0, 1)) for i in range(4)]
    )
    assert delta_e00(lab(found), lab(colours)).max() < 2.0
    raw = rectify(frame, dark, workshop(), 2.0, 64, (9,)).picture.image / white
    plain = np.stack([raw[20:44, 16 * i + 4 : 16 * i + 12].mean((0, 1)) for i in range(4)])
    assert delta_e00(lab(plain), lab(colours)).min() > 4.0


@pytest.mark.bench
@pytest.mark.timeout(0)
def test_many_rigs() -> None:
    """Prints how well rigs drawn from other seeds are found: `pytest -m bench -s` on this file."""
    limits = {"LED direction, deg": 1.0, "LED power": 0.02, "axis, mm": 0.1, "camera, deg": 0.2}
    limits["colour, dE00"] = 1.5
    print("\nseed  " + "  ".join(f"{name:>18}" for name in limits) + "   (worst LED; limits below)")
    for seed in range(10, 15):
        found = calibrate(seed)
        config, truth = found.config, found.truth
        assert config.geometry.colour is not None
        row = [
            directions_off_deg(config, truth).max(),
            powers_off(config, truth).max(),
            axis_off_mm(config, truth),
            camera_off_deg(config, truth),
            config.geometry.colour.delta_e00_mean,
        ]
        print(f"{seed:4}  " + "  ".join(f"{value:18.3f}" for value in row), flush=True)
        assert all(value <= limit for value, limit in zip(row, limits.values(), strict=True))
    print("      " + "  ".join(f"{limit:18.3f}" for limit in limits.values()))
