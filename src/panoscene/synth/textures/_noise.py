"""Noise that repeats without a seam, and the grids that patterns are laid on."""

import numpy as np
import scipy.fft
from jaxtyping import Float, Float32, Int
from PIL import Image

Field = Float[np.ndarray, "height width"]
Picture = Float[np.ndarray, "height width 3"]
Number = float | int
Colour = tuple[float, float, float]


def noise(
    rng: np.random.Generator,
    size: int,
    low: Number,
    high: Number,
    slope: Number = 1.5,
    *,
    stretch: tuple[Number, Number] = (1.0, 1.0),
) -> Float32[np.ndarray, "size size"]:
    """Return seamless noise of mean 0 and deviation 1 with ``low`` to ``high`` cycles per tile.

    The amplitude falls with the frequency to the power ``slope``. A stretch of 20 along u makes
    features 20 times as long along u as along v.
    """
    most = size // 2 - 1
    right = int(np.clip(high / stretch[0], 1, most))
    up = int(np.clip(high / stretch[1], 1, most))
    k_u = np.arange(right + 1)
    k_v = np.concatenate([np.arange(up + 1), np.arange(-up, 0)])
    frequency = np.hypot(k_u[None, :] * stretch[0], k_v[:, None] * stretch[1])
    inside = (frequency >= low) & (frequency <= high)
    amplitude = np.where(inside, np.maximum(frequency, 1e-6) ** -slope, 0.0)
    phase = rng.random(amplitude.shape) * 2.0 * np.pi
    band = (amplitude * rng.random(amplitude.shape) * np.exp(1j * phase)).astype(np.complex64)
    spectrum = np.zeros((size, size // 2 + 1), np.complex64)
    spectrum[: up + 1, : right + 1] = band[: up + 1]
    spectrum[-up:, : right + 1] = band[up + 1 :]
    field = np.asarray(scipy.fft.irfft2(spectrum, s=(size, size)), dtype=np.float32)
    field -= field.mean()
    return field / max(float(field.std()), 1e-9)


def axes(size: int) -> tuple[Float32[np.ndarray, "1 size"], Float32[np.ndarray, "size 1"]]:
    """Return u (to the right) and v (up) of the pixel centres, both in [0, 1)."""
    steps = ((np.arange(size) + 0.5) / size).astype(np.float32)
    return steps[None, :], steps[::-1, None]


def mix(first: Colour | Picture, second: Colour | Picture, share: Field) -> Picture:
    """Return ``first`` where the share is 0 and ``second`` where it is 1."""
    a, b = np.asarray(first, np.float32), np.asarray(second, np.float32)
    share = np.asarray(share, np.float32)
    result = np.zeros((*share.shape, 3), np.float32)
    for channel in range(3):
        low = a[..., channel]
        result[..., channel] = low + (b[..., channel] - low) * share
    return result


def step(value: Field, low: Number, high: Number) -> Field:
    """Return 0 below ``low``, 1 above ``high`` and a smooth ramp between."""
    share = np.asarray(value, np.float32) * np.float32(1.0 / (high - low))
    share -= np.float32(low / (high - low))
    np.clip(share, 0.0, 1.0, out=share)
    return share * share * (3.0 - 2.0 * share)


def pick(table: Float[np.ndarray, "entries *rest"], index: Int[np.ndarray, "height width"]):
    """Return the table's entry for every pixel."""
    return np.take(table.astype(np.float32), index, axis=0)


def shifted(
    field: Field,
    rows: Int[np.ndarray, "height width"],
    columns: Int[np.ndarray, "height width"],
    across: np.ndarray | None = None,
) -> Field:
    """Return the field read with an own shift at every pixel; transposed where ``across``."""
    size = field.shape[0]
    i, j = np.arange(size, dtype=np.int32)[:, None], np.arange(size, dtype=np.int32)[None, :]
    rows, columns = rows.astype(np.int32), columns.astype(np.int32)
    if across is not None:
        i, j = np.where(across, j, i), np.where(across, i, j)
    return np.take(field.ravel(), ((i + rows) % size) * size + (j + columns) % size)


def enlarge(picture: np.ndarray, size: int) -> np.ndarray:
    """Return a uint8 picture or mask resized to ``size`` x ``size``."""
    return np.asarray(Image.fromarray(picture).resize((size, size), Image.Resampling.LANCZOS))
