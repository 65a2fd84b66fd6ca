# ruff: noqa: PLC0415
# The imports stand inside: who renders or writes pages for browsers does not wait for matplotlib.
"""A sheet of paper measured in pixels: shapes and text in paint order, saved as a PNG."""

import os
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
import shapely
from jaxtyping import UInt8

from panoscene.scene import write_atomically
from panoscene.style import FONT, INK, LABEL, PAPER

_DPI = 100
_POINTS = 72 / _DPI
"""matplotlib measures widths and type in points."""
LINE_SPACING = 1.2
Points = Sequence[Sequence[float]] | Sequence[np.ndarray] | np.ndarray


class Page:
    """A sheet with x to the right and y up, in pixels from the lower left corner.

    What is drawn later covers what was drawn before. Only objects of this page are touched, no
    state of matplotlib, so pages can be drawn in several threads and without a display.
    """

    def __init__(self, width: int, height: int) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.width, self.height = width, height
        self._figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, facecolor=PAPER)
        self._canvas = FigureCanvasAgg(self._figure)
        self._clip: Any = None
        self._drawn = 0
        self._label_sizes: dict[str, tuple[float, float]] = {}

    def clip(self, bounds: tuple[float, float, float, float] | None) -> None:
        """Keep what follows inside (left, bottom, right, top), or everywhere with None."""
        from matplotlib.transforms import Bbox

        self._clip = None if bounds is None else Bbox.from_extents(*bounds)

    def area(
        self,
        shape: shapely.Geometry,
        *,
        fill: str | None = None,
        edge: str | None = None,
        width: float = 0.0,
        dashes: tuple[float, float] | None = None,
        hatch: str | None = None,
        alpha: float = 1.0,
    ) -> None:
        """Draw polygons with their holes; other parts of the geometry are ignored."""
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path as Outline

        for polygon in shapely.get_parts(shape):
            if polygon.geom_type != "Polygon" or polygon.is_empty:
                continue
            rings = [polygon.exterior, *polygon.interiors]
            path = Outline.make_compound_path(
                *(Outline(ring.coords, closed=True) for ring in rings)
            )
            patch = PathPatch(
                path,
                facecolor=(fill, alpha) if fill else "none",
                edgecolor=edge or "none",
                linewidth=width * _POINTS,
                linestyle="-" if dashes is None else (0, [d / max(width, 1.0) for d in dashes]),
                hatch=hatch,
                joinstyle="miter",
            )
            self._add(patch)

    def line(
        self,
        points: Points,
        *,
        colour: str = INK,
        width: float = 1.0,
        dashes: tuple[float, float] | None = None,
        cap: Literal["butt", "round"] = "butt",
    ) -> None:
        """Draw a line through points."""
        from matplotlib.lines import Line2D

        x, y = np.asarray(points, dtype=float).T
        self._add(
            Line2D(
                x,
                y,
                color=colour,
                linewidth=width * _POINTS,
                linestyle="-" if dashes is None else (0, tuple(d / width for d in dashes)),
                solid_capstyle=cap,
                dash_capstyle=cap,
            )
        )

    def lines(
        self,
        curves: Sequence[np.ndarray],
        *,
        colour: str,
        width: float,
        dashes: tuple[float, float] | None = None,
        alpha: float = 1.0,
    ) -> None:
        """Draw many lines of one kind, each through the rows of an array, with round ends."""
        if not curves:
            return
        from matplotlib.collections import LineCollection

        style = "-" if dashes is None else (0, tuple(d / width for d in dashes))
        self._add(
            LineCollection(
                list(curves),
                colors=[(colour, alpha)],
                linewidths=width * _POINTS,
                linestyles=[style],
                capstyle="butt" if dashes else "round",
                joinstyle="round",
            )
        )

    def plate(
        self,
        centre: tuple[float, float],
        size: tuple[float, float],
        *,
        fill: str,
        edge: str = INK,
        width: float = 1.0,
    ) -> None:
        """Draw a rectangle with rounded corners, to write on."""
        inner = np.array(size) / 2 - 0.25 * size[1]
        core = shapely.box(*(np.array(centre) - inner), *(np.array(centre) + inner))
        self.area(core.buffer(0.25 * size[1]), fill=fill, edge=edge, width=width)

    def image(self, pixels: UInt8[np.ndarray, "height width 3"], x: int, y: int) -> None:
        """Lay a picture on the page, pixel on pixel, with its lower left corner at (x, y)."""
        from matplotlib.image import FigureImage
        from matplotlib.transforms import IdentityTransform

        picture = FigureImage(self._figure, offsetx=x, offsety=y, origin="upper")
        picture.set_data(pixels)
        self._drawn += 1
        picture.set_zorder(self._drawn)
        picture.set_transform(IdentityTransform())
        self._figure.add_artist(picture, clip=False)

    def disc(
        self, centre: Points, radius: float, *, fill: str, edge: str = INK, width: float = 1.5
    ) -> None:
        """Draw a filled circle."""
        self.area(shapely.Point(centre).buffer(radius, 32), fill=fill, edge=edge, width=width)

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        size: float,
        colour: str = INK,
        bold: bool = False,
        align: Literal["left", "center", "right"] = "left",
        rotation: float = 0.0,
        halo: str | None = None,
    ) -> None:
        """Write text whose middle is at height y; ``halo`` is the colour of a soft rim."""
        from matplotlib import patheffects
        from matplotlib.text import Text

        artist = Text(
            x,
            y,
            text,
            color=colour,
            fontproperties=_font(size, bold),
            horizontalalignment=align,
            verticalalignment="center",
            multialignment="center",
            linespacing=LINE_SPACING,
            rotation=rotation,
            rotation_mode="default",
            parse_math=False,
            usetex=False,
        )
        if halo:
            artist.set_path_effects([patheffects.withStroke(linewidth=2.6, foreground=halo)])
        self._add(artist)

    def text_size(self, text: str, size: float, *, bold: bool = False) -> tuple[float, float]:
        """Return width and height of text in pixels."""
        renderer: Any = self._canvas.get_renderer()
        lines = text.split("\n")
        widths = [
            renderer.get_text_width_height_descent(line, _font(size, bold), False)[0]
            for line in lines
        ]
        return max(widths), size * (1.0 + LINE_SPACING * (len(lines) - 1))

    def label_size(self, text: str) -> tuple[float, float]:
        """Return width and height in pixels of a label in a plan, measured once for each text."""
        if text not in self._label_sizes:
            self._label_sizes[text] = self.text_size(text, LABEL)
        return self._label_sizes[text]

    def fitted(self, text: str, size: float, width: float, *, bold: bool = False) -> str:
        """Return the text, cut with an ellipsis where it is wider than ``width``."""
        if self.text_size(text, size, bold=bold)[0] <= width:
            return text
        keep = len(text)
        while keep > 1 and self.text_size(text[:keep] + "…", size, bold=bold)[0] > width:
            keep -= 1
        return text[:keep].rstrip() + "…"

    def pixels(self) -> UInt8[np.ndarray, "height width 3"]:
        """Return what is on the page as a picture."""
        self._canvas.draw()
        return np.array(self._canvas.buffer_rgba())[..., :3]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page as a PNG that appears complete or not at all."""
        buffer = BytesIO()
        # a little larger than at the usual level 6, and twice as fast
        options = {"compress_level": 4}
        self._canvas.print_png(buffer, metadata={"Software": None}, pil_kwargs=options)
        write_atomically(Path(path), buffer.getvalue())

    def _add(self, artist: Any) -> None:
        from matplotlib.transforms import IdentityTransform

        self._drawn += 1
        artist.set_zorder(self._drawn)
        # no axes: coordinates are pixels of the canvas
        artist.set_transform(IdentityTransform())
        self._figure.add_artist(artist, clip=False)
        artist.set_clip_box(self._clip)
        artist.set_clip_on(self._clip is not None)


def _font(size: float, bold: bool) -> Any:
    from matplotlib.font_manager import FontProperties

    return FontProperties(family=FONT, size=size * _POINTS, weight="bold" if bold else "normal")
