"""From light to a photograph: denoising, exposure, white balance and the tone curve."""

import numpy as np
from jaxtyping import Float32, Float64, UInt8

from panoscene.synth.render._lamps import LUMINANCE
from panoscene.synth.render._mitsuba import Engine
from panoscene.synth.render._records import LightSetting

_PAD = 32
_MID_GREY, _MID_CODE = 0.18, 0.47
"""Scene light that the curve takes to this part of full white."""


def wrap_pad(
    image: Float32[np.ndarray, "height width channels"], pad: int = _PAD
) -> Float32[np.ndarray, "rows columns channels"]:
    """Return the panorama with a margin as the sphere continues it.

    Left and right wrap around; above and below, the picture goes on down the opposite meridian.

    Examples:
        >>> wrap_pad(np.arange(8, dtype=np.float32).reshape(2, 4, 1), 1)[..., 0].tolist()[0]
        [1.0, 2.0, 3.0, 0.0, 1.0, 2.0]
    """
    half = image.shape[1] // 2
    over, under = (np.roll(part[::-1], half, axis=1) for part in (image[:pad], image[-pad:]))
    tall = np.concatenate([over, image, under])
    return np.ascontiguousarray(np.concatenate([tall[:, -pad:], tall, tall[:, :pad]], axis=1))


def denoise(
    engine: Engine, image: Float32[np.ndarray, "height width 9"]
) -> Float32[np.ndarray, "height width 3"]:
    """Return the radiance without noise; the guides are its albedo and normals."""
    pad = min(_PAD, image.shape[0] // 2)
    padded = wrap_pad(image, pad)
    clean = engine.oidn.denoise(
        np.ascontiguousarray(padded[..., :3]),
        albedo=np.ascontiguousarray(np.clip(padded[..., 3:6], 0, 1)),
        normal=np.ascontiguousarray(np.clip(padded[..., 6:9], -1, 1)),
        hdr=True,
    )
    return np.maximum(np.array(clean)[pad:-pad, pad:-pad], 0)


def develop(
    radiance: Float32[np.ndarray, "height width 3"],
    albedo: Float32[np.ndarray, "height width 3"],
    light: LightSetting,
) -> UInt8[np.ndarray, "height width 3"]:
    """Return the sRGB photograph of a scene.

    The exposure makes the log-mean luminance mid-grey (without the poles, which fill a fifth of
    the rows at either end), plus the setting's own. The white balance follows the light that falls
    on the surfaces, as far as the setting says. The curve is a sigmoid over log light that keeps
    windows and lamps from burning out at once; bright colours fade to white.
    """
    rows = radiance.shape[0] // 5
    middle, paint = radiance[rows:-rows], albedo[rows:-rows]
    lit = _white(middle, paint)
    gains = lit**-light.adaptation * 2.0 ** np.array([light.tint[0], light.tint[1], -light.tint[0]])
    image = radiance * (gains / (gains @ LUMINANCE)).astype(np.float32)
    luminance = image[rows:-rows] @ LUMINANCE
    typical = np.exp(np.log(np.maximum(luminance, 1e-7)).mean())
    typical = max(typical, 0.12 * float(luminance.mean()), 2e-4)  # the dark stays dark
    target = 0.21 * 2.0**light.exposure
    return tone_curve(image * np.float32(target / typical))


def tone_curve(
    light: Float32[np.ndarray, "*image 3"], contrast: float = 1.02
) -> UInt8[np.ndarray, "*image 3"]:
    """Return display values of exposed linear light; 0.18 is mid-grey.

    Examples:
        >>> tone_curve(np.float32([[0, 0, 0], [0.18, 0.18, 0.18], [50, 50, 50]]))[:, 0].tolist()
        [0, 120, 254]
    """
    mix = 0.10  # colours first move towards each other, so that bright ones fade to white
    grey = light.mean(axis=-1, keepdims=True)
    mixed = np.maximum(light * (1 - mix) + mix * grey, 0) ** np.float32(contrast)
    knee = _MID_GREY**contrast * (1 / _MID_CODE - 1)
    code = mixed / (mixed + np.float32(knee))
    grey = code.mean(axis=-1, keepdims=True)
    code = grey + (code - grey) * np.float32(1.12)
    return (np.clip(code, 0, 1) * 255 + 0.5).astype(np.uint8)


def _white(
    radiance: Float32[np.ndarray, "rows width 3"], albedo: Float32[np.ndarray, "rows width 3"]
) -> Float64[np.ndarray, "3"]:
    """Return the colour, of luminance 1, of the light on surfaces that are not black."""
    use = (albedo.min(axis=-1) > 0.08) & (radiance.max(axis=-1) > 1e-6)
    if not use.any():
        return np.ones(3)
    ratio = np.maximum(radiance[use], 1e-7) / albedo[use]
    colour = np.exp(np.log(ratio.astype(np.float64)).mean(axis=0))
    return np.clip(colour / (colour @ LUMINANCE), 0.2, 5.0)
