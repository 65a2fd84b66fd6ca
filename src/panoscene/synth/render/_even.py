"""Takes the blotches from plain walls and ceilings that denoising leaves where light is scarce."""

import numpy as np
from jaxtyping import Bool, Float32, Int64

_CELL = 8
"""Pixels along each side of a cell: blotches are larger."""
_STEPS = (1, 2, 4)
"""Cells between the taps, pass by pass."""
_TAPS = np.array([1, 4, 6, 4, 1], np.float32) / 16
_SAME_LIGHT, _SAME_COLOUR = 0.08, 0.5
"""Logarithms: what differs more is shading, not a blotch."""
_ROUGHNESS = 0.01
"""Variance of the logarithm of light within a cell that is left alone."""
_ALIGNED = 0.98


def even_light(
    radiance: Float32[np.ndarray, "height width 3"],
    albedo: Float32[np.ndarray, "height width 3"],
    normal: Float32[np.ndarray, "height width 3"],
) -> Float32[np.ndarray, "height width 3"]:
    """Return a panorama whose plain surfaces are lit evenly, without blotches of light and colour.

    The light on surfaces (radiance over albedo) is averaged over cells of 8 x 8 pixels, and these
    are smoothed with an edge-avoiding a-trous wavelet (Dammertz et al. 2010, without its first
    levels) within surfaces of one direction; what that changes is interpolated. Detail within
    cells, shadows, edges and dark or glossy things stay. Pictures that do not consist of whole
    cells are returned as they are.

    Args:
        radiance: Denoised.
        albedo: Linear.
        normal: Unit vectors; 0 where there is nothing.
    """
    if any(side % _CELL for side in albedo.shape[:2]):
        return radiance
    light = np.log(np.maximum(radiance, 1e-7) / np.maximum(albedo, 0.04))
    plain = (albedo.min(axis=-1) > 0.15) & (np.abs(normal).max(axis=-1) > 0.5)
    cells, facing = _pooled(light), _pooled(normal)
    spread = _pooled(light[..., 1:2] ** 2)[..., 0] - cells[..., 1] ** 2
    use = (np.linalg.norm(facing, axis=-1) > 0.995) & (spread < _ROUGHNESS)
    use &= _pooled(plain[..., None].astype(np.float32))[..., 0] > 0.99
    smooth = cells
    for step in _STEPS:
        smooth = _pass(smooth, facing, use, step)
    change = _enlarged(np.where(use[..., None], smooth - cells, np.float32(0)))
    around = facing.repeat(_CELL, axis=0).repeat(_CELL, axis=1)
    aligned = plain & (np.einsum("hwc,hwc->hw", normal, around) > _ALIGNED)
    return radiance * np.where(aligned[..., None], np.exp(change), np.float32(1))


def _pass(
    light: Float32[np.ndarray, "rows columns 3"],
    facing: Float32[np.ndarray, "rows columns 3"],
    use: Bool[np.ndarray, "rows columns"],
    step: int,
) -> Float32[np.ndarray, "rows columns 3"]:
    """Return cells averaged with those around them that have the same direction and like light."""
    rows = np.arange(len(light))
    total, weight = np.zeros_like(light), np.zeros((*light.shape[:2], 1), np.float32)
    for i, down in enumerate(_TAPS):
        there = rows + (i - 2) * step
        inside = (there >= 0) & (there < len(rows))
        there = there.clip(0, len(rows) - 1)
        for j, right in enumerate(_TAPS):
            shift = -(j - 2) * step
            other = np.roll(light[there], shift, axis=1)
            same = (np.roll(facing[there], shift, axis=1) * facing).sum(axis=-1) > _ALIGNED
            same &= np.roll(use[there], shift, axis=1) & inside[:, None]
            brighter = (other - light).mean(axis=-1)
            hue = other - light - brighter[..., None]
            odd = (brighter / _SAME_LIGHT) ** 2 + (hue**2).sum(axis=-1) / _SAME_COLOUR**2
            share = (down * right * same * np.exp(-odd)).astype(np.float32)[..., None]
            total, weight = total + share * other, weight + share
    return np.where(weight > 1e-6, total / np.maximum(weight, 1e-6), light)


def _pooled(
    image: Float32[np.ndarray, "height width channels"],
) -> Float32[np.ndarray, "rows columns channels"]:
    """Return the mean of each cell."""
    height, width, channels = image.shape
    cells = image.reshape(height // _CELL, _CELL, width // _CELL, _CELL, channels)
    return cells.mean(axis=(1, 3))


def _enlarged(
    cells: Float32[np.ndarray, "rows columns 3"],
) -> Float32[np.ndarray, "height width 3"]:
    """Return values of cells between their middles; left and right wrap around."""
    first, second, share = _between(cells.shape[0])
    last = cells.shape[0] - 1
    tall = cells[first.clip(0, last)] * (1 - share[:, None, None])
    tall += cells[second.clip(0, last)] * share[:, None, None]
    first, second, share = _between(cells.shape[1])
    wide = tall[:, first % cells.shape[1]] * (1 - share[:, None])
    return wide + tall[:, second % cells.shape[1]] * share[:, None]


def _between(
    count: int,
) -> tuple[Int64[np.ndarray, " n"], Int64[np.ndarray, " n"], Float32[np.ndarray, " n"]]:
    """Return the cells before and behind every pixel, and the share of the one behind."""
    place = (np.arange(count * _CELL) + 0.5) / _CELL - 0.5
    first = np.floor(place).astype(np.int64)
    return first, first + 1, (place - first).astype(np.float32)
