"""The pool of training materials: what its samples are like, whatever the base materials."""

import pytest

torch = pytest.importorskip("torch")

from svbrdf import pool  # noqa: E402


@pytest.fixture(scope="module")
def samples():
    base = torch.rand(4, 9, 64, 64, generator=torch.Generator().manual_seed(1))
    base[:, 5] = 0.5 + 0.1 * base[:, 5]
    materials = pool.MaterialPool(base, 0, torch.device("cpu"))
    rng = torch.Generator().manual_seed(0)
    return [materials.sample(8, 32, rng) for _ in range(200)]


def test_maps_are_in_range(samples):
    for maps in samples:
        assert maps.normal.shape == (8, 32, 32, 3)
        assert maps.normal.norm(dim=-1) == pytest.approx(1, abs=1e-4)
        for values in (maps.diffuse, maps.roughness, maps.specular):
            assert values.min() >= 0 and values.max() <= 1


def test_samples_are_from_mirrors_to_chalk_even_where_the_base_is_half_rough(samples):
    rough = torch.cat([maps.roughness.mean(dim=(1, 2, 3)) for maps in samples])
    lowest, low, high, highest = rough.quantile(torch.tensor([0.05, 0.2, 0.8, 0.95]))
    assert lowest < 0.12 and low < 0.32
    assert high > 0.54 and highest > 0.85


def test_metals_are_as_polished_as_the_renderer_shows(samples):
    metal = torch.cat([maps.diffuse.amax(dim=(1, 2, 3)) for maps in samples]) < 0.02
    rough = torch.cat([maps.roughness.mean(dim=(1, 2, 3)) for maps in samples])[metal]
    assert 0.2 < metal.float().mean() < 0.3
    assert 0.02 < (rough < 0.05).float().mean() < 0.2 and rough.min() < 0.04
