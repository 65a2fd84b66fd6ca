"""A light canvas for moving pictures: smooth lines, polygons, hatching and text with Pillow."""

from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from jaxtyping import Float
from PIL import Image, ImageChops, ImageDraw, ImageFont

from panoscene.style import ALARM, CONTACT, CONTACT_RIM, INK

_FINE = 3
"""Sub-pixels in a row of each pixel."""
_HATCH = 7
"""Pixels between the lines of hatching."""
_DASH, _PAUSE = 4.0, 2.5
"""Pixels of the parts of dashed lines."""
Point = Float[np.ndarray, " 2"]


class Canvas:
    """A see-through layer that is drawn large and shrunk, so that its edges are smooth."""

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        self._layer = Image.new("RGBA", (width * _FINE, height * _FINE), (0, 0, 0, 0))
        self._draw = ImageDraw.Draw(self._layer)

    def polygon(
        self,
        shape: shapely.Polygon,
        *,
        fill: str | None = None,
        opacity: float = 1.0,
        edge: str | None = None,
        width: float = 1.0,
    ) -> None:
        """Draw a polygon in pixels."""
        ring = np.array(shape.exterior.coords)
        if fill is not None:
            low = np.clip(np.floor(ring.min(0) * _FINE), 0, self._layer.size).astype(int)
            high = np.clip(np.ceil(ring.max(0) * _FINE) + 1, 0, self._layer.size).astype(int)
            if (high > low).all():
                over = Image.new("RGBA", tuple((high - low).tolist()), (0, 0, 0, 0))
                place = _flat(ring - low / _FINE)
                ImageDraw.Draw(over).polygon(place, fill=_rgba(fill, opacity))
                self._layer.alpha_composite(over, dest=tuple(low.tolist()))
        if edge is not None:
            self.line(ring, edge, width)

    def line(self, points: Float[np.ndarray, "points 2"], colour: str, width: float) -> None:
        """Draw a line through points in pixels, with round corners."""
        self._draw.line(
            _flat(points), fill=colour, width=max(1, round(width * _FINE)), joint="curve"
        )

    def dashes(self, points: Float[np.ndarray, "points 2"], colour: str, width: float) -> None:
        """Draw a dashed line through points in pixels, each part from its own start."""
        for start, end in pairwise(points):
            length = float(np.linalg.norm(end - start))
            along = (end - start) / max(length, 1e-9)
            for begin in np.arange(0.0, length, _DASH + _PAUSE):
                stop = min(begin + _DASH, length)
                self.line(np.stack([start + begin * along, start + stop * along]), colour, width)

    def contact(self, start: Point, end: Point, width: float) -> None:
        """Draw a short thick white line with a dark rim; a dot where start and end agree."""
        for colour, thick in ((INK, width + 2 * CONTACT_RIM), (CONTACT, width)):
            radius = thick / 2
            self.line(np.stack([start, end]), colour, thick)
            for place in (start, end):
                corners = np.stack([place - radius, place + radius])
                self._draw.ellipse(_flat(corners), fill=colour)

    def hatch(self, shapes: list[shapely.Polygon]) -> None:
        """Hatch polygons in the colour of collisions, with an outline."""
        mask = Image.new("L", self._layer.size, 0)
        draw = ImageDraw.Draw(mask)
        for shape in shapes:
            draw.polygon(_flat(np.array(shape.exterior.coords)), fill=255)
        if mask.getbbox() is None:
            return
        stripes = _stripes(self._layer.size)
        thin = Image.new("RGBA", self._layer.size, _rgba(ALARM, 1.0))
        self._layer.paste(thin, mask=ImageChops.multiply(mask, stripes))
        for shape in shapes:
            self.line(np.array(shape.exterior.coords), ALARM, 1.4)

    def onto(self, picture: Image.Image, left: int, top: int) -> None:
        """Lay what was drawn over a picture."""
        layer = self._layer.convert("RGBa").reduce(_FINE).convert("RGBA")
        shown = Image.new("RGBA", picture.size, (0, 0, 0, 0))
        shown.paste(layer, (left, top))
        picture.paste(Image.alpha_composite(picture.convert("RGBA"), shown).convert(picture.mode))


@lru_cache
def font(size: float, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return the typeface of all pictures, which comes with matplotlib."""
    import matplotlib as mpl  # noqa: PLC0415 - renderings need none of it

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / name), size)


@lru_cache(maxsize=4)
def _stripes(size: tuple[int, int]) -> Image.Image:
    v, u = np.mgrid[: size[1], : size[0]]
    period = _HATCH * _FINE
    value = np.where((u + v) % period < 0.34 * period, 255, 90)
    return Image.fromarray(value.astype(np.uint8))


def _flat(points: Float[np.ndarray, "points 2"]) -> list[tuple[float, float]]:
    return [(x, y) for x, y in (points * _FINE).tolist()]


def _rgba(colour: str, opacity: float) -> tuple[int, int, int, int]:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue, round(255 * opacity)
