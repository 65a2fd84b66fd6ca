"""Another copy of a model: other size, other wood, cloth and colours, the same shape."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from panoscene.synth.assets import CadModel, LightSource

from ._recolour import recoloured

_SIZE_JITTER = {
    **dict.fromkeys(("dishwasher", "washer", "dryer", "oven", "stove", "cooktop", "toilet"), 0.05),
    **dict.fromkeys(("microwave", "laptop", "guitar", "piano", "monitor", "office_chair"), 0.07),
    **dict.fromkeys(("door", "window", "chair", "bathtub", "sink", "fridge", "range_hood"), 0.1),
    **dict.fromkeys(("carpet", "picture", "mirror", "table", "shelf", "counter", "plant"), 0.15),
}


def size_jitter_of(category: str) -> float:
    """Return by how much of its length an axis of such a model may grow or shrink.

    Machines of standard sizes vary little, carpets and tables much.

    Examples:
        >>> size_jitter_of("carpet"), size_jitter_of("washer")
        (0.15, 0.05)
    """
    return _SIZE_JITTER.get(category, 0.12)


def scale_model(model: CadModel, scale: Sequence[float | int]) -> CadModel:
    """Return the model stretched along its width, depth and height.

    Raises:
        ValueError: ``scale`` is not three positive numbers.

    Examples:
        >>> from panoscene.synth.models import make_model
        >>> chest = make_model("chest", 0, texture_size=0)
        >>> round(scale_model(chest, (2.0, 1.0, 1.0)).size[0] / chest.size[0], 3)
        2.0
    """
    factors = np.asarray(scale, np.float64)
    if factors.shape != (3,) or not (np.isfinite(factors).all() and (factors > 0.0).all()):
        raise ValueError(f"scale is {tuple(scale)}; expected three positive numbers")
    normals = model.normals / factors
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    x, y, z = (float(f) for f in factors)
    lights = tuple(
        LightSource((s.position[0] * x, s.position[1] * y, s.position[2] * z), s.diameter, s.colour)
        for s in model.lights
    )
    support = model.support_height
    return replace(
        model,
        vertices=(model.vertices * factors).astype(np.float32),
        normals=normals.astype(np.float32),
        size=(model.size[0] * x, model.size[1] * y, model.size[2] * z),
        support_height=None if support is None else support * z,
        lights=lights,
    )


def vary_model(
    model: CadModel,
    rng: np.random.Generator,
    size_jitter: float | None = None,
    texture_size: int = 1024,
) -> CadModel:
    """Return another copy of a model from any source: jittered in size, recoloured, same base.

    Wood becomes another wood, cloth another cloth, metal another metal; lacquer takes a colour of
    one palette that goes together. Glass, mirrors, lamps, screens and dark parts stay. Wood and
    cloth of plain colour get a procedural texture.

    Args:
        model: from a library or from ``make_model``.
        rng: decides everything; the same state gives the same copy.
        size_jitter: largest relative change of an axis; by the category when None, 0 keeps the
            size.
        texture_size: of new textures, in pixels; 0 uses plain colours.

    Raises:
        ValueError: ``size_jitter`` is outside [0, 0.5].
    """
    jitter = size_jitter_of(model.category) if size_jitter is None else size_jitter
    if not 0.0 <= jitter <= 0.5:
        raise ValueError(f"size_jitter is {jitter}; expected 0 to 0.5")
    number = int(rng.integers(2**32))
    common = 1.0 + 0.6 * jitter * rng.uniform(-1.0, 1.0)
    scale = common * (1.0 + 0.4 * jitter * rng.uniform(-1.0, 1.0, 3))
    varied = recoloured(model, rng, texture_size)
    varied = scale_model(varied, np.clip(scale, 1.0 - jitter, 1.0 + jitter).tolist())
    return replace(varied, id=f"{model.base}~{number:08x}", base=model.base)
