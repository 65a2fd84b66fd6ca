"""Pictures of predicted rooms: boundaries on the panorama, floor plans beside it."""

import math
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from panoscene.geometry import boundary_from_layout
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import Layout, Scene
from panoscene.style import ALARM, FLOOR, INK, PAPER, WALL

_TRUE, _RAW, _FOUND = "#1b9e77", "#f2b705", ALARM
_LINES = 512
_CORNER_ROWS = 14


def layout_picture(
    photo: UInt8[np.ndarray, "3 rows columns"],
    prediction: LayoutPrediction,
    truth: Scene | None = None,
) -> UInt8[np.ndarray, "height width 3"]:
    """Return a panorama with boundaries and the floor plan beside it.

    Green is the truth, yellow what the network drew, red the regularised room. The strip on top
    is the evidence of corners.

    Args:
        photo: The upright panorama.
        prediction: Of the layout stage.
        truth: The true room, if it is known.
    """
    from PIL import Image, ImageDraw  # noqa: PLC0415

    picture = Image.fromarray(photo.transpose(1, 2, 0)).resize((1024, _LINES))
    draw = ImageDraw.Draw(picture)
    if truth is not None:
        height = truth.panorama.camera_height
        for lat in layout_boundary(truth.layout, height):
            _line(draw, lat, _TRUE, 3)
    for lat in prediction.boundary:
        _line(draw, lat, _RAW, 2)
    scale = 1.6 if truth is None else truth.panorama.camera_height
    for lat in layout_boundary(prediction.layout, scale):
        _line(draw, lat, _FOUND, 1)
    canvas = Image.new("RGB", (1024 + _LINES, _LINES), PAPER)
    canvas.paste(picture, (0, 0))
    strip = (prediction.corner.clamp(0, 1) * 255).to(torch.uint8).expand(_CORNER_ROWS, -1)
    canvas.paste(Image.fromarray(strip.numpy().copy()).convert("RGB"), (0, 0))
    _plan(ImageDraw.Draw(canvas), prediction, truth)
    return np.asarray(canvas)


def layout_boundary(layout: Layout, camera_height: float) -> Float[Tensor, "2 1024"]:
    """Return the latitudes of a room's boundaries in radians, positive up."""
    boundary = boundary_from_layout(
        layout.floor_polygon.double(), layout.floor_height, layout.ceiling_height, camera_height
    )
    return torch.stack(boundary)


def _line(draw: Any, lat: Tensor, colour: str, width: int) -> None:
    rows = (0.5 - lat / math.pi) * _LINES
    points = [(column + 0.5, row) for column, row in enumerate(rows.tolist())]
    draw.line(points, fill=colour, width=width)


def _plan(draw: Any, prediction: LayoutPrediction, truth: Scene | None) -> None:
    """Draw the floor plans, from above, into the square at the right."""
    layout = prediction.layout
    shown = [(layout.floor_polygon, _FOUND, 2)]
    if layout.raw_polygon is not None:
        shown.insert(0, (layout.raw_polygon, _RAW, 3))
    if truth is not None:
        shown.insert(0, (truth.layout.floor_polygon, _TRUE, 5))
    every = torch.cat([polygon for polygon, _, _ in shown] + [torch.zeros(1, 2)])
    low, high = every.amin(0), every.amax(0)
    scale = 0.9 * _LINES / float((high - low).amax().clamp(min=0.1))
    middle = (low + high) / 2

    def placed(polygon: Tensor) -> list[tuple[float, float]]:
        offset = (polygon - middle) * scale
        return [(1024 + _LINES / 2 + x, _LINES / 2 - y) for x, y in offset.tolist()]

    draw.polygon(placed(shown[0][0]), fill=FLOOR, outline=WALL)
    for polygon, colour, width in shown:
        closed = torch.cat((polygon, polygon[:1]))
        draw.line(placed(closed), fill=colour, width=width)
    x, y = placed(torch.zeros(1, 2))[0]
    draw.ellipse((x - 4, y - 4, x + 4, y + 4), fill=INK)
    words = f"{len(layout.floor_polygon)} corners, ceiling {layout.ceiling_height:.2f} m"
    if prediction.ambiguous:
        words += ", ambiguous"
    draw.text((1032, 8), words, fill=INK)
