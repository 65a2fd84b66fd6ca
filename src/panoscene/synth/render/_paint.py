"""All materials of a scene as tables that the tracer reads: no code differs between scenes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt32

from panoscene.synth.assets import Material

_LARGEST_TEXTURE = 1024
_WHITEST = 241
"""In sRGB: 0.88 in light. Nothing in a home is whiter."""
_SMOOTHEST = 0.12
"""Smoother surfaces, mirrors apart, would sparkle."""
MIRROR, GLASS = 1, 2
"""Bits of the flags."""


@dataclass(frozen=True, slots=True)
class Paints:
    """Textures one after the other, and where each material finds its own."""

    texels: UInt32[np.ndarray, " texels"]
    """Red, green, blue (sRGB) and roughness, eight bits each, the lowest first."""
    normals: UInt32[np.ndarray, " normals"]
    """Tangent-space normals likewise; the first one is straight up."""
    table: UInt32[np.ndarray, "materials 8"]
    """Start, width and height of the texture, the same of the normal map, flags, mean texel."""
    metal_opacity: Float32[np.ndarray, "materials 2"]


def pack_paints(materials: list[Material]) -> Paints:
    """Return the tables of a scene's materials.

    A material without texture has one of a single texel, so that all are read alike.
    """
    texels: list[np.ndarray] = []
    normals: list[np.ndarray] = [np.array([128 | 128 << 8 | 255 << 16], np.uint32)]
    table = np.zeros((len(materials), 8), np.uint32)
    starts: dict[tuple, tuple[int, int, int]] = {}
    means: dict[tuple, int] = {}
    texel_count, normal_count = 0, 1
    for row, material in zip(table, materials, strict=True):
        maps = (id(material.texture), id(material.roughness_map), material.colour)
        key = (*maps, material.roughness)
        if key not in starts:
            packed = _texels(material)
            starts[key] = (texel_count, packed.shape[1], packed.shape[0])
            texels.append(packed.reshape(-1))
            texel_count += packed.size
            means[key] = _mean(packed)
        row[:3], row[7] = starts[key], means[key]
        row[3:6] = 0, 1, 1
        if material.normal_map is not None:
            key = (id(material.normal_map),)
            if key not in starts:
                packed = _joined([*np.moveaxis(_shrunk(material.normal_map), -1, 0)])
                starts[key] = (normal_count, packed.shape[1], packed.shape[0])
                normals.append(packed.reshape(-1))
                normal_count += packed.size
            row[3:6] = starts[key]
        row[6] = MIRROR * (material.kind == "mirror") + GLASS * (material.kind == "glass")
    extra = np.array([(m.metallic, m.opacity) for m in materials], np.float32).reshape(-1, 2)
    return Paints(np.concatenate(texels), np.concatenate(normals), table, extra)


def linear(colour: np.ndarray | tuple[float, ...]) -> np.ndarray:
    """Return linear light of sRGB values in [0, 1].

    Examples:
        >>> linear((0.0, 0.5, 1.0)).round(3).tolist()
        [0.0, 0.214, 1.0]
    """
    value = np.asarray(colour, dtype=np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


_CODES = np.arange(256, dtype=np.uint8)
_LIGHT = linear(_CODES / 255.0)
"""Of every code: powers are slow, and a home has millions of texels."""


def _texels(material: Material) -> UInt32[np.ndarray, "height width"]:
    """Return a material's colour and roughness, in rows from the top."""
    colour = np.clip(np.array(material.colour, np.float32), 0, 1)
    picture = np.full((1, 1, 3), 255, np.uint8)
    if material.texture is not None:
        picture = _shrunk(material.texture)
    # a product of sRGB values is nearly the sRGB value of the product of lights
    tinted = np.minimum(_CODES[:, None] * colour + 0.5, _WHITEST).astype(np.uint8)
    rough = np.full((1, 1), round(255 * material.roughness), np.uint8)
    if material.roughness_map is not None:
        rough = _shrunk(material.roughness_map)
    height = max(picture.shape[0], rough.shape[0])
    width = max(picture.shape[1], rough.shape[1])
    picture, rough = _stretched(picture, height, width), _stretched(rough, height, width)
    channels = [np.take(tinted[:, k], picture[..., k]) for k in range(3)]
    return _joined([*channels, np.maximum(rough, np.uint8(round(255 * _SMOOTHEST)))])


def _joined(channels: Sequence[np.ndarray]) -> UInt32[np.ndarray, "height width"]:
    """Return up to four channels of eight bits as one number, the first in the lowest bits."""
    joined = np.zeros((*channels[0].shape, 4), np.uint8)
    for k, channel in enumerate(channels):
        joined[..., k] = channel
    return joined.view("<u4")[..., 0].astype(np.uint32, copy=False)


def _mean(packed: UInt32[np.ndarray, "height width"]) -> int:
    """Return the texel of the mean light of a texture."""
    sample = packed.reshape(-1)[:: max(1, packed.size // 20000)]
    parts = np.stack([(sample >> np.uint32(8 * k)) & 255 for k in range(4)], axis=-1)
    light = _LIGHT[parts[:, :3]].mean(axis=0)
    code = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    codes = (np.array([*code, (parts[:, 3] / 255.0).mean()]) * 255 + 0.5).astype(int)
    return int(sum(int(c) << (8 * k) for k, c in enumerate(codes)))


def _stretched(image: np.ndarray, height: int, width: int) -> np.ndarray:
    if image.shape[:2] == (height, width):
        return image
    rows = (np.arange(height) * image.shape[0]) // height
    columns = (np.arange(width) * image.shape[1]) // width
    return image[rows][:, columns]


def _shrunk(image: np.ndarray) -> np.ndarray:
    """Return a picture of at most 1024 pixels, averaged: rays do not filter textures."""
    step = -(-max(image.shape[:2]) // _LARGEST_TEXTURE)
    if step <= 1:
        return image
    rows, columns = image.shape[0] // step, image.shape[1] // step
    blocks = image[: rows * step, : columns * step].astype(np.float32)
    blocks = blocks.reshape(rows, step, columns, step, *image.shape[2:])
    return (blocks.mean(axis=(1, 3)) + 0.5).astype(np.uint8)
