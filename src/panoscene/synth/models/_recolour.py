"""New looks for the materials of a model, by what they are made of."""

import colorsys
import re
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from panoscene.synth.assets import CadModel, Material
from panoscene.synth.textures import TEXTURE_KINDS, make_texture, nudge, palette

Colour = tuple[float, float, float]
_WORDS = {
    "wood": ("wood", "oak", "walnut", "pine", "birch", "beech", "timber", "holz", "cherry", "teak"),
    "leather": ("leather", "leder", "cuir"),
    "fabric": ("fabric", "cloth", "cushion", "textile", "sofa", "linen", "cotton", "fleece"),
    "metal": ("metal", "chrome", "steel", "alu", "iron", "brass", "silver", "inox", "nickel"),
    "paint": ("paint", "enamel", "glaze", "plastic", "lacquer", "toy"),
    "picture": ("picture",),
    "books": ("books",),
    "rug": ("rug", "carpet"),
    "kept": ("black", "rubber", "screen", "dial", "ceramic", "hands", "iron", "ball", "print",
             "ivory", "felt", "glass", "mirror", "paper", "light", "filter", "slot", "lamp"),
}  # fmt: skip
_WOODEN = frozenset(
    ("bed", "bench", "bottom_cabinet", "bottom_cabinet_no_top", "chair", "chest", "coffee_table",
     "console_table", "counter", "crib", "door", "shelf", "stool", "table", "top_cabinet",
     "grandfather_clock", "piano", "standing_tv")
)  # fmt: skip
_CLOTHED = frozenset(
    ("bed", "cushion", "sofa", "sofa_chair", "stool", "chair", "office_chair", "carpet")
)
_BEDDING = 0.75
"""Lightness: what is so light in a bed is bedding, even if its colour is that of wood."""
_KEPT_CATEGORIES = frozenset(("plant", "toilet", "bathtub", "sink", "laptop", "monitor"))
_MACHINES = frozenset(
    ("washer", "dryer", "dishwasher", "fridge", "microwave", "oven", "stove", "cooktop",
     "range_hood", "coffee_machine", "heater", "towel_rack", "office_chair", "treadmill")
)  # fmt: skip
_ENAMELS: tuple[Colour, ...] = ((0.93, 0.93, 0.93), (0.88, 0.86, 0.8), (0.7, 0.71, 0.72),
                                (0.3, 0.31, 0.33), (0.08, 0.08, 0.085))  # fmt: skip
_METALS: tuple[tuple[Colour, float, float], ...] = (
    ((0.82, 0.83, 0.84), 0.14, 1.0), ((0.66, 0.65, 0.63), 0.3, 1.0), ((0.78, 0.6, 0.3), 0.25, 1.0),
    ((0.045, 0.045, 0.05), 0.45, 0.2), ((0.9, 0.9, 0.89), 0.4, 0.0),
)  # fmt: skip


def _named_family(name: str) -> str | None:
    """Return what a material's name says of it; our own names begin with the family."""
    first, tokens = name.split(" ", maxsplit=1)[0], set(re.split(r"[^a-z]+", name))
    if first == "plastic" and tokens & {"black", "white"}:
        return "kept"
    for family, words in _WORDS.items():
        if first == family or first in words:
            return family
    if tokens & set(_WORDS["kept"]):
        return "kept"
    for family in ("leather", "wood", "fabric", "metal"):
        if any(word in name for word in _WORDS[family]):
            return family
    return None


def _family(material: Material, category: str, share: float) -> str:
    """Return what a material is made of, by its name, else by the model's category."""
    if material.kind != "opaque" or category in _KEPT_CATEGORIES:
        return "kept"
    named = _named_family(material.name.lower())
    if named is not None:
        return named
    hue, light, saturation = colorsys.rgb_to_hls(*material.colour)
    if category == "bed" and share > 0.2 and light > _BEDDING:
        return "fabric"
    if share > 0.2 and category in _WOODEN and 0.03 < hue < 0.14 and saturation > 0.15:
        return "wood"
    if share > 0.2 and category in _CLOTHED and material.metallic < 0.3:
        return "fabric"
    return "kept" if light < 0.12 else "paint"


def _old_metres(material: Material) -> float | None:
    """Return the tile of a parametric material's texture; None when uv are not ours."""
    words = material.name.split(" ")
    if len(words) < 3 or words[1] not in TEXTURE_KINDS or not words[2].isdigit():
        return None
    return make_texture(words[1], int(words[2]), 16).metres


def _dressed(material: Material, family: str, kind: str, seed: int, size: int) -> Material:
    """Return the material with another texture, or with its mean colour when the size is 0."""
    texture = make_texture(kind, seed, size or 16)
    mean = texture.colour.reshape(-1, 3).mean(axis=0) / 255.0
    colour = (float(mean[0]), float(mean[1]), float(mean[2])) if size == 0 else (1.0, 1.0, 1.0)
    return replace(
        material, name=f"{family} {kind} {seed}", colour=colour, opacity=material.opacity,
        roughness=float(texture.roughness.mean() / 255.0),
        texture=texture.colour if size else None,
        roughness_map=texture.roughness if size else None,
        normal_map=texture.normal if size else None,
    )  # fmt: skip


def _box_uv(model: CadModel, chosen: Bool[np.ndarray, " faces"], metres: float) -> CadModel:
    """Return the model with uv of a tile of ``metres`` laid flat on the chosen faces."""
    corners = model.faces[chosen]
    points = model.vertices[corners].astype(np.float64)
    normal = np.abs(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]))
    axis = np.argmax(normal, axis=1)
    length = np.ptp(points.reshape(-1, 3), axis=0)
    order = np.argsort(-length)
    plane = np.array([[a for a in order if a != k] for k in range(3)])
    key = corners.reshape(-1) * 3 + np.repeat(axis, 3)
    unique, inverse = np.unique(key, return_inverse=True)
    vertex, side = unique // 3, unique % 3
    uv = np.take_along_axis(model.vertices[vertex].astype(np.float64), plane[side], axis=1) / metres
    faces = model.faces.copy()
    faces[chosen] = len(model.vertices) + inverse.reshape(-1, 3)
    return replace(
        model,
        vertices=np.concatenate([model.vertices, model.vertices[vertex]]),
        normals=np.concatenate([model.normals, model.normals[vertex]]),
        uv=np.concatenate([model.uv, uv.astype(np.float32)]),
        faces=faces.astype(np.int32),
    )


def _painted(rng: np.random.Generator, colour: Colour, choice: Colour) -> Colour:
    """Return a new colour for lacquer: about as light as the old one, so contrasts stay."""
    _, light, saturation = colorsys.rgb_to_hls(*colour)
    if light > 0.8 and saturation < 0.5 and rng.random() < 0.6:
        return nudge(rng, colour, 0.5)
    hue, new_light, new_saturation = colorsys.rgb_to_hls(*choice)
    mixed = float(np.clip(0.55 * light + 0.45 * new_light, 0.05, 0.95))
    return colorsys.hls_to_rgb(hue, mixed, 0.85 * new_saturation)


def _area_shares(model: CadModel) -> Float[np.ndarray, " materials"]:
    a, b, c = (model.vertices[model.faces[:, k]].astype(np.float64) for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    total = np.bincount(model.face_material, area, len(model.materials))
    return total / max(float(total.sum()), 1e-12)


def _cloth(rng: np.random.Generator, family: str) -> tuple[str, int]:
    if family == "leather" and rng.random() < 0.7:
        return "leather", int(rng.integers(14))
    kinds = ("fabric_weave", "fabric_velvet", "fabric_stripes", "fabric_plaid")
    kind = kinds[int(rng.choice(4, p=[0.55, 0.25, 0.12, 0.08]))]
    return kind, int(rng.integers(12 if kind == "fabric_velvet" else 48))


def recoloured(model: CadModel, rng: np.random.Generator, size: int) -> CadModel:
    """Return the model with other woods, cloths, metals and lacquers of one palette."""
    colours = palette(rng)
    shares = _area_shares(model)
    timber, cloth, plating = int(rng.integers(24)), _cloth(rng, "fabric"), int(rng.integers(5))
    coat = nudge(rng, _ENAMELS[int(rng.choice(5, p=[0.45, 0.15, 0.2, 0.1, 0.1]))], 0.3)
    materials = list(model.materials)
    for k, material in enumerate(model.materials):
        family = _family(material, model.category, float(shares[k]))
        if family in ("wood", "fabric", "leather", "picture", "rug", "books"):
            swap = {
                "wood": ("wood", timber),
                "fabric": cloth,
                "leather": _cloth(rng, "leather"),
                "books": ("book_spines", int(rng.integers(48))),
                "rug": ("rug", int(rng.integers(48))),
                "picture": (("picture_abstract", "picture_scenic")[int(rng.integers(2))],
                            int(rng.integers(48))),
            }[family]  # fmt: skip
            model, materials[k] = _retextured(model, k, family, swap, size)
        elif family == "metal" and material.texture is None and rng.random() < 0.5:
            colour, roughness, share = _METALS[plating]
            materials[k] = replace(material, colour=colour, roughness=roughness, metallic=share)
        elif family == "paint" and material.texture is None:
            colour = _painted(rng, material.colour, colours[int(rng.integers(5))])
            if model.category in _MACHINES:
                colour = coat if min(material.colour) > 0.3 else material.colour
            materials[k] = replace(material, colour=colour)
        elif family == "paint":
            materials[k] = replace(material, colour=nudge(rng, material.colour, 1.5))
    return replace(model, materials=tuple(materials))


def _retextured(
    model: CadModel, index: int, family: str, swap: tuple[str, int], size: int
) -> tuple[CadModel, Material]:
    """Return the model, its uv fitted to the new tile, and the new material."""
    material, (kind, seed) = model.materials[index], swap
    whole = family in ("picture", "rug", "books")
    metres = make_texture(kind, seed, 16).metres
    old = _old_metres(material)
    if whole or (old is None and material.texture is not None):
        # a drawing of its own, or a library's image on uv that fit nothing else
        ours = (old is not None and material.name.split(" ")[1] == kind) or family == "picture"
        return model, _dressed(material, family, kind, seed, size) if ours else material
    chosen = model.face_material == index
    if old is None:
        return _box_uv(model, chosen, metres), _dressed(material, family, kind, seed, size)
    uv = model.uv.copy()
    used = np.unique(model.faces[chosen])
    uv[used] *= np.float32(old / metres)
    return replace(model, uv=uv), _dressed(material, family, kind, seed, size)
