"""Pictures under random scenes."""

import pytest
import torch

from svbrdf import scenes
from svbrdf.maps import Maps

LEVEL = 1 / 255


def pictures(kind: str, roughness: float = 0.5, albedo: float = 0.5) -> torch.Tensor:
    flat = torch.tensor([0.0, 0.0, 1.0]).expand(4, 32, 32, 3)
    levels = ((albedo, 3), (roughness, 1), (0.5, 3))
    matte = (torch.full((4, 32, 32, channels), level) for level, channels in levels)
    return scenes.shots(Maps(flat, *matte), 3, torch.Generator().manual_seed(1), kind).pictures


@pytest.mark.parametrize("kind", ["handheld", "flash"])
def test_tone_curve_of_a_phone_is_one_per_material(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(scenes.TONED_SHARES, kind, 0.0)
    plain = pictures(kind)
    monkeypatch.setitem(scenes.TONED_SHARES, kind, 1.0)
    toned = pictures(kind)
    assert (toned - plain).abs().max() > 0.05
    for before, after in zip(plain, toned, strict=True):
        order = before.flatten().argsort()
        tone = after.flatten()[order]
        assert (tone.diff() > -2.5 * LEVEL).all()
        values = before.flatten()[order]
        assert (tone < values + 1.5 * LEVEL)[values < 0.5].all()
        assert (tone > values - 1.5 * LEVEL)[values > 0.5].all()


@pytest.fixture
def exposed(monkeypatch: pytest.MonkeyPatch) -> None:
    """No exposure by the camera itself, which would answer what a test changes."""
    monkeypatch.setattr(scenes, "_exposure", lambda *_: torch.full((12, 1, 1, 1), 0.1))


@pytest.mark.usefixtures("exposed")
def test_materials_may_shine_wider_than_one_lobe(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(scenes.GLARE, "flash", 1e-9)
    monkeypatch.setitem(scenes.TAILED_SHARES, "flash", 0.0)
    narrow = pictures("flash", roughness=0.3, albedo=0.0).flatten(2)
    monkeypatch.setitem(scenes.TAILED_SHARES, "flash", 1.0)
    wide = pictures("flash", roughness=0.3, albedo=0.0).flatten(2)
    highlight = narrow > 0.6
    assert highlight.sum() > 100 and wide[highlight].mean() < narrow[highlight].mean() - 3 * LEVEL
    dark = narrow < 0.1
    assert dark.sum() > 100 and wide[dark].mean() > 1.1 * narrow[dark].mean()


@pytest.mark.usefixtures("exposed")
def test_a_lens_scatters_light_into_the_dark(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(scenes.GLARE, "flash", 1e-9)
    plain = pictures("flash", roughness=0.2, albedo=0.0)
    monkeypatch.setitem(scenes.GLARE, "flash", 0.2)
    hazy = pictures("flash", roughness=0.2, albedo=0.0)
    assert (hazy > plain - 1.5 * LEVEL).all()
    dark = plain < 0.1
    assert dark.sum() > 100 and hazy[dark].mean() > 1.05 * plain[dark].mean()
