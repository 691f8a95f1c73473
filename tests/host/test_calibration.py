from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from turnlight.app import DEFAULT_RIG
from turnlight.calibration import (
    Colour,
    Measured,
    calibration_path,
    encode_calibration,
    load_calibration,
)
from turnlight.config import RigConfig
from turnlight.errors import ConfigError
from turnlight.picture.pinhole import lens
from turnlight.simulation.truth import as_built


@pytest.fixture
def config() -> RigConfig:
    return RigConfig.load(DEFAULT_RIG).calibrated(None)


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    file = tmp_path / "my.rig.toml"
    file.write_text(DEFAULT_RIG.read_text())
    return file


def test_what_is_written_is_read_back(config: RigConfig, tmp_path: Path) -> None:
    matrix = ((1.8, -0.8, 0.0), (-0.2, 1.5, -0.3), (0.0, -0.4, 1.4))
    sigma = ((0.1, 0.1, 0.1),) * 3
    colour = Colour(matrix=matrix, matrix_sigma=sigma, delta_e00_mean=1.2, delta_e00_max=4.0)
    truth = as_built(config, 5).config.geometry.model_copy(
        update={
            "measured": {"dark": Measured(date=datetime.now(UTC), text="0.2 %")},
            "colour": colour,
        }
    )
    path = tmp_path / "a.calibration.toml"
    path.write_bytes(encode_calibration(truth))
    again = load_calibration(path)
    assert again.measured == truth.measured
    assert again.colour == colour
    np.testing.assert_allclose(
        [led.position_mm for led in again.led], [led.position_mm for led in truth.led], rtol=1e-8
    )
    np.testing.assert_allclose(again.table.marker_corners_mm, truth.table.marker_corners_mm)


def test_it_is_used_when_it_lies_beside_the_rigs_file(config: RigConfig, rig_file: Path) -> None:
    truth = as_built(config, 5).config
    assert calibration_path(rig_file).name == "my.rig.calibration.toml"
    calibration_path(rig_file).write_bytes(encode_calibration(truth.geometry))
    loaded = RigConfig.load(rig_file)
    np.testing.assert_allclose(loaded.led_powers(), truth.led_powers(), rtol=1e-8)
    assert np.abs(loaded.led_powers() - config.led_powers()).max() > 0.05


def test_another_rigs_calibration_is_refused(config: RigConfig, rig_file: Path) -> None:
    other = config.geometry.model_copy(update={"rig": "another"})
    calibration_path(rig_file).write_bytes(encode_calibration(other))
    with pytest.raises(ConfigError, match=r"of the rig another .* run turnlight calibrate again"):
        RigConfig.load(rig_file)


@pytest.mark.parametrize(
    ("content", "reason"),
    [("format = ", "Invalid"), ("format = 2\n", "format"), ("rig = 3\n", "rig|lens"), ("", "rig")],
)
def test_a_damaged_file_is_one_clear_sentence(rig_file: Path, content: str, reason: str) -> None:
    calibration_path(rig_file).write_text(content)
    with pytest.raises(ConfigError, match=rf"(?s)({reason}).*run turnlight calibrate again"):
        RigConfig.load(rig_file)


def test_the_lens_fits_every_resolution_of_the_sensor(config: RigConfig) -> None:
    truth = as_built(config, 5).config
    half = truth.camera.model_copy(update={"width_px": 2028, "height_px": 1520})
    small = lens(truth.model_copy(update={"camera": half})).matrix
    np.testing.assert_allclose(small[:2], lens(truth).matrix[:2] / 2)
