"""Raw sensor data, ten bits a pixel as MIPI CSI-2 packs them, to linear RGB."""

import cv2
import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[np.uint16]
_TO_RGB = {
    "RGGB": cv2.COLOR_BayerRGGB2RGB,
    "BGGR": cv2.COLOR_BayerBGGR2RGB,
    "GRBG": cv2.COLOR_BayerGRBG2RGB,
    "GBRG": cv2.COLOR_BayerGBRG2RGB,
}


def unpack(data: bytes | npt.NDArray[np.uint8], width: int, height: int, stride: int) -> Pixels:
    """(height, width) of 0 to 1023. Four pixels share five bytes, the fifth with their low bits.

    stride: bytes a row, padding included. width: a multiple of four.
    """
    rows = np.frombuffer(data, np.uint8, height * stride).reshape(height, stride)
    groups = rows[:, : width // 4 * 5].reshape(height, width // 4, 5)
    pixels = groups[..., :4].astype(np.uint16)
    pixels <<= 2
    for position in range(4):
        pixels[..., position] |= (groups[..., 4] >> 2 * position) & 3
    return pixels.reshape(height, width)


def demosaic(mosaic: Pixels, bayer: str) -> Pixels:
    """(h, w, 3) RGB, bilinear. bayer: the colours of the upper left four pixels, such as "RGGB"."""
    return np.asarray(cv2.demosaicing(mosaic, _TO_RGB[bayer]), np.uint16)
