"""Whether people can walk through a room: a grid over its floor."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import ndimage

_CELL = 0.1
_BODY = 0.26
"""Metres from the middle of a person to what is next to it."""


class FloorGrid:
    """The floor of a room in cells of 10 cm."""

    def __init__(
        self, polygon: Float[np.ndarray, "corners 2"], blocks: Float[np.ndarray, "blocks 4"]
    ) -> None:
        self._low = polygon.min(axis=0)
        high = polygon.max(axis=0)
        self._shape = np.maximum(1, np.floor((high - self._low) / _CELL).astype(int))
        self._free = np.zeros(tuple(self._shape), dtype=bool)
        room = np.array([[*(self._low + _BODY), *(high - _BODY)]])
        for a, b, c, d in self._cells(room).tolist():
            self._free[a:c, b:d] = True
        self._block(self._free, blocks)

    def connects(
        self,
        things: Float[np.ndarray, "things 4"],
        doorways: Float[np.ndarray, "doorways 4"],
        places: Float[np.ndarray, "places 4"],
    ) -> bool:
        """Return whether one free part of the floor touches all doorways and all places."""
        labels, count = self._labels(things)
        able = set(range(1, count + 1))
        for a, b, c, d in self._cells(np.concatenate([doorways, places])).tolist():
            able &= set(np.unique(labels[a:c, b:d]).tolist())
            if not able:
                return False
        return True

    def free_cells(
        self, things: Float[np.ndarray, "things 4"]
    ) -> tuple[Bool[np.ndarray, "x y"], Float[np.ndarray, " 2"], float]:
        """Return where a person can stand, the corner of the first cell, and the cells' size."""
        return self._labels(things)[0] > 0, self._low, _CELL

    def _labels(self, things: Float[np.ndarray, "things 4"]) -> tuple[Int[np.ndarray, "x y"], int]:
        free = self._free.copy()
        self._block(free, things)
        labels, count = ndimage.label(free)
        return np.asarray(labels), int(count)

    def _block(self, free: Bool[np.ndarray, "x y"], boxes: Float[np.ndarray, "boxes 4"]) -> None:
        grown = boxes + np.array([-_BODY, -_BODY, _BODY, _BODY])
        for a, b, c, d in self._cells(grown).tolist():
            free[a:c, b:d] = False

    def _cells(self, boxes: Float[np.ndarray, "boxes 4"]) -> Int[np.ndarray, "boxes 4"]:
        """Return the first and the last but one cell whose middle lies in each box."""
        corners = (boxes.reshape(-1, 2, 2) - self._low) / _CELL - 0.5
        cells = np.ceil(corners).astype(int).clip(0, self._shape)
        return cells.reshape(-1, 4)
