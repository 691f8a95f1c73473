"""Blender imports the exported glTF and renders it as our renderer renders the maps."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from host.export import reading

from svbrdf import procedural, renderer
from svbrdf.maps import Maps
from turnlight.export import gltf
from turnlight.export.provenance import Provenance
from turnlight.export.subject import Subject

PYTHON = Path(__file__).parents[2] / ".venv/blender/bin/python"
SIDE_MM = 100.0
RESOLUTION = 128
LIGHT, VIEW = np.array([-0.9, 1.1, 2.2], np.float32), np.array([0, 0, 4], np.float32)
MOST_RMSE = 0.02


def dielectric() -> Maps:
    return procedural.material(3, RESOLUTION)


def metal() -> Maps:
    rock = procedural.material(3, RESOLUTION)
    gold = np.array([1.0, 0.78, 0.34], np.float32) * (0.8 + 0.2 * rock.diffuse)
    return Maps(rock.normal, 0.02 * rock.diffuse, 0.6 * rock.roughness, gold)


@pytest.mark.bench
@pytest.mark.timeout(600)
@pytest.mark.parametrize("make", [dielectric, metal])
def test_blender_shows_the_same(make: type, tmp_path: Path) -> None:
    if not PYTHON.exists():
        pytest.skip(
            "bpy is made for one Python alone; make bench installs it where that is this one"
        )
    maps: Maps = make()
    model, image = tmp_path / "sample.glb", tmp_path / "seen.exr"
    model.write_bytes(gltf.glb(Subject(maps, Provenance("sample", SIDE_MM)), tiles=False))
    half_side = SIDE_MM / 2000
    told = {
        "light": (LIGHT * half_side).tolist(),
        "view": (VIEW * half_side).tolist(),
        "half_side": half_side,
        "size": RESOLUTION,
    }
    script = Path(__file__).with_name("blender_render.py")
    subprocess.run(
        [PYTHON, script, model, image, json.dumps(told)], check=True, capture_output=True
    )
    seen = reading.exr(image)[..., :3]
    positions = renderer.pixel_positions(np, RESOLUTION, RESOLUTION, dtype=np.float32)
    distance2 = np.sum((LIGHT - positions) ** 2, axis=-1, keepdims=True)
    ours = renderer.render(maps, LIGHT, VIEW, np.pi * np.sum(LIGHT**2) / distance2)
    fit = np.exp(np.median(np.log(ours + 0.02) - np.log(seen + 0.02)))
    rmse = np.sqrt(np.mean((shown(seen * fit) - shown(ours)) ** 2))
    print(f"\nBlender, {make.__name__}: RMSE {rmse:.4f} at exposure {fit:.3f}")
    assert rmse <= MOST_RMSE


def shown(linear: np.ndarray) -> np.ndarray:
    return np.clip(linear, 0, 1) ** (1 / 2.2)
