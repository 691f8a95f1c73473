"""Only a frame whose own metadata say so is the still that was asked for; and raw data become RGB."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from turnlight.rig.camera import raw10
from turnlight.rig.camera.moment import Moment
from turnlight.rig.camera.still import Request, Settings, Still, objection

ASKED = Request(Settings(10_000, 100, 130, 5_000), not_before_s=7.0, until_s=9.0)
STILL = Still(ASKED.settings, 7.01, 8, 4, 10, bytes(40))


def said(**changes: Any) -> Still:
    return dataclasses.replace(STILL, settings=dataclasses.replace(ASKED.settings, **changes))


@pytest.mark.parametrize(
    "still",
    [
        STILL,
        said(exposure_us=9_960),
        said(exposure_us=10_050),
        said(iso=101),
        said(white_balance_k=5_040),
    ],
)
def test_what_is_taken(still: Still) -> None:
    assert objection(ASKED, still) is None


@pytest.mark.parametrize(
    ("still", "reason"),
    [
        (said(exposure_us=9_900), "are exposed for 9900 us instead of 10000"),
        (said(iso=200), "are taken at ISO 200 instead of 100"),
        (said(lens_position=131), "are focused at 131 instead of 130"),
        (said(white_balance_k=6_000), "have a white balance of 6000 K instead of 5000"),
        (said(white_balance_k=None), "have a white balance of None K instead of 5000"),
        (
            dataclasses.replace(STILL, started_s=6.99),
            "were begun before the light had settled",
        ),
        (dataclasses.replace(STILL, data=bytes(39)), "are torn"),
    ],
)
def test_what_is_refused(still: Still, reason: str) -> None:
    assert objection(ASKED, still) == reason


def test_a_lens_that_cannot_be_moved_is_not_asked() -> None:
    fixed = dataclasses.replace(ASKED.settings, lens_position=None, white_balance_k=None)
    assert objection(dataclasses.replace(ASKED, settings=fixed), said(lens_position=-1)) is None


def test_a_frame_is_never_said_to_begin_later_than_it_did() -> None:
    moment = Moment(host_s=100.0, controller_us=5_000_000)  # asked at 99.998, answered at 100
    assert moment.controller_us_at(100.5) == 5_500_000


def test_ten_bits_a_pixel() -> None:
    bits = np.random.default_rng(0).integers(0, 1024, (6, 12), dtype=np.uint16)
    rows = []
    for row in bits:
        packed = bytearray()
        for a, b, c, d in row.reshape(-1, 4).tolist():
            low = (a & 3) | (b & 3) << 2 | (c & 3) << 4 | (d & 3) << 6
            packed += bytes((a >> 2, b >> 2, c >> 2, d >> 2, low))
        rows.append(bytes(packed) + b"padding")
    assert np.array_equal(raw10.unpack(b"".join(rows), 12, 6, 15 + 7), bits)


@pytest.mark.parametrize("bayer", ["RGGB", "BGGR", "GRBG", "GBRG"])
def test_every_order_of_colours(bayer: str) -> None:
    value = {"R": 1000, "G": 500, "B": 20}
    tile = np.array([value[c] for c in bayer], np.uint16).reshape(2, 2)
    rgb = raw10.demosaic(np.tile(tile, (8, 8)), bayer)
    assert np.array_equal(rgb, np.broadcast_to((1000, 500, 20), (16, 16, 3)))
