"""Photometric stereo carried by a running max."""

import math

import pytest

torch = pytest.importorskip("torch")

from svbrdf import photometric, scenes  # noqa: E402
from svbrdf.maps import Maps  # noqa: E402
from svbrdf.network import Network  # noqa: E402
from svbrdf.network_config import EDGE  # noqa: E402

SIDE, STEM = 64, 2


def most(raw):
    return [part.amax(dim=0, keepdim=True) for part in raw]


def shuffled(part):
    return torch.nn.functional.pixel_shuffle(part.flatten(1, 2), STEM)


def flat(roughness: float) -> Maps:
    ones = torch.ones(1, SIDE, SIDE, 1)
    up = torch.tensor([0.0, 0.0, 1.0]).expand(1, SIDE, SIDE, 3)
    return Maps(up, 0.2 * ones.expand_as(up), roughness * ones, 0.04 * ones.expand_as(up))


def lobe(roughness: float):
    """The log excess in each bin of angles, of many pictures from the rig, and the bins' shares."""
    rng = torch.Generator().manual_seed(4)
    shots = scenes.shots(flat(roughness), 16, rng, "rig")
    seen = photometric.observe(
        shots.pictures[0] ** 2.2, scenes.known(shots, rng, scenes.Knowledge()), STEM
    )
    return photometric.read(most(seen.raw), STEM).lobe[0].chunk(3)[1:]


def waves(roughness: float = 1.0, specular: float = 0.02) -> Maps:
    """A relief under a two-coloured print, matte as it is."""
    x = torch.linspace(0, 4 * math.pi, SIDE)
    slope_x, slope_y = torch.meshgrid(0.25 * x.sin(), 0.2 * x.cos(), indexing="ij")
    normal = torch.stack([slope_x, slope_y, torch.ones(SIDE, SIDE)], dim=-1)
    normal = (normal / normal.norm(dim=-1, keepdim=True))[None]
    diffuse = torch.full((1, SIDE, SIDE, 3), 0.3)
    diffuse[:, :, SIDE // 2 :] = torch.tensor([0.6, 0.2, 0.1])
    ones = torch.ones(1, SIDE, SIDE, 1)
    return Maps(normal, diffuse, roughness * ones, specular * ones.expand(-1, -1, -1, 3))


def fused(count: int, share: float = 1.0, maps: Maps | None = None):
    rng = torch.Generator().manual_seed(4)
    shots = scenes.shots(maps or waves(), count, rng, "rig")
    poses = scenes.known(shots, rng, scenes.Knowledge(share))
    seen = photometric.observe(shots.pictures[0] ** 2.2, poses, STEM)
    return most(seen.raw)


def angle_deg(slopes):
    slopes = shuffled(slopes)
    normal = torch.cat([slopes, torch.ones_like(slopes[:, :1])], dim=1)
    normal = normal / normal.norm(dim=1, keepdim=True)
    cosine = (normal.permute(0, 2, 3, 1) * waves().normal).sum(dim=-1)
    return torch.rad2deg(torch.acos(cosine.clamp(-1, 1))).mean()


def test_slopes_and_albedo_of_a_matte_relief():
    read = photometric.read(fused(16), STEM)
    flat = angle_deg(torch.zeros_like(read.slopes))
    assert angle_deg(read.slopes) < 0.25 * flat
    assert angle_deg(read.free) < min(0.18 * flat, 0.8 * angle_deg(read.slopes))
    off = (photometric.linear(shuffled(read.albedo)).permute(0, 2, 3, 1) - waves().diffuse).abs()
    assert off.mean() < 0.02


def test_what_is_clipped_makes_a_white_tile_neither_dark_nor_uneven():
    tile = flat(0.3)
    tile = Maps(tile.normal, torch.full_like(tile.diffuse, 0.92), tile.roughness, tile.specular)
    rng = torch.Generator().manual_seed(2)
    shots = scenes.shots(tile, 10, rng, "paper")
    assert (shots.pictures.amax(dim=2) == 1).float().mean() > 0.5
    poses = scenes.known(shots, rng, scenes.Knowledge())
    seen = photometric.observe(shots.pictures[0] ** 2.2, poses, STEM)
    read = photometric.read(most(seen.raw), STEM)
    assert read.slopes.norm(dim=1).mean() < math.tan(math.radians(5))
    assert 0.75 < photometric.linear(read.albedo).mean() < 1.05


def test_few_pictures_tell_slopes_under_known_light():
    slopes = photometric.read(fused(6), STEM).slopes
    assert angle_deg(slopes) < 0.5 * angle_deg(torch.zeros_like(slopes))


def test_one_picture_tells_no_slopes():
    read = photometric.read(fused(1), STEM)
    assert torch.cat([read.slopes, read.free]).abs().max() < 1e-3


def test_a_rough_lobe_falls_off_slowly_and_a_glossy_one_at_once():
    glossy, shares = lobe(0.25)
    rough, _ = lobe(0.6)
    seen = shares > 0.1
    assert glossy[seen][0] > 1.5 * rough[seen][0]
    assert glossy[seen][-2] <= rough[seen][-2]
    assert (rough[seen].diff() <= 0.05).all() and (glossy[seen].diff() <= 0.05).all()


def test_guessed_light_tells_slopes_too_but_is_not_trusted():
    rng = torch.Generator().manual_seed(4)
    shots = scenes.shots(waves(), 16, rng, "rig")
    off = 0.6 * torch.randn(16, 3, generator=rng)  # some 5 degrees
    guessed = scenes.known(shots, rng, scenes.Knowledge(share=0.0))
    guessed = guessed._replace(light=guessed.light + off)
    seen = photometric.observe(shots.pictures[0] ** 2.2, guessed, STEM)
    derived, slopes, *_ = photometric.read(most(seen.raw), STEM)
    assert sum(part.shape[1] for part in derived) == photometric.derived_count(STEM)
    assert (derived[0] == 0.5).all()
    assert angle_deg(slopes) < 0.85 * angle_deg(torch.zeros_like(slopes))


def test_an_untrained_network_with_poses_is_photometric_stereo():
    rng = torch.Generator().manual_seed(4)
    shots = scenes.shots(waves(), 16, rng, "rig")
    poses = scenes.known(shots, rng, scenes.Knowledge())
    with torch.no_grad():
        maps = Network(EDGE)(shots.pictures, poses)
    slopes = photometric.read(fused(16), STEM).slopes
    torch.testing.assert_close(
        maps.normal[..., :2] / maps.normal[..., 2:],
        shuffled(slopes).permute(0, 2, 3, 1),
        atol=1e-3,
        rtol=1e-3,
    )


def test_what_is_told_is_wrong_by_as_much_as_asked():
    rng = torch.Generator().manual_seed(0)
    shots = scenes.shots(waves(), 12, rng, "rig")
    told = scenes.known(shots, rng, scenes.Knowledge(light_deg=1.0, power=0.02))
    true = shots.poses.light[0]
    cosine = torch.nn.functional.cosine_similarity(told.light, true)
    assert 0.5 < torch.rad2deg(torch.acos(cosine)).mean() < 2.5
    ratio = (told.white / shots.white[0]).log().mean(dim=(1, 2, 3))
    assert 0.008 < ratio.std() < 0.04


def test_the_albedo_around_a_highlight_is_not_the_highlight():
    albedo = torch.full((1, 3, 4, 32, 32), -0.5)
    albedo[..., 14:20, 14:20] = 1.0
    assert photometric.around(albedo) == pytest.approx(-0.5, abs=0.01)


def test_what_shines_fits_worse_than_what_is_matte():
    matte, metal = (
        photometric.read(fused(16, maps=maps), STEM).fit[0, 0]
        for maps in (waves(), waves(roughness=0.4, specular=0.6))
    )
    assert matte < metal - 1
