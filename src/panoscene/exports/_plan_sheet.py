"""The sheet of paper that a floor plan is drawn on: where everything goes, in millimetres."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from panoscene.exports._floor_plan import FloorPlan
from panoscene.exports._plan_dimensions import Dimension
from panoscene.exports._plan_labels import CHARACTER, LABEL_MM

MARGIN_MM, KEY_MM, BLOCK_MM = 8.0, 5.0, 26.0
LEAST_WIDTH_MM = 118.0
"""The title block needs as much."""
TEXT_MM, SMALL_MM = 2.6, 2.0
"""Type of dimensions, and of those on short lines."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A sheet; its origin is the upper left corner, y points down."""

    width: float
    height: float
    scale: int
    origin: tuple[float, float]
    """Plan place, in metres, of the sheet's upper left corner."""
    key_place: tuple[float, float]
    """Where the key begins."""
    block_place: tuple[float, float]
    """Where the title block begins."""
    summary: str
    """Area, height, scale and units in words."""

    def place(self, points: Float[np.ndarray, "points 2"]) -> Float[np.ndarray, "points 2"]:
        """Return places of the plan on the sheet."""
        return (points - np.array(self.origin)) * np.array([1000.0, -1000.0]) / self.scale

    @property
    def bar(self) -> tuple[tuple[float, float], float]:
        """Where the scale bar begins, and how many metres long it is."""
        x, y = self.block_place
        metres = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
        fitting = [length for length in metres if length * 1000 / self.scale <= 42]
        return (x, y + 14.0), fitting[-1] if fitting else 0.01

    @property
    def bar_mm(self) -> float:
        """The length of the scale bar on paper."""
        return self.bar[1] * 1000 / self.scale

    @property
    def arrow_text(self) -> tuple[float, float]:
        """Where the words beside the arrow begin."""
        x, y = self.bar[0]
        return x + 72, y

    def arrow(self, plan: FloorPlan) -> Float[np.ndarray, "2 2"]:
        """Return tail and tip of the arrow to the photo's centre."""
        x, y = self.arrow_text
        ahead = np.array([plan.ahead[0], -plan.ahead[1]])
        middle = np.array([x - 7.0, y])
        return np.stack([middle - 4.5 * ahead, middle + 4.5 * ahead])

    def dimension_text(self, dimension: Dimension) -> tuple[float, tuple[float, float], float]:
        """Return degrees (clockwise), middle and size of the text of a dimension.

        It reads from below or from the right, above its line; on a line that is too short for
        it, outside of the row.
        """
        start, end = self.place(dimension.line)
        middle = (start + end) / 2
        along = end - start
        length = float(np.linalg.norm(along))
        along = along / max(length, 1e-9)
        if along[0] < -1e-6 or (abs(along[0]) <= 1e-6 and along[1] > 0):
            along = -along
        above = np.array([along[1], -along[0]])
        wide = len(dimension.text) * CHARACTER * TEXT_MM
        size = TEXT_MM if wide + 1.0 <= length else SMALL_MM
        place = middle + 1.9 * above
        if len(dimension.text) * CHARACTER * size > length:
            place = middle - 2.1 * above
        rotation = float(np.degrees(np.arctan2(along[1], along[0])))
        return rotation, (float(place[0]), float(place[1])), size


def make_sheet(plan: FloorPlan) -> Sheet:
    """Return the sheet of a plan: the drawing, the key to its right, the title block below."""
    left, bottom, right, top = plan.bounds
    margin = plan.metres(MARGIN_MM)
    drawing = (right - left) / plan.metres(1.0)
    high = (top - bottom) / plan.metres(1.0)
    key = max((len(name) * CHARACTER * LABEL_MM + 12 for name in plan.key), default=0.0)
    width = max(drawing + key, LEAST_WIDTH_MM)
    middle = (width - drawing - key) / 2
    height = max(high, len(plan.key) * KEY_MM)
    parts = [f"{plan.area:.1f} m²", f"ceiling {plan.height:.2f} m", f"1:{plan.scale}"]
    return Sheet(
        width=width + 2 * MARGIN_MM,
        height=height + BLOCK_MM + 2 * MARGIN_MM,
        scale=plan.scale,
        origin=(left - margin - plan.metres(middle), top + margin),
        key_place=(MARGIN_MM + middle + drawing + 6, MARGIN_MM + 8),
        block_place=(MARGIN_MM, MARGIN_MM + height + 10),
        summary=", ".join([*parts, "dimensions in metres, inner faces of walls"]),
    )
