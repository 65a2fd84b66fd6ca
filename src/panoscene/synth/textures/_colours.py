"""Colours that people use in homes, and sets of them that go together."""

import colorsys

import numpy as np

from ._noise import Colour, Number

_SETS: tuple[tuple[str, ...], ...] = (
    ("#2f4858", "#86a3b8", "#e8d2a6", "#f48484", "#f5efe7"),
    ("#3d5a45", "#7d9d7f", "#cfd8c0", "#b5794a", "#f2ebdd"),
    ("#5b3a29", "#a9714b", "#d9b08c", "#e9dcc9", "#37474f"),
    ("#26344a", "#4f6d8f", "#a8c0d6", "#e6e1d6", "#c4843c"),
    ("#6b2d3c", "#a85c6a", "#d8a7a0", "#efe3d9", "#4a4e52"),
    ("#2b2b2b", "#6e6e6e", "#b4b1ab", "#e9e6e0", "#a3472f"),
    ("#4b3f63", "#8577a6", "#c9bfdc", "#eee8e1", "#d0a24c"),
    ("#0f5257", "#5aa9a5", "#b6d8d2", "#f4efe4", "#d96c4f"),
    ("#7a5c2e", "#c79a4b", "#e8cf98", "#f5efe1", "#54625a"),
    ("#394a3a", "#5f7355", "#a4ac86", "#e5ddc5", "#7f4f24"),
    ("#202c39", "#4d5f70", "#b8b08d", "#f2d492", "#f29559"),
    ("#8c3b2a", "#c8674a", "#e6b89c", "#ead7c7", "#4281a4"),
)
_WALLS: tuple[str, ...] = (
    "#f6f4ef", "#f2efe8", "#efece4", "#f4f4f2", "#ece7dc", "#e9e4d8", "#e6e3dd", "#dcd9d3",
    "#e8e1d3", "#e4dccb", "#dfe5e3", "#d5dfdd", "#dbe2e8", "#c9d6dc", "#e9e2e0", "#e8d9d2",
    "#d9ddcf", "#c6cdb8", "#f3ead0", "#efe0c6", "#b9c4c2", "#a9b7b0", "#8fa3a8", "#c8bfae",
    "#6f8087", "#7d8a72", "#b98d7a", "#4f5f66",
)  # fmt: skip
_WALL_WEIGHTS = np.array([8.0] * 5 + [5.0] * 7 + [2.5] * 8 + [1.0] * 8)


def from_hex(code: str) -> Colour:
    """Return sRGB in [0, 1].

    Examples:
        >>> from_hex("#ff8000")[0]
        1.0
    """
    return (int(code[1:3], 16) / 255, int(code[3:5], 16) / 255, int(code[5:7], 16) / 255)


def nudge(rng: np.random.Generator, colour: Colour, amount: Number = 1.0) -> Colour:
    """Return a colour a little off the given one in hue, saturation and lightness."""
    hue, light, saturation = colorsys.rgb_to_hls(*colour)
    hue = (hue + rng.normal(0.0, 0.012) * amount) % 1.0
    light = float(np.clip(light + rng.normal(0.0, 0.03) * amount, 0.02, 0.97))
    saturation = float(np.clip(saturation * (1 + rng.normal(0.0, 0.12) * amount), 0.0, 1.0))
    return colorsys.hls_to_rgb(float(hue), light, saturation)


def palette(rng: np.random.Generator) -> tuple[Colour, ...]:
    """Return five colours that go together; the last is the accent."""
    chosen = _SETS[int(rng.integers(len(_SETS)))]
    turn, dim = float(rng.normal(0.0, 0.015)), float(rng.uniform(0.92, 1.06))
    colours = []
    for code in chosen:
        hue, light, saturation = colorsys.rgb_to_hls(*from_hex(code))
        light = min(light * dim, 0.96)
        colours.append(colorsys.hls_to_rgb((hue + turn) % 1.0, light, saturation))
    return tuple(colours)


def wall_colour(rng: np.random.Generator) -> Colour:
    """Return a colour for a painted wall: mostly off-white, now and then a deep tone."""
    index = rng.choice(len(_WALLS), p=_WALL_WEIGHTS / _WALL_WEIGHTS.sum())
    return nudge(rng, from_hex(_WALLS[int(index)]), 0.4)


def shade(colour: Colour, factor: Number) -> Colour:
    """Return a colour darkened (below 1) or lightened towards white (above 1)."""
    if factor <= 1.0:
        return (colour[0] * factor, colour[1] * factor, colour[2] * factor)
    share = 1.0 - 1.0 / factor
    return (
        colour[0] + (1.0 - colour[0]) * share,
        colour[1] + (1.0 - colour[1]) * share,
        colour[2] + (1.0 - colour[2]) * share,
    )
