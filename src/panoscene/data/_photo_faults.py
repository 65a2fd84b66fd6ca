"""Faults that only panoramas have: lenses that do not match, and the tripod."""

import math

import torch
import torch.nn.functional as F
from torch import Tensor

from ._draw import Draw


def add_seams(photo: Tensor, draw: Draw) -> Tensor:
    """Return a panorama as stitched from two to four lenses of different light and height."""
    height, width = photo.shape[-2:]
    lenses = draw.whole(2, 5)
    edge = draw.uniform(0.0, 1.0 / lenses)
    u = (torch.arange(width) + 0.5) / width
    softness = draw.uniform(0.001, 0.02)
    gain = torch.ones(3, width)
    shifted = torch.zeros(width)
    for k in range(1, lenses):
        # how much a column belongs to this lens: 1 inside its sector, 0 outside
        middle = edge + (k + 0.5) / lenses
        off = (u - middle + 0.5).remainder(1.0) - 0.5
        inside = torch.sigmoid((0.5 / lenses - off.abs()) / softness)
        own = 1.0 + draw.uniform(-0.12, 0.12) + draw.uniforms(3, -0.03, 0.03)
        gain = gain * torch.lerp(torch.ones(3, 1), own[:, None], inside)
        if k == 1:
            near = (1.0 - (off - 0.5 / lenses).abs() / 0.03).clamp(min=0.0)
            shifted = near * (off < 0.5 / lenses)
    photo = photo * gain[:, None, :].to(photo)
    reach = max(1, round(height / 256 * 1.5))
    rows = draw.whole(-reach, reach + 1)
    moved = photo.roll(rows, dims=-2)
    return torch.lerp(photo, moved, shifted.to(photo)).clamp_(0.0, 1.0)


def add_tripod(photo: Tensor, draw: Draw) -> Tensor:
    """Return a panorama with a tripod, a logo or a smear at its lowest point."""
    height, width = photo.shape[-2:]
    lon = (torch.arange(width) + 0.5) / width * 2.0 * math.pi
    radius = draw.uniform(math.radians(5.0), math.radians(22.0))
    outline = torch.ones(width)
    for wave in range(1, 5):
        outline = outline + draw.uniform(0.0, 0.12) * torch.cos(
            wave * lon + draw.uniform(0.0, 2.0 * math.pi)
        )
    if draw.chance(0.5):
        outline = outline + _legs(lon, draw)
    # angle above the lowest point, of each row
    angle = (height - torch.arange(height) - 0.5) / height * math.pi
    edge = (radius * outline).clamp(max=math.radians(40.0))
    softness = draw.uniform(0.3, 3.0) * math.pi / height
    cover = torch.sigmoid((edge[None, :] - angle[:, None]) / softness)
    lowest = max(1, math.ceil(height * 0.3))
    colour = _filling(photo, draw, angle[-lowest:], radius)
    result = photo.clone()
    result[:, -lowest:] = torch.lerp(photo[:, -lowest:], colour, cover[-lowest:].to(photo))
    return result


def _legs(lon: Tensor, draw: Draw) -> Tensor:
    """Return how much further three legs reach, per column."""
    first = draw.uniform(0.0, 2.0 * math.pi / 3)
    width = draw.uniform(0.05, 0.15)
    off = (lon - first).remainder(2.0 * math.pi / 3)
    off = torch.minimum(off, 2.0 * math.pi / 3 - off)
    return draw.uniform(0.2, 1.0) * torch.exp(-0.5 * (off / width) ** 2)


def _filling(photo: Tensor, draw: Draw, angle: Tensor, radius: float) -> Tensor:
    """Return what the lowest rows are covered with: (3, rows, width) or one that expands to it."""
    height, width = photo.shape[-2:]
    rows = len(angle)
    kind = draw.whole(0, 4)
    if kind == 0:  # black metal
        shade = draw.uniform(0.0, 0.2) * (1.0 + 0.5 * torch.sin(angle * 60.0))
        return shade[None, :, None].to(photo).clamp(0.0, 1.0).expand(3, rows, width)
    if kind == 1:  # a plain disc, often with a ring
        inner = draw.uniforms(3, 0.0, 1.0)[:, None]
        outer = draw.uniforms(3, 0.0, 1.0)[:, None]
        colour = torch.where(angle < radius * draw.uniform(0.3, 1.5), inner, outer)
        return colour[:, :, None].to(photo).expand(3, rows, width)
    # smeared or mirrored floor
    row = min(height - 1, max(0, height - 1 - round(radius / math.pi * height)))
    ring = photo[:, row]
    if kind == 2:
        coarse = F.interpolate(ring[None], max(1, width // 64), mode="area")
        ring = F.interpolate(coarse, width, mode="nearest")[0]
        return ring[:, None, :].expand(3, rows, width)
    return photo[:, height - rows :].flip(-2).roll(width // 2, dims=-1)
