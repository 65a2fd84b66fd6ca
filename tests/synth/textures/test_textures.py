"""Procedural textures: the same for a seed, different between seeds, seamless where promised."""

import numpy as np
import pytest

from panoscene.synth.textures import (
    FLOOR_KINDS,
    TEXTURE_KINDS,
    TILEABLE_KINDS,
    WALL_KINDS,
    make_texture,
    palette,
    wall_colour,
)
from panoscene.synth.textures._texture import _made


def _step(field: np.ndarray, axis: int) -> tuple[float, float]:
    """Return the mean step across the seam, and the 90th percentile of that inside."""
    field = np.moveaxis(field.astype(np.float64), axis, 0)
    seam = float(np.abs(field[0] - field[-1]).mean())
    inside = np.abs(np.diff(field, axis=0)).reshape(len(field) - 1, -1).mean(axis=1)
    return seam, float(inside.max())


@pytest.mark.parametrize("kind", TEXTURE_KINDS)
def test_textures_are_square_seeded_and_read_only(kind: str) -> None:
    texture = make_texture(kind, 5, size=64)
    assert texture.colour.shape == (64, 64, 3)
    assert texture.roughness.shape == (64, 64)
    assert texture.normal.shape == (64, 64, 3)
    assert 0.05 <= texture.metres <= 3.0
    again = _made(kind, 5, 64)
    np.testing.assert_array_equal(texture.colour, again.colour)
    np.testing.assert_array_equal(texture.normal, again.normal)
    with pytest.raises(ValueError, match="read-only"):
        texture.colour[0, 0, 0] = 0


@pytest.mark.parametrize("kind", TEXTURE_KINDS)
def test_seeds_give_different_textures(kind: str) -> None:
    colours = [make_texture(kind, seed, size=64).colour.astype(int) for seed in range(4)]
    distance = [np.abs(a - b).mean() for i, a in enumerate(colours) for b in colours[:i]]
    assert min(distance) > 0.0
    assert np.median(distance) > (0.1 if kind == "screen_off" else 2.0)


@pytest.mark.parametrize("kind", TILEABLE_KINDS)
@pytest.mark.parametrize("seed", [0, 3])
def test_edges_match(kind: str, seed: int) -> None:
    texture = make_texture(kind, seed, size=128)
    for array in (texture.colour, texture.normal, texture.roughness):
        for axis in (0, 1):
            seam, inside = _step(array, axis)
            assert seam <= 1.25 * inside + 1.0


@pytest.mark.parametrize("kind", TEXTURE_KINDS)
def test_normals_are_unit_and_look_outwards(kind: str) -> None:
    normal = (make_texture(kind, 2, size=128).normal.astype(np.float64) - 128.0) / 127.0
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1.0, atol=0.02)
    assert normal[..., 2].min() > 0.0


def test_normals_lean_away_from_the_raised_side() -> None:
    """Joints between tiles are lower: at the left edge of a tile the normal leans left."""
    texture = next(
        t for t in (make_texture("wall_tiles", s, size=512) for s in range(20)) if t.metres == 0.72
    )
    red = texture.normal[..., 0].astype(int) - 128
    pitch = 512 / 24
    left = [red[:, int(k * pitch + 2) % 512].mean() for k in range(24)]
    right = [red[:, int(k * pitch - 3) % 512].mean() for k in range(24)]
    assert np.mean(left) < -1.0
    assert np.mean(right) > 1.0


def test_floors_and_walls_are_among_the_seamless_ones() -> None:
    assert set(FLOOR_KINDS) | set(WALL_KINDS) <= set(TILEABLE_KINDS)
    assert len(FLOOR_KINDS) >= 6
    assert len(WALL_KINDS) >= 6


def test_a_design_stays_the_same_at_another_size() -> None:
    small = make_texture("floor_herringbone", 4, size=128).colour.astype(float)
    large = make_texture("floor_herringbone", 4, size=256).colour.astype(float)
    shrunk = large.reshape(128, 2, 128, 2, 3).mean(axis=(1, 3))
    assert np.abs(shrunk.mean(axis=(0, 1)) - small.mean(axis=(0, 1))).max() < 25.0


def test_wrong_arguments_are_named() -> None:
    with pytest.raises(ValueError, match="kind is 'lava'"):
        make_texture("lava", 0)
    with pytest.raises(ValueError, match="seed is -1"):
        make_texture("wood", -1)
    with pytest.raises(ValueError, match="size is 100"):
        make_texture("wood", 0, size=100)


def test_colours_are_in_range() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        values = np.array([*palette(rng), wall_colour(rng)])
        assert values.min() >= 0.0
        assert values.max() <= 1.0
