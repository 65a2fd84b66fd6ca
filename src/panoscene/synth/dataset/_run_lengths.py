"""Masks as the compressed run lengths that COCO tools read."""

from typing import TypedDict

import numpy as np
from jaxtyping import Bool


class RunLengths(TypedDict):
    """A mask as COCO's ``segmentation``."""

    size: list[int]
    """Height and width."""
    counts: str


def encode_mask(mask: Bool[np.ndarray, "height width"]) -> RunLengths:
    """Return a mask in COCO's compressed run-length form: ``size`` and ``counts``.

    Convention:
        - pixels run down the columns; runs of 0 and 1 alternate, the first is of 0
        - from the fourth run on, the difference to the run before last is written, in groups of
          5 bits, lowest first, with a bit for "more follows", as characters from ``0`` on

    Examples:
        >>> encode_mask(np.array([[False, True], [True, True]]))
        {'size': [2, 2], 'counts': '13'}
    """
    height, width = mask.shape
    flat = mask.T.reshape(-1)
    ends = np.flatnonzero(np.diff(flat)) + 1
    runs = np.diff(np.concatenate([[0], ends, [flat.size]])) if flat.size else np.zeros(0, int)
    counts = runs.tolist()
    if flat.size and flat[0]:
        counts.insert(0, 0)
    text = []
    for k, count in enumerate(counts):
        value = count - counts[k - 2] if k > 2 else count
        while True:
            bits = value & 31
            value >>= 5
            # stops once what is left is only the sign, and the sign bit says so
            done = value == (-1 if bits & 16 else 0)
            text.append(chr(48 + (bits if done else bits | 32)))
            if done:
                break
    return {"size": [height, width], "counts": "".join(text)}


def decode_mask(size: list[int], counts: str) -> Bool[np.ndarray, "height width"]:
    """Return the mask of COCO's compressed run lengths.

    Raises:
        ValueError: The runs do not fill the size.

    Examples:
        >>> decode_mask([2, 2], "13").tolist()
        [[False, True], [True, True]]
    """
    runs: list[int] = []
    value = shift = 0
    for character in counts:
        bits = ord(character) - 48
        value |= (bits & 31) << shift
        shift += 5
        if not bits & 32:
            if bits & 16:
                value -= 1 << shift
            runs.append(value + (runs[-2] if len(runs) > 2 else 0))
            value = shift = 0
    height, width = size
    if sum(runs) != height * width or min(runs, default=0) < 0:
        raise ValueError(f"counts: found {sum(runs)} pixels, expected {height} x {width}")
    flat = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    return flat.reshape(width, height).T
