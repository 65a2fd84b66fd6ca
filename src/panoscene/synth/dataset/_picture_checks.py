"""What is checked of the pictures of one panorama."""

import numpy as np

from ._loaded import Loaded

_SHIFT = 5
"""Columns by which pictures and labels are moved against each other."""


def check_seam(panorama: Loaded) -> list[str]:
    """Look for a step where the last column meets the first.

    The edge of a window or a shelf may lie on the seam: a step there counts when no other column
    of the picture has one like it. Only rows count that stay on one instance.
    """
    problems = []
    instance, distance = panorama.instance, panorama.distance
    same = instance == np.roll(instance, 1, axis=1)
    rows = np.roll(same, 1, axis=1) & same & np.roll(same, -1, axis=1)
    held = same.mean(axis=0)
    if held[0] < held[1:].min() - 0.1:
        problems.append(f"only {held[0]:.0%} of the rows keep their instance across the seam")
    rgb = panorama.rgb.astype(np.float64)
    change = np.abs(rgb - np.roll(rgb, 1, axis=1)).mean(axis=2)
    count = np.maximum(rows.sum(axis=0), 1)
    others = count[1:] >= 0.5 * count[0]
    steps = np.where(rows, change, 0.0).sum(axis=0) / count
    usual = np.median(np.concatenate([steps[1:9], steps[-8:]]))
    if steps[0] > 3.0 * usual + 3.0 and steps[0] > _LIKE_NO_OTHER * steps[1:][others].max(
        initial=0.0
    ):
        found = f"by {steps[0]:.1f} across the seam, by {usual:.1f} beside it"
        problems.append(f"colours jump {found}")
    step = np.abs(distance - np.roll(distance, 1, axis=1))
    beside = np.maximum(np.roll(step, 1, axis=1), np.roll(step, -1, axis=1))
    jumps = (step > 0.01 + 0.01 * distance + 3 * beside) & rows
    shares = jumps.sum(axis=0) / count
    if shares[0] > 0.05 and shares[0] > _LIKE_NO_OTHER * shares[1:][others].max(initial=0.0):
        problems.append(f"distances jump across the seam in {shares[0]:.0%} of the rows")
    return problems


_LIKE_NO_OTHER = 1.3


def check_exposure(panorama: Loaded) -> list[str]:
    """Look for pictures that are black, blown out or empty."""
    rgb = panorama.rgb
    rows = np.sin(np.pi * (np.arange(rgb.shape[0]) + 0.5) / rgb.shape[0])
    weight = np.broadcast_to(rows[:, None], rgb.shape[:2]) / (rows.sum() * rgb.shape[1])
    light = rgb @ np.array([0.2126, 0.7152, 0.0722])
    mean = float((light * weight).sum())
    spread = float(np.sqrt((((light - mean) ** 2) * weight).sum()))
    black = float(((rgb.max(axis=-1) < 6) * weight).sum())
    blown = float(((rgb.min(axis=-1) > 252) * weight).sum())
    problems = []
    if not 25 <= mean <= 230:
        problems.append(f"the mean brightness is {mean:.0f} of 255, expected 25 to 230")
    if black > 0.3:
        problems.append(f"{black:.0%} of the sphere is black")
    if blown > 0.3:
        problems.append(f"{blown:.0%} of the sphere is blown out")
    if spread < 10:
        problems.append(f"brightness varies by {spread:.1f} of 255 only")
    return problems


def check_alignment(panorama: Loaded) -> list[str]:
    """Look whether the colours change where the instances do, and not beside it or mirrored."""
    rgb = panorama.rgb.astype(np.float64)
    change = np.abs(rgb - np.roll(rgb, 1, axis=1)).mean(axis=2)
    # the lower half has the furniture, and no rows where a pixel is as good as its neighbour
    height = panorama.instance.shape[0]
    change = change[height // 4 : height * 7 // 8]
    edge = (panorama.instance != np.roll(panorama.instance, 1, axis=1))[
        height // 4 : height * 7 // 8
    ]
    if not edge.any():
        return []
    here = change[edge].mean()
    mirrored = np.roll(edge[:, ::-1], 1, axis=1)  # edge k is left of column k
    others = {
        f"{_SHIFT} columns to the left": np.roll(edge, -_SHIFT, axis=1),
        f"{_SHIFT} columns to the right": np.roll(edge, _SHIFT, axis=1),
        "in the mirrored picture": mirrored,
    }
    return [
        f"colours change as much at the labels' edges ({here:.1f}) as {place} "
        f"({change[moved].mean():.1f})"
        for place, moved in others.items()
        if here < 1.15 * change[moved].mean()
    ]
