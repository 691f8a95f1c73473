"""The plan is spread well, starts where gloss shows, and turns the table little."""

from pathlib import Path

import numpy as np
import pytest

from turnlight.capture.plan import Shot, plan, signed_turn_deg, total_turn_deg, turn_deg
from turnlight.config import RigConfig
from turnlight.errors import ConfigError

REPOSITORY = Path(__file__).parents[3]
MIRROR_LED = 6


@pytest.fixture
def config() -> RigConfig:
    return RigConfig.load(REPOSITORY / "rig_config/simulated.toml")


def directions(config: RigConfig, shots: tuple[Shot, ...]) -> np.ndarray:
    """(shots, 6) half vector and light direction in the sample's frame, written out anew."""

    def turned(position: np.ndarray, angle_deg: float) -> np.ndarray:
        angle = np.radians(angle_deg)
        x, y, z = position / np.linalg.norm(position)
        return np.array(
            [x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle), z]
        )

    rows = []
    for shot in shots:
        light = turned(config.led_positions_mm(2.0)[shot.leds[0]], shot.angle_deg)
        half = light + turned(config.camera_position_mm(2.0), shot.angle_deg)
        rows.append([*half / np.linalg.norm(half), *light])
    return np.array(rows)


@pytest.mark.parametrize("shots", [1, 2, 3, 10, 50])
def test_the_plan_is_well_formed(config: RigConfig, shots: int) -> None:
    planned = plan(config, shots, 2.0)
    assert [shot.index for shot in planned] == list(range(shots))
    assert len({(shot.angle_deg, shot.leds) for shot in planned}) == shots
    assert all(0 <= shot.angle_deg < 360 for shot in planned)
    assert all(0 <= led < config.led_count for shot in planned for led in shot.leds)
    assert all(shot.exposure_us == 10_000 and shot.gain == 1.0 for shot in planned)
    assert planned == plan(config, shots, 2.0)


@pytest.mark.parametrize("thickness_mm", [0.0, 2.0, 20.0])
@pytest.mark.parametrize("shots", [1, 3, 10, 50])
def test_the_mirror_pair_is_among_the_first_three(
    config: RigConfig, shots: int, thickness_mm: float
) -> None:
    first = plan(config, shots, thickness_mm)[:3]
    assert any(shot.leds == (MIRROR_LED,) for shot in first)


def test_after_every_block_the_spread_is_better_than_chance(config: RigConfig) -> None:
    random = np.random.default_rng(0)
    every = directions(config, plan(config, 864, 2.0))
    planned = directions(config, plan(config, 48, 2.0))
    for count in (3, 6, 12, 24, 48):
        by_chance = [closest(random.permutation(every)[:count]) for _ in range(100)]
        assert closest(planned[:count]) > np.percentile(by_chance, 95)


def closest(points: np.ndarray) -> float:
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    return float(apart[~np.eye(len(points), dtype=bool)].min())


@pytest.mark.parametrize(("shots", "most_deg"), [(10, 540), (20, 900), (50, 1300)])
def test_the_table_turns_little(config: RigConfig, shots: int, most_deg: float) -> None:
    assert total_turn_deg(shot.angle_deg for shot in plan(config, shots, 2.0)) <= most_deg


@pytest.mark.parametrize("shots", [0, -1, 865])
def test_impossible_numbers_of_shots_are_refused(config: RigConfig, shots: int) -> None:
    with pytest.raises(ConfigError, match=r"cannot be planned; ask for 1 to 864\."):
        plan(config, shots, 2.0)


def test_turns_take_the_shorter_way() -> None:
    assert turn_deg(350, 10) == 20
    assert turn_deg(0, 180) == 180
    assert signed_turn_deg(10, 350) == -20
    assert signed_turn_deg(350, 10) == 20
    assert total_turn_deg([90, 270, 0]) == 90 + 180 + 90
