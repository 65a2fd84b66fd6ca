"""Wavefront OBJ files, read as polygons with their part and material names."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from ._errors import AssetError

_MAX_CORNERS = 8_000_000
_LONGEST_WORD = 64
"""Characters of a number; a table of words takes as much memory as its longest one."""


@dataclass(frozen=True, slots=True)
class Polygons:
    """The polygons of a model, as its file has them."""

    positions: Float64[np.ndarray, "positions 3"]
    uv: Float64[np.ndarray, "uvs 2"]
    normals: Float64[np.ndarray, "normals 3"]
    corners: Int64[np.ndarray, "corners 3"]
    """Position, uv and normal of every corner; -1 where the file gives no uv or normal."""
    starts: Int64[np.ndarray, " polygons_and_one"]
    """Polygon k has the corners ``starts[k]`` to ``starts[k + 1] - 1``."""
    part: Int64[np.ndarray, " polygons"]
    """Index into ``part_names``."""
    material: Int64[np.ndarray, " polygons"]
    """Index into ``material_names``."""
    part_names: tuple[str, ...]
    material_names: tuple[str, ...]
    material_files: tuple[str, ...]
    """MTL files the OBJ asks for."""


class _Names:
    """Numbers for names, in the order of their first use."""

    def __init__(self) -> None:
        self.index: dict[str, int] = {"": 0}

    def number(self, words: list[bytes]) -> int:
        name = b" ".join(words).decode("utf-8", "replace")
        return self.index.setdefault(name, len(self.index))


def parse_obj(content: bytes, name: str) -> Polygons:
    """Return the polygons of an OBJ file.

    Args:
        content: Of the file.
        name: Of the file, for messages.

    Raises:
        AssetError: The file has no usable faces, or numbers that are none.
    """
    numbers: dict[bytes, list[bytes]] = {b"v": [], b"vt": [], b"vn": []}
    width = {b"v": 3, b"vt": 2, b"vn": 3}
    tokens: list[bytes] = []
    counts: list[int] = []
    seen: list[tuple[int, int, int]] = []
    parts, materials = _Names(), _Names()
    part = material = 0
    labels: list[tuple[int, int]] = []
    libraries: list[str] = []
    for line in content.replace(b"\\\n", b" ").replace(b"\\\r\n", b" ").splitlines():
        words = line.split()
        if not words:
            continue
        key = words[0]
        if key in numbers:
            row = words[1 : 1 + width[key]]
            row += [b"0"] * (width[key] - len(row))
            numbers[key] += row
            if len(numbers[key]) > 3 * _MAX_CORNERS:
                raise AssetError(name, f"found more than {_MAX_CORNERS} vertices")
        elif key == b"f" and len(words) > 3:
            tokens += words[1:]
            counts.append(len(words) - 1)
            if len(tokens) > _MAX_CORNERS:
                break
            labels.append((part, material))
            have = (len(numbers[b"v"]) // 3, len(numbers[b"vt"]) // 2, len(numbers[b"vn"]) // 3)
            seen.append(have)
        elif key in {b"g", b"o"}:
            part = parts.number(words[1:])
        elif key == b"usemtl":
            material = materials.number(words[1:])
        elif key == b"mtllib" and len(words) > 1:
            libraries.append(line.split(None, 1)[1].strip().decode("utf-8", "replace"))
    if not 0 < len(tokens) <= _MAX_CORNERS:
        raise AssetError(name, f"found {len(counts)} faces with {len(tokens)} corners")
    arrays = {key: _table(numbers[key], width[key], name) for key in numbers}
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    lengths = tuple(len(arrays[key]) for key in (b"v", b"vt", b"vn"))
    have = np.repeat(np.array(seen, np.int64), counts, axis=0)
    label = np.array(labels, np.int64)
    return Polygons(
        positions=arrays[b"v"],
        uv=arrays[b"vt"],
        normals=arrays[b"vn"],
        corners=_corners(tokens, have, lengths, name),
        starts=starts,
        part=label[:, 0],
        material=label[:, 1],
        part_names=tuple(parts.index),
        material_names=tuple(materials.index),
        material_files=tuple(libraries),
    )


def _table(words: list[bytes], width: int, name: str) -> Float64[np.ndarray, "rows width"]:
    _refuse_long(words, name)
    try:
        table = np.array(words, "S").astype(np.float64) if words else np.zeros(0)
    except ValueError as error:
        raise AssetError(name, f"found a coordinate that is no number: {error}") from error
    if not np.isfinite(table).all():
        raise AssetError(name, "found a coordinate that is not finite")
    return table.reshape(-1, width)


def _refuse_long(words: list[bytes], name: str) -> None:
    longest = max(map(len, words), default=0)
    if longest > _LONGEST_WORD:
        raise AssetError(name, f"found a number of {longest} characters")


def _corners(
    tokens: list[bytes],
    have: Int64[np.ndarray, "corners 3"],
    lengths: tuple[int, ...],
    name: str,
) -> Int64[np.ndarray, "corners 3"]:
    """Return 0-based indices from ``position/uv/normal`` texts; uv and normal may be missing."""
    _refuse_long(tokens, name)
    slashes = np.char.count(np.array(tokens, "S"), b"/") if tokens else np.zeros(0, np.int64)
    raw = np.zeros((len(tokens), 3), np.int64)
    try:
        for number in np.unique(slashes):
            rows = np.flatnonzero(slashes == number)
            text = b" ".join([tokens[row] for row in rows])
            text = (text + b" ").replace(b"//", b"/0/").replace(b"/ ", b"/0 ").replace(b"/", b" ")
            found = np.array(text.split(), "S").astype(np.int64).reshape(len(rows), number + 1)
            raw[rows, : number + 1] = found[:, :3]
    except (ValueError, OverflowError) as error:
        raise AssetError(name, f"found a face corner that is no index: {error}") from error
    index = np.where(raw > 0, raw - 1, np.where(raw < 0, raw + have, -1))
    bad = (index >= np.array(lengths)) | ((raw < 0) & (index < 0))
    if (bad[:, 0] | (index[:, 0] < 0)).any():
        raise AssetError(name, "found a face with a corner that does not exist")
    index[bad] = -1
    return index
