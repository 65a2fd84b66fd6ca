"""Photometric augmentation: reproducible, in range, and without a seam."""

import pytest
import torch
from torch import Tensor

from panoscene.data import Photometric, augment_photo, through_jpeg

SHARES = ("grey", "local_tone", "blur", "sharpen", "noise", "jpeg", "tripod", "seams")
AMOUNTS = ("exposure", "white_balance", "contrast", "gamma", "saturation")
STILL = dict.fromkeys(SHARES, 0.0) | dict.fromkeys(AMOUNTS, 0.0)


def with_only(*faults: str) -> Photometric:
    """Return settings that change nothing but these."""
    return Photometric.model_validate(STILL | dict.fromkeys(faults, 1.0) | {"blur_width": 5.0})


def room(generator: torch.Generator, width: int = 128) -> Tensor:
    """Return a smooth panorama without a seam, with some texture."""
    lon = torch.arange(width) / width * 2 * torch.pi
    lat = torch.linspace(0, 1, width // 2)
    light = 0.5 + 0.2 * torch.cos(lon + 1.0)[None] + 0.2 * lat[:, None] - 0.1
    return (light + 0.02 * torch.randn(3, width // 2, width, generator=generator)).clamp(0, 1)


def test_nothing_wanted_nothing_changed(generator: torch.Generator) -> None:
    image = room(generator)
    result = augment_photo(image, generator, with_only())
    torch.testing.assert_close(result, image, atol=1e-6, rtol=0)


@pytest.mark.parametrize("name", SHARES)
def test_each_fault_alone(generator: torch.Generator, name: str) -> None:
    image = room(generator)
    before = image.clone()
    changed = 0
    for seed in range(6):
        settings = with_only(name)
        result = augment_photo(image, torch.Generator().manual_seed(seed), settings)
        assert result.shape == image.shape
        assert bool(result.isfinite().all())
        assert result.min() >= 0
        assert result.max() <= 1
        changed += (result - image).abs().max() > 0.004
    assert changed >= 5
    assert torch.equal(image, before)


@pytest.mark.parametrize("seed", range(8))
def test_the_same_generator_gives_the_same_photo(generator: torch.Generator, seed: int) -> None:
    image = room(generator)
    one = augment_photo(image, torch.Generator().manual_seed(seed))
    other = augment_photo(image, torch.Generator().manual_seed(seed))
    assert torch.equal(one, other)
    assert not torch.equal(one, augment_photo(image, torch.Generator().manual_seed(seed + 100)))


@pytest.mark.parametrize("name", ["blur", "local_tone", "sharpen"])
def test_no_seam_appears(generator: torch.Generator, name: str) -> None:
    # what happens to a rolled panorama is what happens to the panorama, rolled
    image = room(generator)
    settings = with_only(name)
    straight = augment_photo(image, torch.Generator().manual_seed(0), settings)
    rolled = augment_photo(image.roll(32, -1), torch.Generator().manual_seed(0), settings)
    torch.testing.assert_close(straight.roll(32, -1), rolled, atol=1e-5, rtol=0)


def test_a_tripod_stays_at_the_bottom(generator: torch.Generator) -> None:
    image = room(generator)
    settings = with_only("tripod")
    for seed in range(10):
        result = augment_photo(image, torch.Generator().manual_seed(seed), settings)
        difference = (result - image).abs().amax(dim=0)
        assert difference[:42].max() < 0.01  # above 40 degrees from the lowest point
        assert difference[-2:].mean() > 0.002


def test_jpeg_keeps_the_picture(generator: torch.Generator) -> None:
    image = room(generator)
    fine, coarse = through_jpeg(image, 95), through_jpeg(image, 20)
    assert (fine - image).abs().mean() < (coarse - image).abs().mean() < 0.05


def test_settings_are_checked() -> None:
    with pytest.raises(ValueError, match="tripod"):
        Photometric(tripod=1.5)
