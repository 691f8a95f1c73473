"""One exposure for each LED: as long as the sample allows, in few steps; and two, merged in linear light."""

from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from turnlight.capture.develop import merged
from turnlight.capture.exposure import LONGEST, MOST_CLIPPED, find_exposure, sample_mask
from turnlight.capture.recovery import Recovery
from turnlight.capture.shot import shorter
from turnlight.config import RigConfig
from turnlight.frame import Exposure, Frame
from turnlight.picture.picture import Picture
from turnlight.rig.rig import Rig

CONFIG = RigConfig.load(Path(__file__).parents[3] / "rig_config/simulated.toml")
SMALL = CONFIG.model_copy(
    update={"camera": CONFIG.camera.model_copy(update={"width_px": 320, "height_px": 240})}
)


@dataclass
class Lamp:
    """Controller, camera and clock in one: the sample reads `reading` at 10 ms, but for a share of glare."""

    reading: float
    glare: float = 0.0
    asked: list[int] = field(default_factory=list)

    def light(self, leds: tuple[int, ...]) -> None: ...

    def off(self) -> None: ...

    def sleep(self, seconds: float) -> None: ...

    def capture(self, exposure: Exposure) -> Frame:
        self.asked.append(exposure.exposure_us)
        scale = exposure.exposure_us / 10_000
        linear = np.full((240, 320), self.reading * scale)
        mask = np.argwhere(sample_mask(SMALL, 0.0, 2.0))
        rows = mask[:: round(1 / self.glare)] if self.glare else mask[:0]
        linear[rows[:, 0], rows[:, 1]] = 50 * scale
        pixels = np.rint(np.clip(linear, 0, 1) ** (1 / 2.2) * 4095).astype(np.uint16)
        return Frame(np.repeat(pixels[..., None], 3, axis=-1), 12, 2.2, exposure, 0)


def found(lamp: Lamp) -> tuple[int, float]:
    parts: any = lamp
    rig = Rig(SMALL, parts, parts, parts)
    lit = find_exposure(rig, Recovery(rig, nullcontext), (3,), 2.0)
    return lit.exposure_us, lit.clipped


@pytest.mark.parametrize(
    ("reading", "exposure_us"),
    [
        (0.89, 10_000),
        (0.5, 14_100),
        (0.2, 40_000),
        (0.01, 10_000 * LONGEST),
        (1.5, 5_000),
        (30, 200),
    ],
)
def test_the_brightest_of_the_sample_comes_close_to_full_scale(
    reading: float, exposure_us: int
) -> None:
    assert found(Lamp(reading)) == (exposure_us, 0.0)


def test_a_little_glare_may_clip_and_much_may_not() -> None:
    assert found(Lamp(0.4, glare=0.001))[0] == 20_000
    exposure_us, clipped = found(Lamp(0.4, glare=0.02))
    assert exposure_us < 200
    assert clipped <= MOST_CLIPPED


def test_the_mask_is_where_the_sample_is() -> None:
    mask = sample_mask(SMALL, 0.0, 2.0)
    assert mask[120, 160]
    assert 0.05 < mask.mean() < 0.4
    assert np.any(mask != sample_mask(SMALL, 45.0, 2.0))


def picture(image: np.ndarray, gain: float, clipped: np.ndarray) -> Picture:
    everywhere = np.ones(image.shape[:2], bool)
    return Picture(image.astype(np.float32), gain, everywhere, clipped)


def test_two_exposures_are_merged_in_linear_light() -> None:
    radiance = np.linspace(0.01, 6.0, 64 * 64 * 3).reshape(64, 64, 3)
    longer, short = np.minimum(radiance, 1), np.minimum(radiance / 8, 1)
    clipped = (radiance >= 1).any(axis=-1)
    result = merged(picture(longer, 1.0, clipped), picture(short, 8.0, np.zeros_like(clipped)))
    assert np.allclose(result.image, radiance, rtol=1e-5)
    assert result.gain == 1.0
    assert not result.clipped.any()


def test_the_shorter_exposure_is_an_eighth() -> None:
    assert shorter(Exposure(10_000, 2.0)) == Exposure(1_200, 2.0)
    assert shorter(Exposure(100, 1.0)) == Exposure(100, 1.0)
