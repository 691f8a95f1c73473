import cv2
import numpy as np

from turnlight.handheld.finding import find_frame
from turnlight.picture.marked_frame import MarkedFrame
from turnlight.picture.pinhole import project
from turnlight.picture.warp import Image

FRAME = MarkedFrame(60)
PER_MM = 8.0


def seen_through(homography: np.ndarray, hidden: tuple[int, ...] = ()) -> Image:
    """The frame on grey. homography: from mm."""
    drawing = FRAME.draw(PER_MM)
    for place in hidden:
        x, y = FRAME.marker_centres_mm()[place]
        column, row = (np.array([x, -y]) + FRAME.outer_mm / 2) * PER_MM
        half = round(FRAME.marker_mm / 2 * PER_MM)
        drawing[
            round(row) - half : round(row) + half, round(column) - half : round(column) + half
        ] = 0.4
    half = FRAME.outer_mm / 2
    to_mm = np.array([[1 / PER_MM, 0, -half], [0, -1 / PER_MM, half], [0, 0, 1]])
    shift = np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1]])
    whole = shift @ homography @ to_mm @ np.linalg.inv(shift)
    image = cv2.warpPerspective(drawing, whole, (900, 800), flags=cv2.INTER_LINEAR, borderValue=0.5)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.8), np.float32)


TILTED = np.array([[6.0, 0.8, 440], [0.5, -4.6, 400], [0.0006, -0.0012, 1]])


def test_corners_are_found_to_a_fraction_of_a_pixel() -> None:
    seen = find_frame(seen_through(TILTED))
    assert seen is not None and len(seen.places) == 8
    off = np.linalg.norm(seen.corners_px - project(TILTED, seen.known_mm), axis=-1)
    assert np.median(off) < 0.15
    assert off.max() < 0.3


def test_half_of_the_markers_are_enough() -> None:
    seen = find_frame(seen_through(TILTED, hidden=(0, 2, 5, 7)))
    assert seen is not None
    assert list(seen.places) == [1, 3, 4, 6]
    assert find_frame(seen_through(TILTED, hidden=(0, 2, 4, 5, 7))) is None


def test_another_frame_in_the_picture_is_no_concern() -> None:
    image = seen_through(TILTED)
    bits = cv2.aruco.generateImageMarker(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000), MarkedFrame(61).ids[2], 60
    )
    image[700:780, 20:100] = 1
    image[710:770, 30:90] = bits / 255
    seen = find_frame(image)
    assert seen is not None and seen.frame == FRAME


def test_nothing_is_found_in_nothing() -> None:
    assert find_frame(np.zeros((300, 400), np.float32)) is None
    noise = np.random.default_rng(0).random((300, 400), np.float32)
    assert find_frame(noise) is None
