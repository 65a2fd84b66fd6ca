"""Boxes on tangent planes: round trips, limits near 180 degrees, behind the plane."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._bfov import bfov_contains
from panoscene.geometry._sphere import camera_from_turned, direction_from_lonlat
from panoscene.geometry._tangent_box import (
    MAX_TANGENT_FOV,
    bfov_from_tangent_box,
    tangent_box_from_bfov,
    tangent_box_from_directions,
    tangent_points,
)

LIMIT = math.tan(MAX_TANGENT_FOV / 2)


@settings(max_examples=30, deadline=None)
@given(
    lon=st.floats(-3.1, 3.1),
    lat=st.floats(-1.57, 1.57),
    width=st.floats(0.0, MAX_TANGENT_FOV),
    height=st.floats(0.0, MAX_TANGENT_FOV),
)
def test_bfov_to_box_to_bfov(lon, lat, width, height):
    bfov = torch.tensor([lon, lat, width, height], dtype=torch.float64)
    again = bfov_from_tangent_box(tangent_box_from_bfov(bfov), bfov[:2])
    torch.testing.assert_close(again, bfov, atol=1e-9, rtol=0)


def test_fields_of_view_are_cut_near_180_degrees():
    box = tangent_box_from_bfov(torch.tensor([0.0, 0.0, 2 * math.pi, math.pi]))
    torch.testing.assert_close(box, torch.tensor([-LIMIT, -LIMIT, LIMIT, LIMIT]))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_points_lift_back_to_their_directions(seed):
    generator = torch.Generator().manual_seed(seed)
    directions = torch.randn(50, 3, generator=generator, dtype=torch.float64)
    lonlat = (torch.rand(2, generator=generator, dtype=torch.float64) - 0.5) * 3
    points, shown = tangent_points(directions, lonlat)
    turned = torch.stack((points[:, 0], torch.ones(50, dtype=torch.float64), points[:, 1]), -1)
    lifted = turned @ camera_from_turned(lonlat).T
    cosine = torch.nn.functional.cosine_similarity(lifted, directions)
    torch.testing.assert_close(cosine[shown], torch.ones_like(cosine[shown]))
    ahead = torch.nn.functional.cosine_similarity(directions, direction_from_lonlat(lonlat)[None])
    assert torch.equal(shown, ahead >= math.cos(MAX_TANGENT_FOV / 2))
    assert (points[~shown] == 0).all()


def test_right_is_right_and_up_is_up_across_the_seam():
    directions = direction_from_lonlat(torch.tensor([[-3.1, 0.1], [3.1, -0.1]]))
    box = tangent_box_from_directions(directions, torch.tensor([math.pi, 0.0]))
    assert box[0] < 0 < box[2]
    torch.testing.assert_close(box[2], torch.tensor(math.tan(math.pi - 3.1)), atol=1e-6, rtol=0)
    torch.testing.assert_close(box[3], torch.tensor(math.tan(0.1)), atol=1e-3, rtol=0)


def test_directions_behind_the_plane_push_to_the_limit():
    directions = torch.tensor([[0.0, 1.0, 0.0], [1.0, -1.0, -0.2]], requires_grad=True)
    box = tangent_box_from_directions(directions, torch.zeros(2))
    torch.testing.assert_close(box.detach(), torch.tensor([0.0, -LIMIT, LIMIT, 0.0]))
    box.sum().backward()
    assert directions.grad is not None
    assert directions.grad.isfinite().all()


def test_invalid_points_do_not_count():
    directions = torch.tensor([[0.1, 1.0, 0.2], [5.0, 1.0, 5.0]])
    box = tangent_box_from_directions(directions, torch.zeros(2), torch.tensor([True, False]))
    torch.testing.assert_close(box, torch.tensor([0.1, 0.2, 0.1, 0.2]))
    with pytest.raises(ValueError, match=r"no valid point in entry \(\)"):
        tangent_box_from_directions(directions, torch.zeros(2), torch.zeros(2, dtype=torch.bool))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_bfov_of_an_off_centre_box_contains_the_box(seed):
    generator = torch.Generator().manual_seed(seed)
    ends = (torch.rand(2, 2, generator=generator, dtype=torch.float64) - 0.5) * 4
    low, high = ends.amin(0), ends.amax(0)
    lonlat = (torch.rand(2, generator=generator, dtype=torch.float64) - 0.5) * 3
    bfov = bfov_from_tangent_box(torch.cat((low, high)), lonlat)
    inside = low + (high - low) * torch.rand(500, 2, generator=generator, dtype=torch.float64)
    turned = torch.stack((inside[:, 0], torch.ones(500, dtype=torch.float64), inside[:, 1]), -1)
    directions = turned @ camera_from_turned(lonlat).T
    assert bfov_contains(bfov.expand(500, 4), directions, 1e-3).all()
    assert wrap_angle(bfov[0]) == bfov[0]


@pytest.mark.parametrize("box", [(1.0, 0.0, 0.0, 1.0), (0.0, math.nan, 1.0, 1.0)])
def test_refuses_boxes_that_are_none(box):
    with pytest.raises(ValueError, match="expected finite left <= right"):
        bfov_from_tangent_box(torch.tensor(box), torch.zeros(2))


def test_gradients():
    generator = torch.Generator().manual_seed(0)
    directions = torch.tensor([0.0, 2.0, 0.0]) + torch.randn(4, 3, generator=generator)
    directions, lonlat = directions.double().requires_grad_(), torch.full((2,), 0.2).double()
    lonlat.requires_grad_()
    assert torch.autograd.gradcheck(tangent_box_from_directions, (directions, lonlat))
    bfov = torch.tensor([0.3, 0.2, 0.8, 0.5], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(tangent_box_from_bfov, (bfov,))
