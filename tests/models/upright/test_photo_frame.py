import math

import pytest
import torch
from torch import Tensor

from panoscene.geometry import (
    bfov_contains,
    bfov_from_mask,
    direction_from_lonlat,
    rotate_panorama,
)
from panoscene.models.upright import detections_in_photo
from panoscene.scene import Detections


def about_x(angle: float) -> Tensor:
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def found(bfov: Tensor, mask: Tensor | None = None) -> Detections:
    n = len(bfov)
    return Detections(bfov, torch.arange(n), torch.linspace(0.1, 0.9, n), mask)


def test_the_identity_changes_nothing() -> None:
    bfov = torch.tensor([[0.3, 0.2, 0.5, 0.4], [-3.1, -0.6, 0.3, 0.9]])
    same = detections_in_photo(found(bfov), torch.eye(3))
    assert torch.equal(same.bfov, bfov)
    nearly = detections_in_photo(found(bfov), about_x(1e-5))
    torch.testing.assert_close(nearly.bfov, bfov, atol=0.01, rtol=0)
    assert torch.equal(nearly.score, found(bfov).score)


def test_what_is_ahead_moves_with_the_tilt() -> None:
    # the camera looked up by 20 degrees: what is level ahead is 20 degrees below its middle
    moved = detections_in_photo(found(torch.tensor([[0.0, 0.0, 0.2, 0.1]])), about_x(0.35))
    torch.testing.assert_close(
        moved.bfov, torch.tensor([[0.0, -0.35, 0.2, 0.1]]), atol=1e-3, rtol=0
    )


def test_a_turned_bfov_holds_what_it_held(generator: torch.Generator) -> None:
    bfov = torch.tensor([[0.9, 0.2, 0.5, 0.4], [-2.0, -0.5, 0.3, 0.8]])
    rotation = about_x(0.4)
    moved = detections_in_photo(found(bfov), rotation)
    for old, new in zip(bfov, moved.bfov, strict=True):
        inside = (torch.rand(50, 2, generator=generator) - 0.5) * old[2:] * 0.6 + old[:2]
        inside = direction_from_lonlat(inside)
        inside = inside[bfov_contains(old.expand(len(inside), 4), inside)]
        assert len(inside) > 20
        assert bool(bfov_contains(new.expand(len(inside), 4), inside @ rotation).all())


def test_masks_come_back_to_where_they_were() -> None:
    mask = torch.zeros(2, 64, 128, dtype=torch.bool)
    mask[0, 20:30, 30:50] = True
    mask[1, 40:50, 120:] = mask[1, 40:50, :6] = True
    rotation = about_x(0.3)
    upright = rotate_panorama(mask, rotation, mode="nearest")
    back = detections_in_photo(found(bfov_from_mask(upright), upright), rotation)
    assert back.mask is not None
    overlap = (back.mask & mask).sum((1, 2)) / (back.mask | mask).sum((1, 2))
    assert float(overlap.min()) > 0.8
    torch.testing.assert_close(back.bfov, bfov_from_mask(mask), atol=0.12, rtol=0)


@pytest.mark.parametrize("masked", [True, False])
def test_no_detections_stay_none(masked: bool) -> None:
    mask = torch.zeros(0, 8, 16, dtype=torch.bool) if masked else None
    assert len(detections_in_photo(found(torch.zeros(0, 4), mask), about_x(0.3)).bfov) == 0
