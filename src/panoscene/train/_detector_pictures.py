"""Pictures of detections: masks, outlines and names on the panorama."""

import numpy as np
import torch
import torch.nn.functional as F
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from panoscene.data._detector_samples import circular_boxes
from panoscene.scene import CATEGORIES, Detections
from panoscene.style import GROUP_COLOURS, INK, PAPER, group_of, words

_WIDTH = 1024
_FILL = 0.35


def detector_picture(
    image: Float[Tensor, "3 height width"],
    found: Detections,
    truth: Detections | None = None,
) -> UInt8[np.ndarray, "rows columns 3"]:
    """Return the panorama with what was found, above the same with what is there.

    Args:
        image: Upright panorama, RGB in [0, 1].
        found: Detections with masks in the size of the image.
        truth: What is there; its picture is left out without it.
    """
    panels = [_panel(image, found)]
    if truth is not None:
        panels.append(_panel(image, truth))
    return np.concatenate(panels)


def _panel(
    image: Float[Tensor, "3 height width"], shown: Detections
) -> UInt8[np.ndarray, "rows columns 3"]:
    from PIL import Image, ImageDraw, ImageFont  # noqa: PLC0415

    if shown.mask is None:
        raise ValueError("found: expected detections with masks")
    canvas = image.clone()
    order = shown.score.argsort().tolist()
    colours = [_rgb(GROUP_COLOURS[group_of(CATEGORIES[c])]) for c in shown.category.tolist()]
    for k in order:  # better ones on top
        mask = shown.mask[k]
        colour = torch.tensor(colours[k])[:, None]
        canvas[:, mask] = torch.lerp(canvas[:, mask], colour, _FILL)
        canvas[:, _outline(mask)] = colour
    pixels = canvas.clamp(0, 1).mul(255).round().byte().permute(1, 2, 0).contiguous().numpy()
    scale = _WIDTH / image.shape[-1]
    picture = Image.fromarray(pixels).resize((_WIDTH, _WIDTH // 2))
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(11)
    boxes = circular_boxes(shown.mask) * scale if len(shown.mask) else torch.zeros(0, 4)
    for k in order:
        left, top, right, _ = boxes[k].tolist()
        score = float(shown.score[k])
        name = words(CATEGORIES[int(shown.category[k])])
        text = name if score >= 1 else f"{name} {100 * score:.0f}"
        centre = ((left + right) / 2) % _WIDTH
        place = draw.textbbox((centre, max(top - 1, 14)), text, font=font, anchor="mb")
        shift = max(0, 2 - place[0]) - max(0, place[2] - _WIDTH + 2)
        place = (place[0] + shift - 2, place[1] - 1, place[2] + shift + 2, place[3] + 1)
        draw.rectangle(place, fill=PAPER)
        draw.text((place[0] + 2, place[1] + 1), text, font=font, fill=INK, anchor="lt")
    return np.asarray(picture)


def _outline(mask: Bool[Tensor, "height width"]) -> Bool[Tensor, "height width"]:
    padded = F.pad(mask[None, None].float(), (1, 1, 0, 0), mode="circular")
    inner = -F.max_pool2d(-F.pad(padded, (0, 0, 1, 1)), 3, stride=1)
    return mask & (inner[0, 0] == 0)


def _rgb(colour: str) -> tuple[float, float, float]:
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue
