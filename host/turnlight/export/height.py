"""The height whose slopes are those of the normals."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float32]


def height_from_normals(normal: Array, pitch: float) -> Array:
    """(H, W) heights in the unit of pitch, the side of a pixel, from (H, W, 3) unit normals.

    The least-squares surface among periodic ones, by FFT (Frankot and Chellappa, 1988): it tiles, its
    mean is 0, and a slant of the whole sample, which cannot tile, is left out.
    """
    rows, columns = normal.shape[:2]
    along_x = -normal[..., 0] / normal[..., 2]
    along_y = -normal[..., 1] / normal[..., 2]
    turns_x = np.fft.rfftfreq(columns).astype(np.float64)[None, :]
    turns_y = -np.fft.fftfreq(rows).astype(np.float64)[:, None]  # rows run down, y runs up
    waves_x, waves_y = (2j * np.pi * _without_nyquist(f) / pitch for f in (turns_x, turns_y))
    power = np.abs(waves_x) ** 2 + np.abs(waves_y) ** 2
    slopes = np.conj(waves_x) * np.fft.rfft2(along_x) + np.conj(waves_y) * np.fft.rfft2(along_y)
    spectrum = np.divide(slopes, power, out=np.zeros_like(slopes), where=power > 0)
    return np.fft.irfft2(spectrum, s=(rows, columns)).astype(np.float32)


def _without_nyquist(frequency: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A real wave of two pixels has no derivative that pixels could show."""
    return np.where(np.abs(frequency) == 0.5, 0.0, frequency)
