"""One service for the tests that change nothing in it, and others as they are asked for."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from web_service import Served, serving, small_material

from turnlight import app


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "simulated_material", small_material)
        with serving(tmp_path_factory.mktemp("service")) as service:
            yield service


@pytest.fixture
def quick_material(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(app, "simulated_material", small_material)


@pytest.fixture
def folder(tmp_path: Path, quick_material: None) -> Path:
    return tmp_path
