"""Where instances are in a picture, and what that is on the sphere."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from panoscene.geometry import panorama_directions
from panoscene.synth.dataset._hulls import hull_area
from panoscene.synth.dataset._pixels import (
    find_regions,
    pixel_box,
    pixel_directions,
    pixel_solid_angle,
)


def test_pixels_cover_the_sphere_once():
    assert pixel_solid_angle(64, 128).sum() * 128 == pytest.approx(4 * np.pi)


def test_directions_are_those_of_the_geometry():
    expected = panorama_directions(16, 32, torch.zeros(1, dtype=torch.float64)).numpy()
    np.testing.assert_allclose(pixel_directions(16, 32), expected, atol=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_regions_against_a_loop(seed):
    rng = np.random.default_rng(seed)
    instance = (rng.integers(0, 4, (6, 8)) * rng.integers(1, 90)).astype(np.int32)
    found = find_regions(instance)
    assert found.instance.tolist() == sorted(set(instance.reshape(-1).tolist()) - {0})
    for k, number in enumerate(found.instance):
        mask = instance == number
        assert found.pixels[k] == mask.sum()
        assert found.crosses_seam[k] == (mask[:, 0] & mask[:, -1]).any()
        for column in range(8):
            rows = np.flatnonzero(mask[:, column])
            expected = (rows[0], rows[-1]) if len(rows) else (6, -1)
            assert (found.first_row[k, column], found.last_row[k, column]) == expected
    np.testing.assert_array_equal(found.place < 0, instance == 0)


@given(st.lists(st.booleans(), min_size=1, max_size=12).filter(any))
def test_pixel_boxes_are_the_shortest_on_the_circle(columns):
    held = np.array(columns)
    first, last = np.where(held, 2, 9).astype(np.int32), np.where(held, 4, -1).astype(np.int32)
    left, top, wide, high = pixel_box(first, last)
    assert (top, high) == (2, 3)
    inside = np.zeros(len(held), bool)
    inside[(left + np.arange(wide)) % len(held)] = True
    assert inside[held].all()
    assert held[left]
    assert held[(left + wide - 1) % len(held)]
    # no shorter window holds them all
    for start in range(len(held)):
        window = (start + np.arange(wide - 1)) % len(held)
        assert not np.isin(np.flatnonzero(held), window).all()


def test_negative_ids_are_refused():
    with pytest.raises(ValueError, match="-3"):
        find_regions(np.array([[-3, 0]], np.int32))


@pytest.mark.parametrize("reach", [0.1, 1.0, 2.5])
def test_hull_areas_of_spherical_caps(reach):
    around = np.linspace(0, 2 * np.pi, 720)
    axis = np.array([0.3, -0.5, 0.8])
    axis /= np.linalg.norm(axis)
    one = np.cross(axis, (1.0, 0.0, 0.0))
    one /= np.linalg.norm(one)
    two = np.cross(axis, one)
    ring = np.cos(reach) * axis + np.sin(reach) * (
        np.cos(around)[:, None] * one + np.sin(around)[:, None] * two
    )
    assert hull_area(ring, axis) == pytest.approx(2 * np.pi * (1 - np.cos(reach)), rel=1e-3)
