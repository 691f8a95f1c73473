"""Photos of every kind: the light in them, which way is up, and what they say of the camera."""

import math
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from photo_files import (
    icc_profile,
    phone_exif,
    scene,
    turned_heic,
    write_dng,
    write_heic,
)
from PIL import ExifTags, Image, ImageCms, ImageOps

from turnlight.errors import ImageError
from turnlight.handheld import decode, icc
from turnlight.handheld.photo import read_photo

P3_TO_SRGB = np.array([[1.2249, -0.2249, 0], [-0.0420, 1.0420, 0], [-0.0197, -0.0786, 1.0983]])
ADOBE = {"r": (0.60974, 0.31111, 0.01947), "g": (0.20528, 0.62567, 0.06087)}
ADOBE["b"] = (0.14919, 0.06322, 0.74457)
CODING = 0.008
"""What JPEG and HEIC may be off in the mean."""


def srgb_light(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.float64]:
    coded = image / 255
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def light_of(path: Path) -> npt.NDArray[np.float32]:
    read = decode.decoded(path)
    return read.colour.linear(read.upright)


def test_a_phones_jpeg(tmp_path: Path) -> None:
    path = tmp_path / "IMG 0001.JPG"
    Image.fromarray(scene()).save(path, "jpeg", quality=98, subsampling=0, exif=phone_exif())
    photo = read_photo(path)
    assert np.abs(photo.pixels - srgb_light(scene())).mean() < CODING
    assert (photo.pixels.dtype, photo.clipped.dtype) == (np.float32, np.bool_)
    assert photo.clipped[:14, :22].all() and not photo.clipped[18:].any()
    assert photo.focal_px == pytest.approx(26 / 43.267 * math.hypot(96, 64))
    assert photo.device == "Turnlight Phone 1" and photo.name == "IMG 0001.JPG"
    assert photo.taken == datetime(2026, 11, 22, 17, 30, tzinfo=UTC)
    assert len(photo.sha256) == 64


@pytest.mark.parametrize("name", ["a.png", "a.tiff"])
def test_sixteen_bits_are_kept(tmp_path: Path, name: str) -> None:
    steps = np.arange(64 * 96 * 3, dtype=np.uint16).reshape(64, 96, 3) + 20_000
    cv2.imwrite(str(tmp_path / name), steps[..., ::-1])
    light = light_of(tmp_path / name)
    assert len(np.unique(light)) == steps.size
    expected = ((steps / 65535 + 0.055) / 1.055) ** 2.4
    assert np.abs(light - expected).max() < 1e-6


def test_grey_palette_and_alpha_are_pictures_too(tmp_path: Path) -> None:
    image = Image.fromarray(scene())
    for mode, name in (("L", "grey.png"), ("P", "palette.png"), ("RGBA", "alpha.png")):
        image.convert(mode).save(tmp_path / name)
        assert light_of(tmp_path / name).shape == (64, 96, 3)
    assert np.ptp(light_of(tmp_path / "grey.png"), axis=-1).max() == 0


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_says_which_way_is_up(tmp_path: Path, orientation: int) -> None:
    path = tmp_path / "turned.png"
    Image.fromarray(scene()).save(path, exif=phone_exif(orientation))
    expected = np.asarray(ImageOps.exif_transpose(Image.open(path)))
    assert np.array_equal(decode.decoded(path).upright, expected)


def test_display_p3_and_adobe_rgb(tmp_path: Path) -> None:
    image, light = Image.fromarray(scene()), srgb_light(scene())
    image.save(tmp_path / "p3.png", icc_profile=icc_profile())
    assert np.abs(light_of(tmp_path / "p3.png") - light @ P3_TO_SRGB.T).max() < 2e-3
    image.save(tmp_path / "adobe.tiff", icc_profile=icc_profile(ADOBE, (2.19921875,)))
    image.save(tmp_path / "r03.jpg", quality=98, subsampling=0, exif=_adobe_exif())
    from_profile, from_exif = light_of(tmp_path / "adobe.tiff"), light_of(tmp_path / "r03.jpg")
    grey = (scene()[5, 5] / 255.0) ** 2.19921875
    assert np.abs(from_profile[5, 5] - grey).max() < 2e-3
    assert np.abs(from_profile - from_exif).mean() < CODING
    assert np.abs(from_profile - light).max() > 0.02


def test_a_profile_of_srgb_changes_nothing(tmp_path: Path) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.fromarray(scene()).save(tmp_path / "a.png", icc_profile=profile)
    assert np.abs(light_of(tmp_path / "a.png") - srgb_light(scene())).max() < 1e-3


def test_a_table_is_a_curve_too() -> None:
    profile = icc_profile(curve=(1.0,))
    (at,) = {profile.index(b"para")}
    table = b"curv\0\0\0\0\0\0\0\1\2\0\0\0"
    read = icc.read_profile(profile[:at] + table + profile[at + len(table) :])
    assert read.curves[0][32768] == pytest.approx(0.25, abs=1e-4)


@pytest.mark.parametrize("profile", [b"", b"nonsense", icc_profile()[:200], icc_profile()[:300]])
def test_a_damaged_profile_is_known_as_such(profile: bytes) -> None:
    with pytest.raises(icc.ProfileError):
        icc.read_profile(profile)


def test_a_profile_of_another_kind_is_refused(tmp_path: Path) -> None:
    other = icc_profile().replace(b"rTRC", b"A2B0")
    Image.fromarray(scene()).save(tmp_path / "a.jpg", icc_profile=other)
    with pytest.raises(ImageError, match=r"a\.jpg has a colour profile .* save it as sRGB"):
        read_photo(tmp_path / "a.jpg")


def test_heic(tmp_path: Path) -> None:
    path = write_heic(tmp_path / "a.heic", scene(), exif=phone_exif(), icc_profile=icc_profile())
    photo = read_photo(path)
    assert np.abs(photo.pixels - srgb_light(scene()) @ P3_TO_SRGB.T).mean() < CODING
    assert photo.device == "Turnlight Phone 1" and photo.focal_px and photo.taken


def test_heic_of_ten_bits(tmp_path: Path) -> None:
    sixteen = scene().astype(np.uint16) * 257
    light = light_of(write_heic(tmp_path / "a.heic", sixteen, "-b", "10"))
    assert np.abs(light - srgb_light(scene())).mean() < CODING


def test_heic_is_turned_by_its_own_property_and_not_twice(tmp_path: Path) -> None:
    path = write_heic(tmp_path / "a.heic", scene(), exif=phone_exif(6).tobytes())
    lying = light_of(path)
    upright = light_of(turned_heic(path, 3))
    assert np.array_equal(upright, np.rot90(lying, -1))


@pytest.mark.parametrize("orientation", [1, 6])
def test_dng(tmp_path: Path, orientation: int) -> None:
    light = srgb_light(scene(192, 128))
    photo = read_photo(write_dng(tmp_path / "a.dng", light, orientation))
    expected = light if orientation == 1 else np.rot90(light, -1)
    assert np.abs(photo.pixels - expected)[8:-8, 8:-8].mean() < 2e-3
    assert photo.clipped.mean() == pytest.approx(1 / 16, abs=0.02)
    assert photo.device == "Turnlight Phone 1"


def test_the_focal_length_from_the_sensors_pitch() -> None:
    exif = Image.Exif()
    camera = exif.get_ifd(ExifTags.IFD.Exif)
    camera[ExifTags.Base.FocalLength] = 50.0
    camera[ExifTags.Base.FocalPlaneXResolution] = 200.0
    camera[ExifTags.Base.FocalPlaneResolutionUnit] = 4
    camera[ExifTags.Base.ExifImageWidth] = 6000
    assert decode.Metadata.of(exif).focal_px(3000, 2000) == pytest.approx(5000)


def test_a_camera_that_says_nothing(tmp_path: Path) -> None:
    Image.fromarray(scene()).save(tmp_path / "a.png")
    photo = read_photo(tmp_path / "a.png")
    assert (photo.focal_px, photo.device, photo.taken) == (None, None, None)


def _adobe_exif() -> Image.Exif:
    exif = phone_exif()
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.IFD.Interop] = {1: "R03"}
    return exif
