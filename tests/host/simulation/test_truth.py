from pathlib import Path

import numpy as np
import pytest

from turnlight.app import DEFAULT_RIG
from turnlight.config import RigConfig
from turnlight.picture.pinhole import camera_rotation
from turnlight.simulation.truth import perturbed

DRAWS = 40


@pytest.fixture(scope="module")
def config() -> RigConfig:
    return RigConfig.load(Path(DEFAULT_RIG)).calibrated(None)


@pytest.fixture(scope="module")
def truths(config: RigConfig) -> list[RigConfig]:
    return [perturbed(config, seed) for seed in range(DRAWS)]


def angle_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    across = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.degrees(np.arctan2(across, np.sum(a * b, axis=-1)))


def rms(values: object) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_errors_have_the_sizes_asked_for(config: RigConfig, truths: list[RigConfig]) -> None:
    nominal = config.led_positions_mm(2.0)
    off = [angle_deg(t.led_positions_mm(2.0), nominal) for t in truths]
    assert rms(off) == pytest.approx(1.0, rel=0.1)
    powers = [np.log(t.led_powers() / config.led_powers()) for t in truths]
    assert rms(powers) == pytest.approx(0.02, rel=0.1)
    axes = [np.hypot(*t.geometry.table.axis_mm) for t in truths]
    assert rms(axes) == pytest.approx(0.1, rel=0.3)
    turns = [camera_rotation(t).T @ camera_rotation(config) for t in truths]
    assert rms(np.degrees(np.arccos([(np.trace(t) - 1) / 2 for t in turns]))) == pytest.approx(
        0.2, rel=0.3
    )


def test_the_camera_still_looks_at_the_origin(truths: list[RigConfig]) -> None:
    for truth in truths:
        seen = camera_rotation(truth) @ -truth.camera_position_mm(2.0)
        np.testing.assert_allclose(seen, [0, 0, 300], atol=1e-6)


def test_the_same_seed_is_the_same_rig(config: RigConfig, truths: list[RigConfig]) -> None:
    assert perturbed(config, 3) == truths[3] != truths[4]


def test_no_error_is_the_rig_itself(config: RigConfig) -> None:
    same = perturbed(config, 0, led_direction_deg=0, power=0, axis_mm=0, camera_deg=0)
    np.testing.assert_allclose(same.led_positions_mm(2.0), config.led_positions_mm(2.0))
    np.testing.assert_allclose(camera_rotation(same), camera_rotation(config), atol=1e-12)
