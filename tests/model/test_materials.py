from itertools import pairwise

import cv2
import numpy as np
import pytest

from svbrdf import materials, procedural
from svbrdf.materials import MaterialError
from svbrdf.scores import renderings


def test_a_saved_material_reads_back(tmp_path):
    sample = procedural.material(5, 64)
    materials.save(sample, tmp_path)
    again = materials.load(tmp_path)
    for name in ("diffuse", "roughness", "specular"):
        np.testing.assert_allclose(getattr(again, name), getattr(sample, name), atol=1e-4)
    np.testing.assert_allclose(again.normal, sample.normal, atol=1e-3)


def test_base_colour_and_metalness_become_diffuse_and_f0(tmp_path):
    flat = np.full((8, 8, 3), 128, np.uint8)
    cv2.imwrite(str(tmp_path / "normal.png"), np.uint8([[[255, 128, 128]]] * 8).repeat(8, 1))
    cv2.imwrite(str(tmp_path / "roughness.png"), flat)
    cv2.imwrite(str(tmp_path / "basecolor.png"), flat)
    cv2.imwrite(str(tmp_path / "metalness.png"), np.full((8, 8, 3), 255, np.uint8))
    sample = materials.load(tmp_path)
    assert sample.diffuse.max() == 0
    np.testing.assert_allclose(sample.specular, 0.2158, atol=1e-3)


def test_a_folder_without_maps_is_named(tmp_path):
    with pytest.raises(MaterialError, match=r"no normal\.png"):
        materials.load(tmp_path)
    with pytest.raises(MaterialError, match="does not exist"):
        materials.load(tmp_path / "nowhere")


@pytest.mark.parametrize("seed", range(30))
def test_procedural_materials_are_in_range_and_repeat(seed):
    sample = procedural.material(seed, 48)
    again = procedural.material(seed, 48)
    for name in ("normal", "diffuse", "roughness", "specular"):
        array = getattr(sample, name)
        np.testing.assert_array_equal(array, getattr(again, name))
        assert np.isfinite(array).all()
    np.testing.assert_allclose(np.linalg.norm(sample.normal, axis=-1), 1, atol=1e-4)
    for array in (sample.diffuse, sample.roughness, sample.specular):
        assert 0 <= array.min() <= array.max() <= 1


def test_a_mirror_is_a_smooth_metal():
    maps = procedural.mirror(3, 64)
    assert maps.diffuse.max() < 0.01
    assert maps.specular.mean() > 0.1
    assert maps.roughness.min() >= 0.05
    assert maps.roughness.mean() < 0.3
    assert np.array_equal(maps.normal, procedural.material(3, 64).normal)


def test_a_steep_material_differs_in_relief_alone():
    maps, plain = procedural.steep(3, 64), procedural.material(3, 64)
    np.testing.assert_allclose(np.linalg.norm(maps.normal, axis=-1), 1, atol=1e-4)
    slopes = np.linalg.norm(maps.normal[..., :2], axis=-1) / maps.normal[..., 2]
    assert np.tan(np.radians(20)) <= slopes.mean() <= np.tan(np.radians(45))
    assert np.array_equal(maps.roughness, plain.roughness)


def test_split_seeds_do_not_overlap():
    ranges = [procedural.TRAINING_SEEDS, procedural.VALIDATION_SEEDS, procedural.TEST_SEEDS]
    assert all(a.stop <= b.start for a, b in pairwise(ranges))


def test_averages_of_a_crop_keep_normals_unit():
    small = materials.averaged(procedural.material(7, 64), 16, 32)
    assert small.resolution == (16, 16)
    np.testing.assert_allclose(np.linalg.norm(small.normal, axis=-1), 1, atol=1e-5)


@pytest.mark.parametrize("seed", [3, 4, 8, 10])
def test_a_reduced_material_looks_as_the_pictures_do_from_further_away(seed: int):
    material = procedural.material(seed, 256)
    seen = [cv2.resize(p, (32, 32), interpolation=cv2.INTER_AREA) for p in renderings(material)]
    ours, averages = (
        np.mean([np.abs(a - b).mean() for a, b in zip(renderings(maps), seen, strict=True)])
        for maps in (materials.reduced(material, 32, 32), materials.averaged(material, 32))
    )
    assert ours < 0.7 * averages
