"""Materials: from MTL text and part names to what a renderer needs."""

import io
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from ._archives import ModelFiles, normalised_name
from ._records import Material, MaterialKind

TEXTURE_SIDE = 1024
"""Longest side of a texture in the cache, pixels."""
_IMAGE_PIXELS = 64 * 2**20
_IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".tga")
_METAL = re.compile(r"chrome|inox|steel|acero|alumin|brass|silver|plata|gold|copper|nickel|metal")
_MIRROR = re.compile(r"(^|[^a-z])(mirror|espejo|miroir)([^a-z]|$)")
_GLOWING = re.compile(
    r"shade|pantalla|bulb|bomb(ilh|et)a|emit|luz|glow|multilamps|tela_lamp|cristal|white_glass"
)


@dataclass(frozen=True, slots=True)
class MtlEntry:
    """One material of an MTL file."""

    diffuse: tuple[float, float, float] = (0.7, 0.7, 0.7)
    specular: float = 0.0
    shininess: float = 10.0
    opacity: float = 1.0
    texture: str = ""


def parse_mtl(text: str) -> dict[str, MtlEntry]:
    r"""Return the materials of an MTL file by name; lines that make no sense are passed over.

    Examples:
        >>> parse_mtl("newmtl oak\nKd 0.5 0.25 0\nd 0.5\n")["oak"].opacity
        0.5
    """
    found: dict[str, MtlEntry] = {}
    name = None
    for line in text.splitlines():
        key, _, value = line.strip().partition(" ")
        value = value.strip()
        if key == "newmtl":
            name = " ".join(value.split())
            found[name] = MtlEntry()
        elif name is not None:
            found[name] = _with_line(found[name], key, value)
    return found


def _with_line(entry: MtlEntry, key: str, value: str) -> MtlEntry:
    if key == "map_Kd":
        return replace(entry, texture=value)
    try:
        numbers = [float(word) for word in value.split("#", maxsplit=1)[0].split()]
    except ValueError:
        return entry
    if not numbers or not np.isfinite(numbers).all():
        return entry
    unit = [min(max(number, 0.0), 1.0) for number in numbers]
    changes = {
        "Kd": {"diffuse": (unit[0], unit[1 % len(unit)], unit[2 % len(unit)])},
        "Ks": {"specular": float(np.mean(unit))},
        "Ns": {"shininess": max(numbers[0], 0.0)},
        "d": {"opacity": unit[0]},
        "Tr": {"opacity": 1 - unit[0]},
    }
    return replace(entry, **changes.get(key, {}))


def part_kind(part: str, material: str, entry: MtlEntry) -> MaterialKind:
    """Return glass and mirror for parts and materials named so, and glass for clear materials.

    Opacities from 0.75 on are milky paint and cloth in these libraries, hence opaque.
    """
    bright = sum(entry.diffuse) > 1.2
    if part.startswith("sweethome3d_window_mirror") or (
        bright and _MIRROR.search(material.lower())
    ):
        return "mirror"
    if part.startswith("sweethome3d_window_pane") or entry.opacity < 0.75:
        return "glass"
    return "opaque"


def glows(part: str, material: str) -> bool:
    """Return whether a part of a lamp is called like one that shines: shade, bulb, glass."""
    name = f"{part}|{material}".lower()
    return _GLOWING.search(name) is not None and _METAL.search(material.lower()) is None


def material_of(
    name: str,
    entry: MtlEntry,
    kind: MaterialKind,
    texture: UInt8[np.ndarray, "height width 3"] | None,
) -> Material:
    """Return a material record from an MTL entry.

    The Phong exponent becomes the roughness sqrt(2 / (Ns + 2)) (Walter et al. 2007, section 4),
    the less so the weaker the specular part is.
    """
    gloss = 1 - np.sqrt(2 / (entry.shininess + 2))
    roughness = float(np.clip(0.9 - 0.9 * gloss * min(1.0, entry.specular / 0.5), 0.1, 0.9))
    metal = _METAL.search(name.lower()) is not None and entry.specular > 0.3 and texture is None
    opacity = entry.opacity
    if kind == "glass":
        opacity = opacity if opacity < 0.75 else 0.2
        roughness = roughness if texture is not None else min(roughness, 0.15)
    if kind == "mirror":
        opacity, roughness = 1.0, 0.02
    return Material(
        name=name or "default",
        colour=entry.diffuse if texture is None else (1.0, 1.0, 1.0),
        roughness=roughness,
        metallic=1.0 if metal or kind == "mirror" else 0.0,
        opacity=opacity if kind == "glass" else 1.0,
        kind=kind,
        emission=1.0 if kind == "light" else 0.0,
        texture=texture,
    )


def find_texture(files: ModelFiles, folder: str, wanted: str) -> str | None:
    """Return the file that a ``map_Kd`` line means, or None.

    Tries the path, its last word, and their last steps (authors' absolute paths), then the only
    picture beside the model.
    """
    last_word = wanted.rsplit(maxsplit=1)[-1] if wanted.split() else ""
    for path in (wanted, last_word):
        steps = path.replace("\\", "/")
        for name in (normalised_name(f"{folder}/{steps}"), f"{folder}/{steps.rsplit('/', 1)[-1]}"):
            found = files.find(name.lstrip("/")) if steps else None
            if found and found.lower().endswith(_IMAGES):
                return found
    beside = [name for name in files.names() if name.rpartition("/")[0] == folder]
    pictures = [name for name in beside if name.lower().endswith(_IMAGES)]
    return pictures[0] if len(pictures) == 1 else None


def read_texture(content: bytes) -> UInt8[np.ndarray, "height width 3"] | None:
    """Return a picture as sRGB of at most 1024 pixels a side; None when it cannot be read.

    Clear pixels get the mean colour of the others, since a material has no mask.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(content)) as image:
                if image.width * image.height > _IMAGE_PIXELS:
                    return None
                image.draft("RGB", (TEXTURE_SIDE, TEXTURE_SIDE))
                picture = image.convert("RGBA")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    picture.thumbnail((TEXTURE_SIDE, TEXTURE_SIDE), Image.Resampling.LANCZOS)
    pixels = np.asarray(picture)
    clear = pixels[..., 3] < 128
    colours = np.array(pixels[..., :3])
    if clear.any() and not clear.all():
        colours[clear] = colours[~clear].mean(axis=0).astype(np.uint8)
    return colours


class MaterialTable:
    """Materials of one model by MTL name; textures are read once.

    Args:
        files: Where the model is from.
        folder: Folder of the model in it.
        entries: Of the MTL files.
    """

    def __init__(self, files: ModelFiles, folder: str, entries: Mapping[str, MtlEntry]) -> None:
        self._files, self._folder, self._entries = files, folder, entries
        self._textures: dict[str, UInt8[np.ndarray, "height width 3"] | None] = {}

    def entry(self, name: str) -> MtlEntry:
        """Return the MTL entry of a name; a plain grey one for names nobody defines."""
        return self._entries.get(name, MtlEntry())

    def material(self, name: str, kind: MaterialKind) -> Material:
        """Return the material of a name as a part of this kind has it."""
        entry = self.entry(name)
        picture = find_texture(self._files, self._folder, entry.texture) if entry.texture else None
        if picture is not None and picture not in self._textures:
            self._textures[picture] = read_texture(self._files.read(picture))
        texture = self._textures[picture] if picture is not None else None
        return material_of(name, entry, kind, texture if kind != "mirror" else None)
