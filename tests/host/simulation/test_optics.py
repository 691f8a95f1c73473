from pathlib import Path

import numpy as np
import pytest

from svbrdf.maps import Maps, flat
from turnlight.config import RigConfig
from turnlight.picture.pinhole import plane_homography, platter_pose, project
from turnlight.picture.warp import Image
from turnlight.simulation.optics import scene, sensor_radiance

ROOT = Path(__file__).parents[3]
MIRROR_LED = 6  # ring A at azimuth 90, opposite the camera
SIDE_LED = 0


def rig(width: int = 507, height: int = 380) -> RigConfig:
    config = RigConfig.load(ROOT / "rig_config/simulated.toml")
    camera = config.camera.model_copy(update={"width_px": width, "height_px": height})
    return config.model_copy(update={"camera": camera})


def white(resolution: int = 64) -> Maps:
    maps = flat(resolution, resolution, albedo=1.0, roughness=1.0)
    return Maps(maps.normal, maps.diffuse, maps.roughness, maps.specular * 0)


def only(led: int, config: RigConfig, level: int = 255) -> tuple[int, ...]:
    return tuple(level if i == led else 0 for i in range(config.led_count))


def at_centre(image: Image) -> Image:
    row, column = image.shape[0] // 2, image.shape[1] // 2
    return image[row - 1 : row + 1, column - 1 : column + 1].mean(axis=(0, 1))


def lit(config: RigConfig, led: int, thickness_mm: float = 2.0, level: int = 255) -> Image:
    at = scene(config, white(), thickness_mm)
    return sensor_radiance(at, 0.0, only(led, config, level)) - sensor_radiance(
        at, 0.0, only(led, config, 0)
    )


@pytest.mark.parametrize(("led", "polar_deg"), [(SIDE_LED, 35), (MIRROR_LED, 35), (24, 65)])
def test_white_reads_the_cosine_of_the_light(led: int, polar_deg: float) -> None:
    reading = at_centre(lit(rig(), led))
    assert reading == pytest.approx(np.cos(np.radians(polar_deg)), abs=0.003)


def test_white_tilted_to_the_light_reads_one() -> None:
    config = rig()
    toward = config.led_positions_mm(2.0)[SIDE_LED]
    maps = white()
    normal = np.broadcast_to(toward / np.linalg.norm(toward), maps.normal.shape)
    maps = Maps(normal.astype(np.float32), maps.diffuse, maps.roughness, maps.specular)
    at = scene(config, maps, 2.0)
    reading = sensor_radiance(at, 0.0, only(SIDE_LED, config)) - sensor_radiance(
        at, 0.0, only(SIDE_LED, config, 0)
    )
    assert at_centre(reading) == pytest.approx(1.0, abs=0.003)


def test_level_and_power_scale_the_light() -> None:
    config = rig()
    strong = config.model_copy(
        update={"ring": [r.model_copy(update={"power": 3.0}) for r in config.ring]}
    )
    full = lit(config, MIRROR_LED)
    np.testing.assert_allclose(lit(config, MIRROR_LED, level=51), full / 5, atol=1e-5)
    np.testing.assert_allclose(lit(strong, MIRROR_LED), full * 3, atol=1e-5)


def test_leds_add_up() -> None:
    config = rig()
    at = scene(config, white(), 2.0)
    both = np.maximum(only(3, config), only(20, config))
    together = sensor_radiance(at, 20.0, tuple(both)) + sensor_radiance(
        at, 20.0, only(0, config, 0)
    )
    apart = sensor_radiance(at, 20.0, only(3, config)) + sensor_radiance(at, 20.0, only(20, config))
    np.testing.assert_allclose(together, apart, atol=1e-5)


def test_light_falls_off_with_the_square_of_the_distance() -> None:
    """A thick sample's surface is nearer to the LED, which still faces the reference origin."""
    config = rig()
    thickness_mm = 32.0
    led = config.led_positions_mm(thickness_mm)[SIDE_LED]
    distance = np.linalg.norm(led)
    target = -config.lift_mm(thickness_mm)
    axis = (led - target) / np.linalg.norm(led - target)
    expected = (250 / distance) ** 2 * (led @ axis / distance) * (led[2] / distance)
    pose = platter_pose(config, 0.0)
    column, row = project(plane_homography(config, pose, thickness_mm), np.zeros(2))
    reading = lit(config, SIDE_LED, thickness_mm)[int(row), int(column)]
    assert expected > 1.1 * np.cos(np.radians(35))
    assert reading == pytest.approx(expected, rel=0.006)


def test_leds_off_show_only_ambient() -> None:
    config = rig()
    dark = sensor_radiance(scene(config, white(), 2.0), 0.0, (0,) * config.led_count)
    assert at_centre(dark) == pytest.approx(0.02)
    assert dark.max() == pytest.approx(0.02)


def test_the_camera_looks_at_the_reference_origin_from_the_operators_side() -> None:
    config = rig()
    pose = platter_pose(config, 0.0)
    reference = plane_homography(config, pose, config.sample.reference_thickness_mm)
    centre = project(reference, np.zeros(2))
    assert centre == pytest.approx([507 / 2, 380 / 2])
    right, away = project(reference, np.array([(10.0, 0.0), (0.0, 10.0)])) - centre
    assert right[0] > 5 and abs(right[1]) < 1e-9
    assert away[1] < -5 and abs(away[0]) < 1e-9


def test_a_positive_angle_turns_the_sample_counter_clockwise() -> None:
    """A red right edge is seen at the top of the image once the table has turned by 90 degrees."""
    config = rig()
    maps = white()
    maps.diffuse[:, 48:, 1:] = 0
    at = scene(config, maps, 2.0)
    image = sensor_radiance(at, 90.0, only(MIRROR_LED, config))
    column, row = project(
        plane_homography(config, platter_pose(config, 0.0), 2.0), np.array([0.0, 40.0])
    ).astype(int)
    assert image[row, column, 0] > 10 * image[row, column, 1]


def test_the_thicker_sample_hides_more_of_the_platter_behind_it() -> None:
    config = rig()
    tops = []
    for thickness_mm in (0.0, 10.0):
        edge = np.array([0.0, config.sample.side_mm / 2])
        to_pixels = plane_homography(config, platter_pose(config, 0.0), thickness_mm)
        tops.append(project(to_pixels, edge)[1])
    assert tops[1] < tops[0] - 5


def test_a_camera_above_sees_the_sample_upright() -> None:
    config = rig()
    camera = config.camera.model_copy(update={"polar_deg": 0.0})
    above = config.model_copy(update={"camera": camera})
    to_pixels = plane_homography(above, platter_pose(above, 0.0), 2.0)
    right, up = project(to_pixels, np.array([(10.0, 0.0), (0.0, 10.0)])) - [507 / 2, 380 / 2]
    step = camera.focal_px * 10 / 300
    assert right == pytest.approx([step, 0], abs=1e-9)
    assert up == pytest.approx([0, -step], abs=1e-9)


def test_ambient_light_is_as_strong_as_asked() -> None:
    config = rig()
    dark = sensor_radiance(scene(config, white(), 2.0, ambient=0.1), 0.0, (0,) * config.led_count)
    assert at_centre(dark) == pytest.approx(0.1)
