"""Files that mean harm, or are no photo: refused with a sentence, in little memory."""

import functools
import json
import os
import random
import shutil
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from photo_files import png_chunk, png_of, scene, write_heic
from PIL import Image

from turnlight.errors import ImageError
from turnlight.handheld.kind import Kind, NotAPhotoError, kind_of
from turnlight.handheld.photo import read_photo

MOST_KIB = 1_000_000_000 // 1024
MEASURE = """
import json, resource, sys
from pathlib import Path
from turnlight.errors import ImageError
from turnlight.handheld.photo import read_photo
try:
    said = str(read_photo(Path(sys.argv[1])).pixels.shape)
except ImageError as error:
    said = str(error)
# rusage would count what the tests' own process had when it started this one
own_kib = int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0])
decoder_kib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
print(json.dumps([said, own_kib + decoder_kib]))
"""


def measured(path: Path) -> str:
    """What reading it says; both processes together stay under 1 GB."""
    run = [sys.executable, "-c", MEASURE, str(path)]
    done = subprocess.run(run, capture_output=True, text=True, timeout=110, check=True)
    said, peak_kib = json.loads(done.stdout)
    assert peak_kib < MOST_KIB, (said, peak_kib)
    return said


def test_a_gigapixel_bomb(tmp_path: Path) -> None:
    """40000 x 40000 pixels, 4.8 GB of them in 5 MB of PNG."""
    path = tmp_path / "bomb.png"
    packer = zlib.compressobj(9)
    head = packer.compress(b"") + packer.flush(zlib.Z_FULL_FLUSH)
    rows = packer.compress(bytes(400 * 120_001)) + packer.flush(zlib.Z_FULL_FLUSH)
    path.write_bytes(png_of(40_000, 40_000, head + rows * 100 + packer.flush()))
    said = measured(path)
    assert said.startswith("bomb.png has 40000x40000 pixels") and "set the camera" in said


def test_a_bomb_in_a_profile(tmp_path: Path) -> None:
    bomb = b"icc\0\0" + zlib.compress(bytes(500_000_000), 1)
    path = tmp_path / "bomb.png"
    path.write_bytes(png_of(64, 64, zlib.compress(bytes(64 * 193)), png_chunk(b"iCCP", bomb)))
    assert "bomb.png" in measured(path)


def test_a_tiff_and_a_jpeg_that_say_they_are_huge(tmp_path: Path) -> None:
    Image.fromarray(scene()).save(tmp_path / "a.jpg")
    data = (tmp_path / "a.jpg").read_bytes()
    small, huge = struct.pack(">HH", 64, 96), struct.pack(">HH", 65_000, 65_000)
    (tmp_path / "huge.jpg").write_bytes(data.replace(small, huge, 1))
    assert "65000x65000" in measured(tmp_path / "huge.jpg")
    Image.fromarray(scene()).save(tmp_path / "a.tiff")
    data = (tmp_path / "a.tiff").read_bytes()
    tags = [struct.pack("<HHII", tag, 4, 1, 65_000) for tag in (256, 257)]
    for tag, value, huge in zip((256, 257), (96, 64), tags, strict=True):
        for kind, form in ((4, "<HHII"), (3, "<HHIHxx")):
            data = data.replace(struct.pack(form, tag, kind, 1, value), huge)
    (tmp_path / "huge.tiff").write_bytes(data)
    assert "65000x65000" in measured(tmp_path / "huge.tiff")


@pytest.mark.parametrize(
    ("side", "told", "why"),
    [(64, 60_000, "has 60000x60000 pixels"), (2048, 64, "heic is damaged|lies about its size")],
)
def test_a_heic_that_lies_about_its_size(tmp_path: Path, side: int, told: int, why: str) -> None:
    path = write_heic(tmp_path / "lie.heic", scene(side, side))
    data = bytearray(path.read_bytes())
    at = data.index(b"ispe") + 8
    assert data[at : at + 8] == struct.pack(">II", side, side)
    data[at : at + 8] = struct.pack(">II", told, told)
    path.write_bytes(data)
    said = measured(path)
    assert any(w in said for w in why.split("|")), said


def test_a_file_of_600_megabytes_is_not_even_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "large.dng"
    path.write_bytes(b"II*\0")
    os.truncate(path, 600_000_000)
    assert "600 MB, more than the limit of 512" in measured(path)


def _zip_behind(path: Path) -> None:
    with zipfile.ZipFile(path, "a") as bundle:
        bundle.writestr("virus.html", "<html>")
    assert zipfile.is_zipfile(path)


def _behind(what: bytes, path: Path) -> None:
    with path.open("ab") as file:
        file.write(what)


def _in_a_comment(what: bytes, path: Path) -> None:
    data = path.read_bytes()
    comment = b"\xff\xfe" + struct.pack(">H", len(what) + 2) + what
    path.write_bytes(data[:2] + comment + data[2:])


_GIF_BEHIND = functools.partial(_behind, b"GIF89a" + bytes(100))
_SCRIPT = functools.partial(_in_a_comment, b"<SCRIPT>alert(1)</script>")
_PDF = functools.partial(_in_a_comment, b"%PDF-1.7 \n1 0 obj")
_TWISTS = [(kind, _zip_behind) for kind in ("jpg", "png", "tiff", "heic")]
_TWISTS += [(kind, _GIF_BEHIND) for kind in ("png", "heic")]
_TWISTS += [("jpg", _SCRIPT), ("jpg", _PDF), ("jpg", functools.partial(_behind, b"<HTML><body>"))]
_TWISTS += [("jpg", functools.partial(_behind, bytes(9000) + b"Rar!\x1a\x07\0" + bytes(99_000)))]


@pytest.mark.parametrize(("kind", "twist"), _TWISTS)
def test_polyglots(photos: Path, tmp_path: Path, kind: str, twist: Callable[[Path], None]) -> None:
    path = tmp_path / f"both.{kind}"
    shutil.copy(photos / f"plain.{kind}", path)
    kind_of(path)
    twist(path)
    with pytest.raises(NotAPhotoError, match=r"save it anew as JPEG\."):
        kind_of(path)


def test_what_phones_put_behind_a_jpeg_is_let_be(photos: Path, tmp_path: Path) -> None:
    """A gain map, a motion photo, Samsung's notes, zeros to fill a block."""
    jpeg = (photos / "plain.jpg").read_bytes()
    film = struct.pack(">I4s", 24, b"ftypmp42") + random.Random(1).randbytes(5_000_000)
    notes = b"\0\0\x01\x0a\x0e\0\0\0Image_UTC_Data1700000000000SEFHk\0\0\0\x01\0\0\0SEFT"
    path = tmp_path / "a.jpg"
    for behind in (jpeg, film, notes, film + notes, bytes(32_768)):
        path.write_bytes(jpeg + behind)
        assert kind_of(path) is Kind.JPEG
    assert read_photo(path).pixels.shape == (64, 96, 3)


@pytest.mark.parametrize("kind", ["jpg", "png", "tiff", "heic"])
def test_half_a_file(photos: Path, tmp_path: Path, kind: str) -> None:
    data = (photos / f"plain.{kind}").read_bytes()
    (tmp_path / "half").write_bytes(data[: len(data) // 2])
    with pytest.raises(ImageError, match=r"^half is (cut short|damaged); copy it again"):
        read_photo(tmp_path / "half")


@pytest.mark.parametrize(
    "content", [b"", b"\xff", b"hello, I am a photo", b"<svg xmlns='x'/>", b"GIF89a" + bytes(99)]
)
def test_no_photo_at_all(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.jpg").write_bytes(content)
    with pytest.raises(NotAPhotoError, match=r"save it as one of these|copy it again"):
        kind_of(tmp_path / "a.jpg")


def test_no_file() -> None:
    with pytest.raises(ImageError, match=r"There is no file /nowhere/a\.jpg; check the name"):
        read_photo(Path("/nowhere/a.jpg"))


def test_floats_are_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.tiff"), scene().astype(np.float32))
    with pytest.raises(ImageError, match=r"a\.tiff (is F, not RGB|holds float32|is damaged)"):
        read_photo(tmp_path / "a.tiff")


def test_damaged_files_end_in_a_sentence_too(photos: Path, tmp_path: Path) -> None:
    chance = random.Random(8)
    for kind in ("jpg", "png", "tiff", "heic"):
        data = bytearray((photos / f"plain.{kind}").read_bytes())
        for _ in range(40):
            data[chance.randrange(12, len(data))] = chance.randrange(256)
        path = tmp_path / f"damaged.{kind}"
        path.write_bytes(data)
        try:
            assert read_photo(path).pixels.ndim == 3
        except ImageError as error:
            assert str(error).startswith(path.name)


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("photos")
    for kind in ("jpg", "png", "tiff"):
        Image.fromarray(scene()).save(folder / f"plain.{kind}")
    write_heic(folder / "plain.heic", scene())
    return folder
