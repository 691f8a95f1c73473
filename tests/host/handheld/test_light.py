from dataclasses import replace

import numpy as np
import pytest

from turnlight.handheld.flash import Clue, flash_mm, flash_offset, highlight, mirror_point
from turnlight.handheld.shading import Source, find_lamp, read_shading
from turnlight.handheld.tone import tone
from turnlight.handheld.unwarp import Grey, PaperLight
from turnlight.picture.marked_frame import MarkedFrame

FRAME = MarkedFrame(100)
SCALE_MM = FRAME.outer_mm / 2


def paper(light_mm: np.ndarray, *, shade: float = 0.0, tint: float = 1.0) -> PaperLight:
    """Lit by a lamp at light_mm; a straight shadow of the width 30 mm takes a share of the light."""
    grid = np.linspace(-SCALE_MM, SCALE_MM, 120)
    points = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    points = points[FRAME.is_paper(points, 1.0)]
    square = np.sum((points - light_mm[:2]) ** 2, axis=-1) + light_mm[2] ** 2
    value = 0.6 * light_mm[2] * np.dot(light_mm, light_mm) / square**1.5
    value *= 1 - shade * (abs(points[:, 0] - 20) < 15) * (points[:, 1] > 0)
    noise = np.random.default_rng(0).normal(1, 0.01, (len(points), 3))
    return PaperLight(points, value[:, None] * [tint, 1, 1 / tint] * noise, 0.0)


@pytest.mark.parametrize("light", [(30, -20, 220), (-150, 60, 180), (200, 150, 200)])
def test_a_lamp_is_found_from_the_shading(light: tuple[float, float, float]) -> None:
    light_mm = np.array(light, dtype=float)
    found = find_lamp(paper(light_mm), SCALE_MM)
    assert found is not None
    assert np.linalg.norm(found - light_mm) < 0.06 * np.linalg.norm(light_mm)


def test_flash_lamp_and_neither() -> None:
    here, there = np.array([60.0, 0, 200]), np.array([-200.0, 80, 250])
    seen = paper(here, tint=1.2)
    by_flash = read_shading(seen, here, here, SCALE_MM)
    assert by_flash.source is Source.FLASH
    assert by_flash.colour == pytest.approx([1.2, 1, 1 / 1.2], rel=0.01)
    facing = 0.6 * here[2] / np.linalg.norm(here)
    assert by_flash.reading(np.zeros(2)) == pytest.approx(facing, rel=0.02)
    assert by_flash.shadow < 0.005
    lamp = read_shading(seen, there, here, SCALE_MM)
    assert lamp.source is Source.LAMP
    assert read_shading(seen, there, there, SCALE_MM).source is Source.UNKNOWN


def test_a_shadow_is_seen_and_does_not_darken_what_is_around() -> None:
    light = np.array([60.0, 0, 200])
    shaded = read_shading(paper(light, shade=0.5), light, light, SCALE_MM)
    assert shaded.shadow > 0.04
    assert shaded.reading(np.array([-60.0, -60])) == pytest.approx(
        read_shading(paper(light), light, light, SCALE_MM).reading(np.array([-60.0, -60])), rel=0.05
    )


def looking_from(camera_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    forward = -camera_mm / np.linalg.norm(camera_mm)
    right = np.cross(forward, [0, 1.0, 0.3])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return rotation, -rotation @ camera_mm


def test_the_flash_beside_the_lens_is_found_from_shading_and_highlights() -> None:
    rng = np.random.default_rng(1)
    true = np.array([14.0, -6.0])
    clues = []
    for camera in ((40.0, 30, 240), (-80, 60, 200), (0, -120, 180), (90, -10, 210)):
        pose = looking_from(np.array(camera))
        lamp = flash_mm(pose, true) + rng.normal(0, 4, 3)
        shine = mirror_point(pose, true) + rng.normal(0, 1.5, 2)
        clues.append(Clue(pose, lamp, shine))
    assert np.linalg.norm(flash_offset(clues) - true) < 4
    far = Clue(clues[0].pose, np.array([300.0, 0, 300]), None)
    assert not flash_offset([far]).any()


def test_a_highlight_is_found_where_there_is_one() -> None:
    rows, columns = np.mgrid[:200, :200]
    shine = np.exp(-((columns - 140) ** 2 + (rows - 60) ** 2) / (2 * 12**2))
    image = np.repeat((0.1 + 0.8 * shine)[..., None], 3, axis=-1).astype(np.float32)
    nowhere = np.zeros((200, 200), dtype=bool)
    found = highlight(image, nowhere, 100.0)
    assert found == pytest.approx([20.25, 19.75], abs=0.5)
    assert highlight(np.full((200, 200, 3), 0.3, np.float32), nowhere, 100.0) is None


@pytest.mark.parametrize("gamma", [0.6, 1.0, 1.8])
def test_grey_patches_tell_the_tone_curve(gamma: float) -> None:
    light = np.array([60.0, 0, 200])
    seen = paper(light)
    lit = read_shading(seen, light, light, SCALE_MM)
    patches = [
        (p.value, np.array([p.left + p.right, p.bottom + p.top]) / 2) for p in FRAME.patches()[1:]
    ]
    greys = [Grey(v, middle, float(lit.reading(middle)) * v**gamma) for v, middle in patches]
    assert tone(replace(seen, greys=tuple(greys)), lit) == pytest.approx(gamma, rel=0.01)
    assert tone(replace(seen, greys=tuple(greys[:2])), lit) is None
    covered = (*greys[:2], replace(greys[2], reading=1.0))
    assert tone(replace(seen, greys=covered), lit) is None
