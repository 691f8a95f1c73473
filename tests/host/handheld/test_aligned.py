import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from photo_files import scene, write_dng, write_heic
from PIL import Image, ImageCms

from turnlight.errors import ImageError
from turnlight.handheld.aligned import load_aligned
from turnlight.picture.front_end import network_input


def colours(resolution: int, dtype: type = np.uint8) -> np.ndarray:
    """RGB, smooth, different in every corner."""
    ramp = np.linspace(0.1, 0.9, resolution)
    image = np.stack([*np.meshgrid(ramp, ramp), np.full((resolution,) * 2, 0.3)], axis=-1)
    return (image * np.iinfo(dtype).max).astype(dtype)


def written(path: Path, rgb: np.ndarray) -> Path:
    assert cv2.imwrite(str(path), rgb[..., ::-1] if rgb.ndim == 3 else rgb)
    return path


def test_png_is_decoded_to_linear_rgb(tmp_path: Path) -> None:
    bits = colours(64)
    picture = load_aligned(written(tmp_path / "a.png", bits))
    np.testing.assert_allclose(picture.image, (bits / 255) ** 2.2, atol=1e-6)
    assert picture.image.dtype == np.float32
    assert picture.gain == 1.0
    assert picture.valid.shape == (64, 64)
    assert picture.valid.all()


def test_a_256_png_reaches_the_network_unchanged(tmp_path: Path) -> None:
    bits = np.random.default_rng(0).integers(0, 256, (256, 256, 3), np.uint8)
    picture = load_aligned(written(tmp_path / "a.png", bits))
    np.testing.assert_array_equal(network_input(picture), bits)


@pytest.mark.parametrize("name", ["a.png", "a.tiff"])
def test_sixteen_bits_are_kept(tmp_path: Path, name: str) -> None:
    bits = colours(64, np.uint16)
    picture = load_aligned(written(tmp_path / name, bits))
    np.testing.assert_allclose(picture.image, (bits / 65535) ** 2.2, atol=1e-6)


def test_jpeg_is_read(tmp_path: Path) -> None:
    bits = colours(64)
    picture = load_aligned(written(tmp_path / "a.jpg", bits))
    np.testing.assert_allclose(picture.image, (bits / 255) ** 2.2, atol=0.05)


def test_heic_dng_and_a_profile_say_themselves_how_they_are_coded(tmp_path: Path) -> None:
    bits = scene(64, 64)
    heic = load_aligned(write_heic(tmp_path / "a.heic", bits))
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.fromarray(bits).save(tmp_path / "a.png", icc_profile=profile)
    png = load_aligned(tmp_path / "a.png")
    assert np.abs(heic.image - png.image).mean() < 0.008
    assert np.abs(png.image - (bits / 255.0) ** 2.2).max() > 0.005
    dng = load_aligned(write_dng(tmp_path / "a.dng", np.full((64, 64, 3), 0.4)))
    assert dng.image.shape == (64, 64, 3)


def test_grey_is_repeated_and_alpha_dropped(tmp_path: Path) -> None:
    bits = colours(64)
    grey = load_aligned(written(tmp_path / "grey.png", bits[..., 0]))
    np.testing.assert_allclose(grey.image[..., 1], (bits[..., 0] / 255) ** 2.2, atol=1e-6)
    bgra = np.dstack([bits[..., ::-1], np.full((64, 64), 40, np.uint8)])
    assert cv2.imwrite(str(tmp_path / "alpha.png"), bgra)
    picture = load_aligned(tmp_path / "alpha.png")
    np.testing.assert_allclose(picture.image, (bits / 255) ** 2.2, atol=1e-6)


def test_exif_rotation_is_honoured(tmp_path: Path) -> None:
    """Orientation 6: the camera was turned; the stored left edge is the picture's top."""
    bits = colours(64)
    path = written(tmp_path / "a.jpg", bits)
    plain = load_aligned(path).image
    data = path.read_bytes()
    entry = struct.pack("<HHIHH", 0x0112, 3, 1, 6, 0)
    exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0" + entry + b"\0\0\0\0"
    segment = b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif
    path.write_bytes(data[:2] + segment + data[2:])
    np.testing.assert_array_equal(load_aligned(path).image, np.rot90(plain, -1))


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
def test_a_damaged_file_is_refused(tmp_path: Path, name: str) -> None:
    path = written(
        tmp_path / name, np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    )
    data = path.read_bytes()
    for share in (0.02, 0.5, 0.99):
        path.write_bytes(data[: int(len(data) * share)])
        with pytest.raises(ImageError, match=r"copy it again|is no JPEG"):
            load_aligned(path)


def test_a_png_with_rotten_data_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "a.png", colours(64))
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 40] = bytes(40)
    path.write_bytes(data)
    with pytest.raises(ImageError, match="damaged"):
        load_aligned(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="There is no file"):
        load_aligned(tmp_path / "nowhere.png")
    with pytest.raises(ImageError, match="cannot be read"):
        load_aligned(tmp_path)


@pytest.mark.parametrize(
    "content", [b"", b"hello, I am a text", b"GIF89a", b"\xff\xd8", b"%PDF-1.7"]
)
def test_what_is_no_image_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(content)
    with pytest.raises(ImageError):
        load_aligned(path)


@pytest.mark.parametrize("size", [(1, 1), (15, 15)])
def test_tiny_pictures_are_refused(tmp_path: Path, size: tuple[int, int]) -> None:
    path = written(tmp_path / "a.png", np.zeros((*size, 3), np.uint8))
    with pytest.raises(ImageError, match="take a larger photo"):
        load_aligned(path)


def test_pictures_that_are_not_square_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "a.jpg", np.zeros((64, 96, 3), np.uint8))
    with pytest.raises(ImageError, match="96x64 pixels and not square"):
        load_aligned(path)


def test_huge_pictures_are_refused_before_they_are_decoded(tmp_path: Path) -> None:
    header = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0)
    chunk = (
        struct.pack(">I", 13) + b"IHDR" + header + struct.pack(">I", zlib.crc32(b"IHDR" + header))
    )
    end = b"\0\0\0\0IEND" + struct.pack(">I", zlib.crc32(b"IEND"))
    path = tmp_path / "bomb.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk + end)
    with pytest.raises(ImageError, match="64 million"):
        load_aligned(path)


def test_sixteen_pixels_are_enough(tmp_path: Path) -> None:
    assert load_aligned(written(tmp_path / "a.png", colours(16))).image.shape == (16, 16, 3)
