"""Kinds of light: draws the time of day, the sky, the sun and how the camera reacts."""

import numpy as np

from panoscene.synth.render._lamps import colour_of_kelvin
from panoscene.synth.render._records import LightKind, LightSetting, RenderScene

LIGHT_SHARES: dict[LightKind, float] = {"sunny": 0.4, "overcast": 0.24, "dusk": 0.14, "night": 0.22}
"""How often each kind of light is drawn."""


def sample_light(
    rng: np.random.Generator, scene: RenderScene | None = None, kind: LightKind | None = None
) -> LightSetting:
    """Return a random light setting.

    Args:
        rng: source of randomness.
        scene: with it a low sun mostly shines into one of its windows.
        kind: of light; by default drawn as :data:`LIGHT_SHARES` says.

    Examples:
        >>> sample_light(np.random.default_rng(0), kind="night").sun_irradiance is None
        True
    """
    kinds = list(LIGHT_SHARES)
    if kind is None:
        kind = kinds[int(rng.choice(len(kinds), p=list(LIGHT_SHARES.values())))]
    if kind not in LIGHT_SHARES:
        raise ValueError(f"kind must be one of {kinds}, found {kind!r}")
    seed = int(rng.integers(2**31))
    azimuth = float(rng.uniform(-np.pi, np.pi))
    if scene is not None and scene.panes and rng.random() < 0.75:
        out = -np.array(scene.panes[int(rng.integers(len(scene.panes)))].normal)
        azimuth = float(np.arctan2(out[0], out[1]) + np.clip(rng.normal(0, 0.6), -1.3, 1.3))
    elevation = float(np.radians(rng.triangular(10, 25, 62)))
    sun = None
    if kind == "sunny":
        through_air = np.exp(-0.24 / np.sin(elevation))
        warmth = 2600.0 + 3200.0 * np.sin(elevation) ** 0.6
        colour = colour_of_kelvin(np.array([warmth]))[0]
        colour = colour / (colour @ np.array([0.2126, 0.7152, 0.0722]))
        red, green, blue = 38.0 * through_air * rng.uniform(0.7, 1.2) * colour
        sun = (float(red), float(green), float(blue))
    sky = {
        "sunny": (2.2, 4.5),
        "overcast": (1.8, 5.0),
        "dusk": (0.04, 0.3),
        "night": (4e-4, 1.5e-3),
    }
    on = {"sunny": 0.15, "overcast": 0.45, "dusk": 0.8, "night": 0.85}
    low = float(rng.choice([2500.0, 2700.0, 3000.0, 3500.0, 4000.0], p=[0.15, 0.4, 0.25, 0.1, 0.1]))
    return LightSetting(
        kind,
        seed,
        azimuth,
        elevation if kind in ("sunny", "overcast") else float(np.radians(-6.0)),
        sun,
        float(np.exp(rng.uniform(*np.log(sky[kind])))),
        on[kind],
        (low, low * float(rng.uniform(1.0, 1.5))),
        float(np.clip(rng.normal(-0.15 if kind == "night" else 0.0, 0.3), -0.7, 0.7)),
        float(rng.uniform(0.6, 0.95)),
        (float(rng.normal(0.0, 0.05)), float(rng.normal(0.0, 0.025))),
    )
