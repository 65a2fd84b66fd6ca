"""Finishes: wood, cloth, metal, paint and the rest, drawn from the workshop's generator.

The first word of a material's name is its family; recolouring goes by it.
"""

import numpy as np

from panoscene.synth.assets import Material, MaterialKind
from panoscene.synth.textures import make_texture, nudge, palette

from ._pieces import Number
from ._workshop import Finish, Workshop

_POOL = {"wood": 24, "granite": 8, "marble": 10, "metal_brushed": 8, "wicker": 8, "felt": 6,
         "leather": 14, "fabric_velvet": 12, "clock_dial": 24}  # fmt: skip
_FINE = ("fabric", "felt", "leather", "metal", "wicker", "controls", "clock")
Colour = tuple[float, float, float]


def textured(
    shop: Workshop, kind: str, family: str, *, metallic: Number = 0.0, whole: bool = False,
    kind_of: MaterialKind = "opaque", emission: Number = 0.0, seed: int | None = None,
) -> Finish:  # fmt: skip
    """Return a finish with a procedural texture; ``whole`` pictures keep the pieces' own uv."""
    seed = int(shop.rng.integers(_POOL.get(kind, 48))) if seed is None else seed
    size = min(shop.texture_size, 512) if kind.startswith(_FINE) else shop.texture_size
    texture = make_texture(kind, seed, max(size, 16))
    mean = texture.colour.reshape(-1, 3).mean(axis=0) / 255.0
    plain = size == 0
    material = Material(
        f"{family} {kind} {seed}",
        (float(mean[0]), float(mean[1]), float(mean[2])) if plain else (1.0, 1.0, 1.0),
        float(texture.roughness.mean() / 255.0), metallic, 1.0, kind_of, emission,
        None if plain else texture.colour,
        None if plain else texture.roughness,
        None if plain else texture.normal,
    )  # fmt: skip
    return Finish(material, 0.0 if whole else texture.metres)


def plain(name: str, colour: Colour, roughness: Number = 0.5, metallic: Number = 0.0) -> Finish:
    """Return a finish of one colour."""
    return Finish(Material(name, colour, roughness, metallic))


def wood(shop: Workshop) -> Finish:
    """Return varnished or oiled wood."""
    return textured(shop, "wood", "wood")


def fabric(shop: Workshop) -> Finish:
    """Return upholstery or cushion cloth."""
    kinds = ("fabric_weave", "fabric_weave", "fabric_velvet", "fabric_stripes", "fabric_plaid")
    kind = kinds[int(shop.rng.choice(5, p=[0.3, 0.2, 0.2, 0.17, 0.13]))]
    return textured(shop, kind, "fabric")


def leather(shop: Workshop) -> Finish:
    """Return leather."""
    return textured(shop, "leather", "leather")


def upholstery(shop: Workshop) -> Finish:
    """Return plain cloth or leather for seats."""
    if shop.rng.random() < 0.35:
        return leather(shop)
    return textured(shop, "fabric_weave" if shop.rng.random() < 0.6 else "fabric_velvet", "fabric")


def stone(shop: Workshop) -> Finish:
    """Return marble or granite."""
    return textured(shop, "granite" if shop.rng.random() < 0.6 else "marble", "stone")


def steel(shop: Workshop) -> Finish:
    """Return brushed metal for machines: steel, light or dark, never brass."""
    grey = [
        seed
        for seed in range(_POOL["metal_brushed"] * 2)
        if np.ptp(make_texture("metal_brushed", seed, 16).colour.mean(axis=(0, 1))) < 25.0
    ]
    seed = grey[int(shop.rng.integers(len(grey)))]
    return textured(shop, "metal_brushed", "metal", metallic=0.9, seed=seed)


def metal(shop: Workshop) -> Finish:
    """Return chrome, brass, black or white metal for handles and frames."""
    table = (
        ("metal chrome", (0.82, 0.83, 0.84), 0.14, 1.0),
        ("metal nickel", (0.66, 0.65, 0.63), 0.3, 1.0),
        ("metal brass", (0.78, 0.6, 0.3), 0.25, 1.0),
        ("metal black", (0.045, 0.045, 0.05), 0.45, 0.2),
        ("metal white", (0.9, 0.9, 0.89), 0.4, 0.0),
        ("metal copper", (0.72, 0.42, 0.3), 0.25, 1.0),
    )
    name, colour, roughness, share = table[
        int(shop.rng.choice(6, p=[0.26, 0.24, 0.14, 0.22, 0.08, 0.06]))
    ]
    return plain(name, nudge(shop.rng, colour, 0.3), roughness, share)


def paint(shop: Workshop) -> Finish:
    """Return lacquer: white and greys first, then colours that go together."""
    white = ((0.93, 0.93, 0.92), (0.9, 0.88, 0.84), (0.75, 0.75, 0.74), (0.2, 0.21, 0.23))
    if shop.rng.random() < 0.55:
        colour = white[int(shop.rng.choice(4, p=[0.45, 0.25, 0.15, 0.15]))]
    else:
        colour = palette(shop.rng)[int(shop.rng.integers(5))]
    return plain("paint", nudge(shop.rng, colour, 0.6), float(shop.rng.uniform(0.2, 0.6)))


def silver(shop: Workshop) -> Finish:
    """Return the grey, black or white metal of electronic things."""
    tones = ((0.72, 0.72, 0.73), (0.45, 0.46, 0.48), (0.9, 0.9, 0.89), (0.05, 0.05, 0.055))
    return plain("metal silver", nudge(shop.rng, tones[int(shop.rng.integers(4))], 0.3), 0.35, 0.7)


def body(shop: Workshop) -> Finish:
    """Return what carcasses are made of: wood or lacquer."""
    return wood(shop) if shop.rng.random() < 0.55 else paint(shop)


def plastic(shop: Workshop, colour: Colour | None = None) -> Finish:
    """Return plastic; black, white or grey when no colour is given."""
    table = ((0.05, 0.05, 0.055), (0.9, 0.9, 0.89), (0.35, 0.36, 0.38), (0.6, 0.6, 0.61))
    chosen = table[int(shop.rng.integers(4))] if colour is None else colour
    return plain("plastic", nudge(shop.rng, chosen, 0.4), float(shop.rng.uniform(0.3, 0.55)))


def black(shop: Workshop) -> Finish:
    """Return black plastic."""
    return plain("plastic black", nudge(shop.rng, (0.04, 0.04, 0.045), 0.2), 0.4)


def rubber(shop: Workshop) -> Finish:
    """Return dark rubber."""
    return plain("rubber", nudge(shop.rng, (0.06, 0.06, 0.06), 0.3), 0.9)


def enamel(shop: Workshop) -> Finish:
    """Return what kitchen machines are coated with: white, steel, black, now and then a colour."""
    draw = shop.rng.random()
    if draw < 0.4:
        return plain("enamel", nudge(shop.rng, (0.92, 0.92, 0.92), 0.2), 0.25)
    if draw < 0.75:
        return steel(shop)
    if draw < 0.9:
        return plain("enamel", nudge(shop.rng, (0.07, 0.07, 0.075), 0.2), 0.22)
    colours = ((0.62, 0.12, 0.1), (0.92, 0.86, 0.72), (0.55, 0.72, 0.68), (0.15, 0.22, 0.35))
    return plain("enamel", nudge(shop.rng, colours[int(shop.rng.integers(4))]), 0.25)


def ceramic(shop: Workshop) -> Finish:
    """Return white sanitary ware."""
    return plain("ceramic", nudge(shop.rng, (0.94, 0.94, 0.93), 0.15), 0.1)


def glaze(shop: Workshop) -> Finish:
    """Return glazed pottery in a colour."""
    colour = nudge(shop.rng, palette(shop.rng)[int(shop.rng.integers(5))], 1.5)
    return plain("glaze", colour, float(shop.rng.uniform(0.08, 0.5)))


def glass(shop: Workshop, opacity: Number = 0.12) -> Finish:
    """Return clear glass with a faint tint."""
    tint = nudge(shop.rng, (0.86, 0.93, 0.92), 0.3)
    return Finish(Material("glass", tint, 0.05, 0.0, opacity, "glass"))


def dark_glass(shop: Workshop) -> Finish:
    """Return black glass, as of ovens and hobs; opaque."""
    return plain("black glass", nudge(shop.rng, (0.025, 0.026, 0.03), 0.1), 0.06)


def mirror() -> Finish:
    """Return silvered glass."""
    return Finish(Material("mirror", (0.93, 0.94, 0.94), 0.02, 1.0, 1.0, "mirror"))


def glow(shop: Workshop, strength: Number = 1.0) -> Finish:
    """Return a lamp shade or a globe that lets light through."""
    cloths = ((0.95, 0.91, 0.82), (0.97, 0.96, 0.93), (0.88, 0.78, 0.62), (0.83, 0.68, 0.52))
    tint = nudge(shop.rng, cloths[int(shop.rng.integers(4))], 0.6)
    return Finish(Material("light shade", tint, 0.85, 0.0, 1.0, "light", strength))


def picture(shop: Workshop, kind: str) -> Finish:
    """Return a whole picture for a ``sheet``."""
    return textured(shop, kind, "picture", whole=True)


def screen(shop: Workshop, lit: Number = 0.45, kind: str = "screen_desktop") -> Finish:
    """Return a screen: switched on with the probability ``lit``, else dark."""
    if shop.rng.random() < lit:
        return textured(shop, kind, "screen", whole=True, kind_of="light", emission=0.22)
    return textured(shop, "screen_off", "screen", whole=True)


def display(shop: Workshop) -> Finish:
    """Return the small display of a machine."""
    return textured(shop, "controls", "screen", whole=True)


def mean_colour(finish: Finish, factor: Number = 1.0) -> Colour:
    """Return the finish's mean sRGB colour, darkened by a factor."""
    material = finish.material
    shade = np.asarray(material.colour) * factor
    if material.texture is not None:
        shade = shade * material.texture.reshape(-1, 3).mean(axis=0) / 255.0
    return float(shade[0]), float(shade[1]), float(shade[2])
