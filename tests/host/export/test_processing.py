"""Tiling, resampling and heights, each against what it must not change."""

import numpy as np
import pytest

from svbrdf import maps as uniform
from svbrdf import procedural, renderer
from svbrdf.maps import Maps
from turnlight.export.height import height_from_normals
from turnlight.export.resample import resampled
from turnlight.export.tileable import edge_ratios, tileable

SEEDS = (1, 3, 6, 9)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_seam_does_not_show(seed: int) -> None:
    tile, seam = tileable(procedural.material(seed, 192))
    assert max(edge_ratios(tile).values()) == pytest.approx(seam.edge)
    assert seam.edge <= 1.1
    assert seam.path <= 1.1


def test_things_with_crisp_outlines_are_joined_less_well_and_it_says_so() -> None:
    _, seam = tileable(procedural.material(2, 192))
    assert seam.edge <= 1.1
    assert 1.1 < seam.path < 1.3


def test_a_ramp_is_hidden() -> None:
    """What drifts across the whole sample jumps at the edge, unless it is made to meet."""
    ramp = uniform.flat(128, 128)
    ramp.diffuse[:] *= np.linspace(0.3, 1.5, 128, dtype=np.float32)[None, :, None]
    tile, _ = tileable(ramp)
    assert edge_ratios(ramp)["diffuse"] > 20
    jump = np.abs(tile.diffuse[:, 0] - tile.diffuse[:, -1]).max()
    steps = np.abs(np.diff(tile.diffuse, axis=1)).max()
    assert jump <= steps


def test_what_repeats_is_cut_at_its_period() -> None:
    stripes = uniform.flat(160, 160)
    phase = np.arange(160) % 20 < 6
    stripes.diffuse[:, phase] = 0.1
    tile, seam = tileable(stripes)
    assert tile.resolution[1] % 20 == 0
    assert seam.path == pytest.approx(1, abs=0.02)
    assert set(np.unique(tile.diffuse.round(2))) == {np.float32(0.1), np.float32(0.5)}


def test_normals_stay_unit_vectors() -> None:
    sample = procedural.material(3, 128)
    for other in (resampled(sample, 48, 48), resampled(sample, 200, 200), tileable(sample)[0]):
        np.testing.assert_allclose(np.linalg.norm(other.normal, axis=-1), 1, atol=1e-5)


def test_there_and_back() -> None:
    smooth = resampled(procedural.material(3, 128), 64, 64)
    back = resampled(resampled(smooth, 128, 128, wrap=True), 64, 64)
    for name in ("diffuse", "roughness", "specular", "normal"):
        apart = getattr(back, name) - getattr(smooth, name)
        assert np.sqrt(np.mean(apart**2)) < 0.03


def test_lost_relief_becomes_roughness() -> None:
    """Reduced maps look as the full ones do from afar, and better so than without."""
    random = np.random.default_rng(0)
    n = 256
    slopes = random.normal(0, 0.15, (n, n, 2)).astype(np.float32)
    normal = np.concatenate([slopes, np.ones((n, n, 1), np.float32)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    plain = uniform.flat(n, n, albedo=0.0, roughness=0.3)
    rough = Maps(normal, plain.diffuse, plain.roughness, plain.specular + 0.4)
    light, view = np.float32([0.3, 0.2, 2.0]), np.float32([0, 0, 3.0])
    truth = renderer.render(rough, light, view, np.float32(1)).reshape(16, 16, 16, 16, 3)
    truth = truth.mean(axis=(1, 3))
    small = resampled(rough, 16, 16)
    naive = Maps(small.normal, small.diffuse, np.full_like(small.roughness, 0.3), small.specular)
    ours, theirs = (
        np.sqrt(np.mean((renderer.render(m, light, view, np.float32(1)) - truth) ** 2))
        for m in (small, naive)
    )
    assert ours < 0.35 * theirs


def test_height_of_a_known_surface() -> None:
    """Waves that tile come back from their normals, in the unit of the pitch, with none of a slant."""
    n, side_mm = 128, 50.0
    at = (np.arange(n) + 0.5) / n
    x, y = np.meshgrid(at, 1 - at)
    truth = 0.4 * np.sin(2 * np.pi * 3 * x) * np.cos(2 * np.pi * 2 * y) + 0.1 * np.cos(
        10 * np.pi * y
    )
    along_x = 0.4 * 6 * np.pi * np.cos(6 * np.pi * x) * np.cos(4 * np.pi * y) / side_mm
    along_y = -0.4 * 4 * np.pi * np.sin(6 * np.pi * x) * np.sin(4 * np.pi * y) / side_mm
    along_y -= 0.1 * 10 * np.pi * np.sin(10 * np.pi * y) / side_mm
    slant = 0.3
    normal = np.stack([-along_x - slant, -along_y, np.ones_like(x)], axis=-1).astype(np.float32)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    height = height_from_normals(normal, side_mm / n)
    np.testing.assert_allclose(height, truth - truth.mean(), atol=1e-4)
