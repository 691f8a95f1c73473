"""Materials to export, one of each kind, and a session without pictures' pixels being looked at."""

from pathlib import Path

import numpy as np
import pytest

from svbrdf import materials, procedural
from svbrdf.maps import Maps

RESOLUTION = 96


@pytest.fixture(scope="session")
def dielectric() -> Maps:
    return procedural.material(3, RESOLUTION)


@pytest.fixture(scope="session")
def metal(dielectric: Maps) -> Maps:
    """Gold with the relief of the other, and a little left of its albedo."""
    gold = np.array([1.0, 0.78, 0.34], np.float32)
    specular = gold * (0.8 + 0.2 * dielectric.diffuse)
    return Maps(dielectric.normal, dielectric.diffuse * 0.05, dielectric.roughness, specular)


@pytest.fixture(params=["dielectric", "metal"])
def maps(request: pytest.FixtureRequest) -> Maps:
    return request.getfixturevalue(request.param)


@pytest.fixture
def folder(maps: Maps, tmp_path: Path) -> Path:
    """A folder of maps."""
    materials.save(maps, tmp_path / "sample")
    return tmp_path / "sample"
