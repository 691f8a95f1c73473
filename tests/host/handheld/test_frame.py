import numpy as np
import pypdfium2
import pytest

from turnlight.errors import ConfigError
from turnlight.handheld.finding import find_frame
from turnlight.handheld.sheet import Paper, frame_of_size, pdf
from turnlight.picture.marked_frame import LARGEST_MM, SMALLEST_MM, MarkedFrame, frame_of
from turnlight.picture.warp import Image

DPI = 200


def printed(side_mm: int, paper: Paper) -> Image:
    page = pypdfium2.PdfDocument(pdf(MarkedFrame(side_mm), paper, 0.85))[0]
    pixels = page.render(scale=DPI / 72, grayscale=True).to_numpy()
    return np.asarray(pixels.reshape(pixels.shape[:2]), np.float32) / 255


@pytest.mark.parametrize("paper", Paper)
@pytest.mark.parametrize("side_mm", [SMALLEST_MM, 100, LARGEST_MM])
def test_the_page_is_true_to_scale_and_says_its_size(side_mm: int, paper: Paper) -> None:
    seen = find_frame(printed(side_mm, paper))
    assert seen is not None
    assert seen.frame.side_mm == side_mm
    assert list(seen.places) == list(range(8))
    seen_mm = seen.corners_px / DPI * 25.4 * [1, -1]
    off = seen_mm - seen.known_mm
    off -= off.mean(axis=(0, 1))
    assert abs(off).max() < 0.05


def test_the_page_has_a_ruler_and_words() -> None:
    page = pypdfium2.PdfDocument(pdf(MarkedFrame(100), Paper.A4, 0.9))[0]
    text = page.get_textpage().get_text_range()
    assert "100 x 100 mm" in text
    assert "0.9" in text
    bottom = printed(100, Paper.A4)[-round(30 / 25.4 * DPI) :]
    dark = np.flatnonzero((bottom < 0.5).sum(axis=1) > 90 / 25.4 * DPI)
    [columns] = np.nonzero(bottom[dark[0]] < 0.5)
    assert (columns[-1] - columns[0]) / DPI * 25.4 == pytest.approx(100, abs=0.3)


def test_no_two_sizes_share_a_marker() -> None:
    sizes = [MarkedFrame(side) for side in range(SMALLEST_MM, LARGEST_MM + 1)]
    numbers = [number for frame in sizes for number in frame.ids]
    assert len(set(numbers)) == len(numbers) <= 1000
    assert all(frame_of(frame.ids[3]) == (frame, 3) for frame in sizes)


@pytest.mark.parametrize("text", ["100x100mm", "100 x 100 mm", "100mm", "10cm", "100", "100×100MM"])
def test_sizes_as_people_write_them(text: str) -> None:
    assert frame_of_size(text) == MarkedFrame(100)


@pytest.mark.parametrize("text", ["", "big", "100x80mm", "10mm", "200mm", "50.5mm", "-50mm"])
def test_sizes_that_cannot_be(text: str) -> None:
    with pytest.raises(ConfigError, match=r"\.$"):
        frame_of_size(text)


def test_what_is_called_paper_is_bare() -> None:
    for side_mm in (SMALLEST_MM, 60, LARGEST_MM):
        frame = MarkedFrame(side_mm)
        drawn = frame.draw(4.0)
        grid = ((np.arange(len(drawn)) + 0.5) / len(drawn) - 0.5) * frame.outer_mm
        points = np.stack(np.meshgrid(grid, -grid), axis=-1)
        paper = frame.is_paper(points, 1.0)
        assert drawn[paper].min() == 1
        inside = (abs(points) < frame.side_mm / 2).all(axis=-1)
        assert not paper[inside].any()
        assert paper.mean() > 0.05
