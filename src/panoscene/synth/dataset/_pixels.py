"""Which way pixels look, how large they are, and where each instance is in the picture."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64


@functools.lru_cache(maxsize=4)
def pixel_directions(height: int, width: int) -> Float64[np.ndarray, "height width 3"]:
    """Return the unit direction of every pixel's centre in the camera's frame; read-only.

    Examples:
        >>> pixel_directions(2, 4)[0, 2].round(3).tolist()
        [0.5, 0.5, 0.707]
    """
    result = directions_at(
        np.arange(width)[None, :] + 0.5, np.arange(height)[:, None] + 0.5, height, width
    )
    result.flags.writeable = False
    return result


def directions_at(
    u: np.ndarray, v: np.ndarray, height: int, width: int
) -> Float64[np.ndarray, "*batch 3"]:
    """Return unit directions of continuous pixel coordinates, which may be broadcast."""
    lon, lat = 2 * np.pi * (u / width - 0.5), np.pi * (0.5 - v / height)
    lon, lat = np.broadcast_arrays(lon, lat)
    across = np.cos(lat)
    return np.stack([across * np.sin(lon), across * np.cos(lon), np.sin(lat)], axis=-1)


@functools.lru_cache(maxsize=4)
def pixel_solid_angle(height: int, width: int) -> Float64[np.ndarray, " height"]:
    """Return the solid angle in steradians of a pixel of each row; all pixels make 4 pi."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return (edges[:-1] - edges[1:]) * (2 * np.pi / width)


class Regions(NamedTuple):
    """Where each instance of a map is seen; k is the place in ``instance``."""

    instance: Int64[np.ndarray, " n"]
    """Ids in the map, rising, without 0."""
    place: Int32[np.ndarray, "height width"]
    """k of every pixel; -1 for nothing."""
    pixels: Int64[np.ndarray, " n"]
    solid_angle: Float64[np.ndarray, " n"]
    first_row: Int32[np.ndarray, "n width"]
    """Of each column; ``height`` where the instance is not in it."""
    last_row: Int32[np.ndarray, "n width"]
    """-1 where the instance is not in it."""
    crosses_seam: Bool[np.ndarray, " n"]


def find_regions(instance: Int32[np.ndarray, "height width"]) -> Regions:
    """Return where each instance is seen.

    Raises:
        ValueError: an id is negative or above 65535.
    """
    low, high = int(instance.min()), int(instance.max())
    if low < 0 or high > 65535:
        raise ValueError(f"instance: found ids from {low} to {high}, expected 0 to 65535")
    height, width = instance.shape
    counts = np.bincount(instance.reshape(-1), minlength=1)
    counts[0] = 0
    ids = np.flatnonzero(counts)
    place = np.full(len(counts), -1, np.int32)
    place[ids] = np.arange(len(ids))
    index = place[instance]
    weight = np.repeat(pixel_solid_angle(height, width), width)
    solid_angle = np.bincount(instance.reshape(-1), weight, len(counts))[ids]
    # one pass over the pixels from each side: the last value written stays
    first = np.full((len(ids) + 1, width), height, np.int32)
    last = np.full((len(ids) + 1, width), -1, np.int32)
    columns = np.arange(width)
    for row in range(height):
        last[index[row], columns] = row
        first[index[height - 1 - row], columns] = height - 1 - row
    seam = np.zeros(len(ids) + 1, bool)
    seam[index[:, 0][index[:, 0] == index[:, -1]]] = True
    return Regions(ids, index, counts[ids], solid_angle, first[:-1], last[:-1], seam[:-1])


def pixel_box(
    first_row: Int32[np.ndarray, " width"], last_row: Int32[np.ndarray, " width"]
) -> tuple[int, int, int, int]:
    """Return left, top, columns and rows of an instance; it may run on past the last column.

    Examples:
        >>> pixel_box(np.array([1, 4, 4, 0], np.int32), np.array([2, -1, -1, 1], np.int32))
        (3, 0, 2, 3)
    """
    width = len(first_row)
    held = np.flatnonzero(last_row >= 0)
    gaps = np.diff(np.append(held, held[0] + width))
    widest = int(gaps.argmax())
    left = int(held[(widest + 1) % len(held)])
    top = int(first_row.min())
    return left, top, int(width - gaps[widest] + 1), int(last_row.max()) - top + 1


def outline_directions(
    first_row: Int32[np.ndarray, " width"], last_row: Int32[np.ndarray, " width"], height: int
) -> Float64[np.ndarray, "points 3"]:
    """Return the outer corners of an instance's top and bottom pixel in each of its columns."""
    width = len(first_row)
    held = np.flatnonzero(last_row >= 0)
    u = np.stack([held, held + 1, held, held + 1])
    v = np.stack([first_row[held]] * 2 + [last_row[held] + 1] * 2)
    return directions_at(u, v, height, width).reshape(-1, 3)
