"""Pictures under random scenes."""

import pytest
import torch

from svbrdf import scenes
from svbrdf.maps import Maps

LEVEL = 1 / 255


def pictures(kind: str) -> torch.Tensor:
    matte = (torch.full((4, 32, 32, channels), 0.5) for channels in (3, 1, 3))
    flat = torch.tensor([0.0, 0.0, 1.0]).expand(4, 32, 32, 3)
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
