"""The reference rig with a small sensor, so that a whole capture takes seconds."""

import re
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]


@pytest.fixture
def small_rig(tmp_path: Path) -> Path:
    text = (REPOSITORY / "rig_config/simulated.toml").read_text()
    for key, value in (("width_px", 1014), ("height_px", 760)):
        text = re.sub(rf"^{key} = \d+$", f"{key} = {value}", text, flags=re.MULTILINE)
    path = tmp_path / "small.toml"
    path.write_text(text)
    return path
