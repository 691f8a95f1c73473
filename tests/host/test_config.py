"""A rig's TOML is checked, and what is wrong with it is said with its remedy."""

from pathlib import Path

import numpy as np
import pytest

from turnlight.config import RigConfig
from turnlight.errors import ConfigError

REFERENCE = Path(__file__).parents[2] / "rig_config/simulated.toml"


@pytest.fixture
def config() -> RigConfig:
    return RigConfig.load(REFERENCE)


def test_the_reference_rig(config: RigConfig) -> None:
    assert config.led_count == 36
    leds = config.led_positions_mm(2.0)
    assert np.allclose(np.linalg.norm(leds, axis=1), 250)
    assert np.allclose(leds[0], [250 * np.sin(np.radians(35)), 0, 250 * np.cos(np.radians(35))])
    camera = config.camera_position_mm(2.0)
    assert np.isclose(np.linalg.norm(camera), 300)
    assert camera[1] < 0  # toward the operator
    assert config.camera.focal_px == pytest.approx(1520 / np.tan(np.radians(20)))


def test_a_thicker_sample_is_nearer_to_everything(config: RigConfig) -> None:
    higher = config.camera_position_mm(12.0)
    assert np.allclose(higher - config.camera_position_mm(2.0), [0, 0, -10])
    assert np.allclose(config.led_positions_mm(12.0) - config.led_positions_mm(2.0), [0, 0, -10])


def test_the_sample_frame_turns_against_the_table(config: RigConfig) -> None:
    """What stands on +x is seen on -y by a sample that has turned a quarter counter-clockwise."""
    seen = config.to_sample_frame(np.array([50.0, 0.0, 25.0]), 90.0)
    assert np.allclose(seen, [0, -1, 0.5])


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (
            ("side_mm = 100.0", "side_cm = 10.0"),
            "perhaps side_mm is meant (units are part of the name)",
        ),
        (("exposure_us = 10000", "exposure_ms = 10"), "perhaps exposure_us is meant"),
        (("side_mm = 100.0", ""), "the key sample.side_mm is missing"),
        (("side_mm = 100.0", 'side_mm = "10 cm"'), "sample.side_mm = '10 cm' will not do"),
        (("side_mm = 100.0", "side_mm = -1.0"), "should be greater than 0"),
        (("side_mm = 100.0", "side_mm = inf"), "should be a finite number"),
        (("side_mm = 100.0", "side_mm 100"), "is not valid TOML"),
        (('driver = "simulated"', 'driver = "webcam"'), "camera.driver = 'webcam' will not do"),
        (("[platter]", "[plate]"), "platter"),
        (("shots = 6", "shot = 6"), "preset.quick.shot is not known; perhaps shots is meant"),
        (('driver = "simulated"', 'driver = "oak"'), 'in camera, driver = "oak" gives raw data'),
    ],
)
def test_mistakes_are_explained(tmp_path: Path, change: tuple[str, str], complaint: str) -> None:
    text = REFERENCE.read_text()
    assert change[0] in text
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(*change, 1))
    with pytest.raises(ConfigError) as caught:
        RigConfig.load(path)
    message = str(caught.value)
    assert complaint in message
    assert str(path) in message
    assert "\n" not in message


@pytest.mark.parametrize("name", ["oak", "uvc"])
def test_the_rigs_with_a_real_camera(name: str, config: RigConfig) -> None:
    real = RigConfig.load(REFERENCE.with_name(f"{name}.toml"))
    assert real.camera.driver == real.name == name
    assert real.controller.port.startswith("usb:")
    assert real.led_count == config.led_count


def test_an_oak_has_so_many_lens_positions(tmp_path: Path) -> None:
    text = REFERENCE.with_name("oak.toml").read_text()
    path = tmp_path / "rig.toml"
    path.write_text(text.replace("lens_position = 135", "lens_position = 300"))
    with pytest.raises(ConfigError, match="in camera, the lens of an oak"):
        RigConfig.load(path)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No such file"):
        RigConfig.load(tmp_path / "none.toml")
    binary = tmp_path / "rig.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="not UTF-8"):
        RigConfig.load(binary)
    with pytest.raises(ConfigError, match="directory"):
        RigConfig.load(tmp_path)


def test_presets_are_listed_and_chosen_by_name(config: RigConfig) -> None:
    assert list(config.preset) == ["standard", "quick", "shiny", "adaptive"]
    assert config.preset_named(None) == config.preset["standard"]
    assert config.preset_named("shiny").bracketing
    with pytest.raises(
        ConfigError, match="has no preset slow; choose standard, quick, shiny, adaptive"
    ):
        config.preset_named("slow")
    bare = RigConfig.model_validate(config.model_dump(exclude={"preset"}))
    assert bare.preset_named(None).shots == 10
