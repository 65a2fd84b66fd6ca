import math

import numpy as np
import pytest
import scipy.ndimage
import torch
from torch import Tensor

from panoscene.geometry import panorama_directions
from panoscene.models.upright._directions import find_directions
from panoscene.models.upright._edges import _correlated, edge_points
from panoscene.models.upright._segments import find_segments


def half_space(normal: Tensor, height: int = 256) -> Tensor:
    """A picture that is bright on one side of a plane through the camera."""
    inside = panorama_directions(height, 2 * height, like=normal) @ normal
    # half a pixel wide, as a lens would blur it
    grey = (0.5 + inside * height / math.pi).clamp(0, 1).float()
    return grey.expand(3, -1, -1).contiguous()


@pytest.mark.parametrize("normal", [(1.0, 0.2, 0.1), (0.1, -0.3, 1.0), (-0.5, 0.6, 0.6)])
def test_a_plane_gives_its_normal(normal: tuple[float, float, float]) -> None:
    plane = torch.tensor(normal, dtype=torch.float64)
    plane = plane / plane.norm()
    segments = find_segments(edge_points(half_space(plane)))
    off = np.degrees(np.arccos(np.minimum(np.abs(segments.normal @ plane.numpy()), 1)))
    assert np.median(off) < 0.05
    assert off.max() < 0.5
    # the views overlap, so the whole circle is there
    assert segments.length.sum() > 2 * math.pi
    # errors are of the size they say
    middle = np.abs(segments.middle @ plane.numpy())
    assert np.median(middle / segments.shift_error) < 3


def test_middles_lie_in_their_planes() -> None:
    segments = find_segments(edge_points(half_space(torch.tensor([0.6, 0.0, 0.8]).double())))
    assert len(segments) > 0
    assert np.abs((segments.middle * segments.normal).sum(1)).max() < 1e-9
    for vectors in (segments.normal, segments.middle, segments.bearing):
        assert np.linalg.norm(vectors, axis=1) == pytest.approx(np.ones(len(segments)))


def test_a_circle_is_not_straight() -> None:
    direction = panorama_directions(256, 512, like=torch.zeros(()))
    centre = torch.tensor([0.0, 0.8, 0.6])
    image = (direction @ centre > math.cos(0.25)).float().expand(3, -1, -1).contiguous()
    segments = find_segments(edge_points(image))
    # a tangent here and there, and no long chord
    assert segments.length.max(initial=0.0) < 0.25
    assert find_directions(segments) is not None


def test_nothing_comes_of_nothing() -> None:
    segments = find_segments(edge_points(torch.zeros(3, 32, 64)))
    assert len(segments) == 0
    assert find_directions(segments) is None


def test_edge_points_lie_within_their_pixels_and_views() -> None:
    image = torch.rand(3, 64, 128, generator=torch.Generator().manual_seed(1))
    points = edge_points(image)
    assert len(points.turn) > 100
    place = (points.plane + math.tan(math.radians(50))) / points.pixel
    assert np.abs(place[:, 0] - points.column - 0.5).max() <= 0.5 + 1e-4
    assert np.abs(place[:, 1] - points.row - 0.5).max() <= 0.5 + 1e-4
    frames = points.camera_from_view
    assert np.linalg.det(frames) == pytest.approx(np.ones(len(frames)), abs=1e-5)


@pytest.mark.parametrize("weights", [[0.1, 0.5, 0.8, 0.5, 0.1], [-0.3, -0.2, 0.0, 0.2, 0.3]])
def test_correlations_are_scipys_to_the_bit(weights: list[float]) -> None:
    view = np.random.default_rng(0).random((40, 50), dtype=np.float32)
    for axis in (0, 1):
        expected = scipy.ndimage.correlate1d(view, weights, axis=axis)
        assert np.array_equal(_correlated(view, np.array(weights), axis), expected)
