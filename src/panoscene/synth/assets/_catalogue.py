"""What a Sweet Home 3D library says of its models: the catalogue and the default colours."""

import re
import struct
from collections import defaultdict

from ._archives import ModelFiles
from ._errors import AssetError
from ._records import LightSource

_CATALOGUES = (
    "PluginFurnitureCatalog.properties",
    "com/eteks/sweethome3d/io/DefaultFurnitureCatalog.properties",
)
_OBJ_LOADER = "com/eteks/sweethome3d/j3d/OBJLoader.class"
_ESCAPE = re.compile(r"\\(u[0-9a-fA-F]{4}|.)")
_WIDTHS = {3: 4, 4: 4, 5: 8, 6: 8, 7: 2, 8: 2, 9: 4, 10: 4, 11: 4, 12: 4}
_WIDTHS |= {15: 3, 16: 2, 17: 4, 18: 4, 19: 2, 20: 2}
"""Bytes behind the tag of every kind of constant but text (Java virtual machine, table 4.4)."""


def parse_properties(text: str) -> dict[str, str]:
    r"""Return the keys and values of a Java properties file.

    Examples:
        >>> parse_properties("# note\nname#1 = Caf\\u00e9 \\\n  table\nwidth#1=80")
        {'name#1': 'Café table', 'width#1': '80'}
    """
    values: dict[str, str] = {}
    logical = re.sub(r"\\\r?\n[ \t\f]*", "", text)
    for line in logical.splitlines():
        content = line.strip(" \t\f")
        if content[:1] in {"", "#", "!"}:
            continue
        match = re.match(r"((?:\\.|[^=:\\\s])+)\s*[=:]?\s*(.*)", content)
        if match:
            values[_unescaped(match[1])] = _unescaped(match[2])
    return values


def _unescaped(text: str) -> str:
    letters = {"t": "\t", "n": "\n", "r": "\r", "f": "\f"}

    def one(match: re.Match[str]) -> str:
        code = match[1]
        return chr(int(code[1:], 16)) if len(code) == 5 else letters.get(code, code)

    return _ESCAPE.sub(one, text)


def read_catalogue(files: ModelFiles) -> dict[str, dict[str, str]]:
    """Return what the library says of every model, by the model's catalogue id.

    Raises:
        AssetError: The archive is no furniture library.
    """
    name = next((name for name in _CATALOGUES if files.find(name)), None)
    if name is None:
        raise AssetError(files.name, f"expected a furniture library with a {_CATALOGUES[0]}")
    entries: dict[str, dict[str, str]] = defaultdict(dict)
    for key, value in parse_properties(files.read(name).decode("latin-1")).items():
        field, hash_sign, number = key.rpartition("#")
        if hash_sign:
            entries[number][field] = value
    return {entry["id"]: entry for entry in entries.values() if "id" in entry}


def light_sources(
    entry: dict[str, str], size: tuple[float, float, float]
) -> tuple[LightSource, ...]:
    """Return the lamps that a catalogue entry puts into a model, in the object frame.

    The catalogue counts in centimetres from the left, back and lower side of a model seen from the
    front; ours is a metre frame with +x to the model's own right.

    Args:
        entry: Fields of the catalogue.
        size: Width, depth and height to which the catalogue's box is scaled.

    Raises:
        AssetError: A field is missing or has too few numbers, or words that are none.
    """
    if "lightSourceX" not in entry:
        return ()
    try:
        return _light_sources(entry, size)
    except (ValueError, KeyError, ZeroDivisionError) as error:
        reason = f"its lamps cannot be read: {error}"
        raise AssetError(entry.get("id", "catalogue"), reason) from error


def _light_sources(
    entry: dict[str, str], size: tuple[float, float, float]
) -> tuple[LightSource, ...]:
    fields = ("lightSourceX", "lightSourceY", "lightSourceZ", "lightSourceDiameter")
    columns = [[float(x) for x in entry.get(field, "").split()] for field in fields]
    box = [float(entry[field]) for field in ("width", "depth", "height")]
    colours = entry.get("lightSourceColor", "").split()
    lights: list[LightSource] = []
    for k, (x, y, z) in enumerate(zip(*columns[:3], strict=True)):
        position = (
            (0.5 - x / box[0]) * size[0],
            (y / box[1] - 0.5) * size[1],
            (z / box[2] - 0.5) * size[2],
        )
        diameter = columns[3][k] / 100 if k < len(columns[3]) else 0.08
        colour = _linear_colour(colours[k]) if k < len(colours) else LightSource(position).colour
        lights.append(LightSource(position, max(diameter, 0.02), colour))
    return tuple(lights)


def _linear_colour(code: str) -> tuple[float, float, float]:
    """Return a ``#rrggbb`` colour as linear light whose largest part is 1."""
    value = int(code.lstrip("#"), 16)
    linear = [(((value >> shift) & 255) / 255) ** 2.2 for shift in (16, 8, 0)]
    top = max(*linear, 1e-6)
    return linear[0] / top, linear[1] / top, linear[2] / top


def default_materials(files: ModelFiles) -> str:
    """Return the MTL text of the colours that the jar's models use without defining them.

    It is the longest text constant with ``newmtl`` lines in the class file of the program's own
    OBJ reader; empty for libraries without that class.
    """
    if files.find(_OBJ_LOADER) is None:
        return ""
    texts = _text_constants(files.read(_OBJ_LOADER), f"{files.name}!{_OBJ_LOADER}")
    tables = [text for text in texts if text.count("newmtl") > 1]
    return max(tables, key=len, default="")


def _text_constants(content: bytes, name: str) -> list[str]:
    """Return the text constants of a Java class file."""
    texts: list[str] = []
    try:
        magic, _, count = struct.unpack_from(">IIH", content)
        if magic != 0xCAFEBABE:
            raise AssetError(name, "expected a Java class file")
        at, index = 10, 1
        while index < count:
            tag = content[at]
            if tag == 1:
                (length,) = struct.unpack_from(">H", content, at + 1)
                texts.append(content[at + 3 : at + 3 + length].decode("utf-8", "replace"))
                at += 3 + length
            else:
                at += 1 + _WIDTHS[tag]
            index += 2 if tag in {5, 6} else 1
    except (struct.error, IndexError, KeyError) as error:
        raise AssetError(name, "damaged constants in a Java class file") from error
    return texts
