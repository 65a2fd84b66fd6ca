"""What cameras and programs do to panoramas: augmentation that leaves every label as it is."""

import io
import math
from typing import Annotated

import numpy as np
import torch
import torch.nn.functional as F
from jaxtyping import Float
from PIL import Image
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from ._draw import Draw
from ._photo_faults import add_seams, add_tripod

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Photometric(BaseModel):
    """How strongly photos are varied: shares of them, and largest changes."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    exposure: Annotated[float, Field(ge=0.0)] = 1.2
    """Stops, up and down."""
    white_balance: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.15
    """Relative gain of red against blue, and of green."""
    contrast: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.5
    gamma: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.3
    saturation: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    grey: Share = 0.03
    local_tone: Share = 0.25
    """Of photos whose shadows are lifted and lights held back, as for high dynamic range."""
    blur: Share = 0.3
    blur_width: Annotated[float, Field(gt=0.0)] = 1.2
    """Pixels at 1024 columns."""
    sharpen: Share = 0.15
    noise: Share = 0.4
    noise_level: Annotated[float, Field(ge=0.0)] = 0.03
    """Standard deviation of middle grey."""
    jpeg: Share = 0.5
    jpeg_quality: tuple[int, int] = (30, 90)
    tripod: Share = 0.4
    seams: Share = 0.3


def augment_photo(
    image: Float[Tensor, "3 height width"],
    generator: torch.Generator,
    settings: Photometric | None = None,
) -> Float[Tensor, "3 height width"]:
    """Return a panorama as another camera would have taken it from the same place.

    Lenses that do not match at their seams, a tripod, exposure, white balance, tone curve,
    saturation, blur or sharpening, noise and JPEG, in the order in which they happen. Everything
    goes on across the left and right edge. Values are RGB in [0, 1].

    Args:
        image: Panorama; it is left as it is.
        generator: The only source of chance.
        settings: How strongly; by default as for training.

    Examples:
        >>> image = torch.full((3, 32, 64), 0.5)
        >>> one = augment_photo(image, torch.Generator().manual_seed(3))
        >>> same = augment_photo(image, torch.Generator().manual_seed(3))
        >>> bool(torch.equal(one, same)), bool((one >= 0).all() and (one <= 1).all())
        (True, True)
    """
    settings = settings or Photometric()
    draw = Draw(generator)
    photo = image.clone()
    if draw.chance(settings.seams):
        photo = add_seams(photo, draw)
    if draw.chance(settings.tripod):
        photo = add_tripod(photo, draw)
    if draw.chance(settings.local_tone):
        photo = _local_tone(photo, draw.uniform(0.2, 0.6))
    photo = _colours(photo, draw, settings)
    scale = image.shape[-1] / 1024.0
    if draw.chance(settings.blur):
        photo = _blurred(photo, scale * draw.uniform(0.3, 1.0) * settings.blur_width)
    elif draw.chance(settings.sharpen):
        smooth = _blurred(photo, max(0.6, scale))
        photo = torch.lerp(smooth, photo, draw.uniform(1.3, 2.0)).clamp_(0.0, 1.0)
    if draw.chance(settings.noise):
        photo = _noisy(photo, draw, settings.noise_level)
    if draw.chance(settings.jpeg):
        low, high = settings.jpeg_quality
        photo = through_jpeg(photo, draw.whole(low, high + 1))
    return photo


def through_jpeg(
    image: Float[Tensor, "3 height width"], quality: int
) -> Float[Tensor, "3 height width"]:
    """Return a picture after it was saved as JPEG with a quality of 1 to 95."""
    pixels = image.mul(255.0).round().clamp(0, 255).byte().permute(1, 2, 0).numpy(force=True)
    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, "JPEG", quality=quality)
    read = np.array(Image.open(stream), dtype=np.float32) / 255.0
    return torch.from_numpy(read).permute(2, 0, 1).to(image).contiguous()


def _colours(photo: Tensor, draw: Draw, settings: Photometric) -> Tensor:
    """Return exposure, white balance, saturation, contrast and gamma changed.

    A factor of light is a factor of pixel values too, for these are its power 1 / 2.2.
    """
    stops = draw.uniform(-settings.exposure, settings.exposure)
    warmth = draw.uniform(-settings.white_balance, settings.white_balance)
    tint = draw.uniform(-settings.white_balance, settings.white_balance) / 2
    gain = photo.new_tensor([1 + warmth, 1 + tint, 1 - warmth]) * 2.0 ** (stops / 2.2)
    photo = photo * gain[:, None, None]
    grey = photo.new_tensor([0.299, 0.587, 0.114])
    strength = 1.0 + draw.uniform(-settings.saturation, settings.saturation)
    if draw.chance(settings.grey):
        strength = 0.0
    luminance = torch.tensordot(grey, photo, dims=1)
    photo = torch.lerp(luminance.expand_as(photo), photo, strength).clamp_(0.0, 1.0)
    # a curve through (0, 0), (1/2, 1/2), (1, 1) that rises everywhere
    amount = draw.uniform(-settings.contrast, settings.contrast)
    photo = photo + amount * photo * (1.0 - photo) * (2.0 * photo - 1.0)
    exponent = math.exp(draw.uniform(-settings.gamma, settings.gamma))
    return photo.clamp_(0.0, 1.0).pow_(exponent)


def _local_tone(photo: Tensor, strength: float) -> Tensor:
    """Return the picture with its large-scale light partly taken out."""
    height, width = photo.shape[-2:]
    rows, columns = max(2, height // 32), max(4, width // 32)
    small = F.interpolate(photo.mean(0)[None, None], (rows, columns), mode="area")
    small = F.pad(small, (1, 1, 0, 0), mode="circular")
    wide = F.interpolate(
        small, (height, width + 2 * (width // columns)), mode="bilinear", align_corners=False
    )
    offset = width // columns
    light = wide[0, 0, :, offset : offset + width].clamp_(min=0.02)
    gain = (light.mean() / light).pow(strength)
    return (photo * gain).clamp_(0.0, 1.0)


def _blurred(photo: Tensor, width: float) -> Tensor:
    """Return the picture under a Gaussian of a standard deviation in pixels."""
    reach = max(1, math.ceil(2.5 * width))
    x = torch.arange(-reach, reach + 1, dtype=photo.dtype)
    weights = torch.exp(-0.5 * (x / width) ** 2)
    weights = (weights / weights.sum()).to(photo)
    padded = F.pad(photo[:, None], (reach, reach, 0, 0), mode="circular")
    padded = F.pad(padded, (0, 0, reach, reach), mode="replicate")
    rows = F.conv2d(padded, weights[None, None, None, :])
    return F.conv2d(rows, weights[None, None, :, None])[:, 0].clamp_(0.0, 1.0)


def _noisy(photo: Tensor, draw: Draw, level: float) -> Tensor:
    """Return the picture with noise that grows with the light, sometimes in coarse grains."""
    amount = draw.uniform(0.1, 1.0) * level
    noise = torch.randn(photo.shape, generator=draw.generator).to(photo)
    if draw.chance(0.3):  # what noise reduction leaves
        noise = 2.0 * F.avg_pool2d(F.pad(noise, (1, 0, 1, 0), mode="circular"), 2, stride=1)
    return (photo + amount * (0.3 + 1.4 * photo).sqrt() * noise).clamp_(0.0, 1.0)
