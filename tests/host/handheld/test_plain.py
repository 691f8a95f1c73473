import cv2
import numpy as np
import pytest

from svbrdf.procedural import TEST_SEEDS, material
from turnlight.handheld.finding import find_plain
from turnlight.handheld.lens import TYPICAL_FOCAL, View, fit_lens, plane_of, pose_of
from turnlight.handheld.plain import PlainFrame
from turnlight.picture.pinhole import project
from turnlight.picture.warp import Image

SIDE_MM, PER_MM = 100, 5.0
WIDTH, HEIGHT = 1600, 1200


def photo(sample: Image) -> tuple[Image, np.ndarray]:
    """A sample (n, n, 3) in white paper on grey, seen from a side; and the opening's corners."""
    half = SIDE_MM / 2
    page = np.full((round(150 * PER_MM),) * 2 + (3,), 0.8, np.float32)
    size = round(SIDE_MM * PER_MM)
    start = (len(page) - size) // 2
    page[start : start + size, start : start + size] = cv2.resize(sample, (size, size))
    corners_page = np.array([(0, 0), (size, 0), (size, size), (0, size)]) + start
    turn, _ = cv2.Rodrigues(np.array([2.6, 0.35, 0.2]))
    focal = TYPICAL_FOCAL * WIDTH
    camera = np.array([[focal, 0, WIDTH / 2], [0, focal, HEIGHT / 2], [0, 0, 1.0]])
    plane = camera @ np.column_stack([turn[:, :2], [4.0, -3, 260]])
    corners_mm = np.array([(-half, half), (half, half), (half, -half), (-half, -half)])
    seen = project(plane, corners_mm)
    to_photo = cv2.getPerspectiveTransform(
        (corners_page - 0.5).astype(np.float32), (seen - 0.5).astype(np.float32)
    )
    image = cv2.warpPerspective(
        page, to_photo, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR, borderValue=(0.2, 0.2, 0.2)
    )
    across = np.linspace(1.0, 0.6, WIDTH, dtype=np.float32)[None, :, None]
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.8) * across, np.float32), seen


@pytest.mark.parametrize("seed", TEST_SEEDS[:4])
def test_the_opening_is_found(seed: int) -> None:
    image, corners = photo(material(seed, 256).diffuse * 0.6)
    seen = find_plain(image, SIDE_MM)
    assert seen is not None and seen.frame == PlainFrame(SIDE_MM)
    assert np.linalg.norm(seen.corners_px[0] - corners, axis=-1).max() < 1.0
    lens = fit_lens([View(seen, WIDTH, HEIGHT, None)])
    assert np.linalg.norm(project(plane_of(seen, lens), np.zeros(2)) - project_middle(corners)) < 2
    rotation, translation = pose_of(seen, lens)
    assert (-rotation.T @ translation)[2] > 100


def test_a_sample_as_white_as_its_frame_is_not_found() -> None:
    image, _ = photo(np.full((64, 64, 3), 0.8, np.float32))
    assert find_plain(image, SIDE_MM) is None


def test_nothing_is_found_in_nothing() -> None:
    assert find_plain(np.zeros((300, 400, 3), np.float32), SIDE_MM) is None


def project_middle(corners: np.ndarray) -> np.ndarray:
    """Where the diagonals cross."""
    lines = [np.cross([*corners[i], 1], [*corners[i + 2], 1]) for i in (0, 1)]
    crossing = np.cross(*lines)
    return np.asarray(crossing[:2] / crossing[2])
