"""Blotches on plain surfaces go; shading, edges and textures stay."""

import numpy as np
import pytest

from panoscene.synth.render._even import even_light

HEIGHT, WIDTH = 128, 256


def room() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return light, albedo and normals of a ceiling over a wall, lit more on the right."""
    albedo = np.full((HEIGHT, WIDTH, 3), 0.7, np.float32)
    normal = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    normal[: HEIGHT // 2, :, 2] = -1
    normal[HEIGHT // 2 :, :, 1] = -1
    light = np.ones((HEIGHT, WIDTH, 3), np.float32)
    light *= (1 + np.sin(np.linspace(0, np.pi, WIDTH)))[None, :, None]
    light[HEIGHT // 2 :] *= 0.4
    return (light * albedo).astype(np.float32), albedo, normal


def blotches() -> np.ndarray:
    """Return factors of light that differ by about 5 percent, and more in colour."""
    rng = np.random.default_rng(0)
    coarse = rng.normal(0, 0.03, (HEIGHT // 16, WIDTH // 16, 1)) + rng.normal(
        0, 0.06, (HEIGHT // 16, WIDTH // 16, 3)
    )
    return np.exp(coarse.repeat(16, axis=0).repeat(16, axis=1)).astype(np.float32)


def test_blotches_go_and_shading_stays() -> None:
    clean, albedo, normal = room()
    spoilt = clean * blotches()
    found = even_light(spoilt, albedo, normal)

    def colour(image: np.ndarray) -> np.ndarray:
        logs = np.log(image / clean)
        return logs - logs.mean(axis=-1, keepdims=True)

    assert colour(found).std() < 0.6 * colour(spoilt).std()
    assert np.log(found / clean).std() < 0.75 * np.log(spoilt / clean).std()
    assert np.abs(np.log(even_light(clean, albedo, normal) / clean)).max() < 0.04


def test_neither_edges_nor_textures_nor_dark_things_change() -> None:
    clean, albedo, normal = room()
    step = even_light(clean, albedo, normal)
    above, below = step[HEIGHT // 2 - 1], step[HEIGHT // 2]
    np.testing.assert_allclose(below / above, 0.4, rtol=0.02)
    rng = np.random.default_rng(1)
    print_ = np.exp(rng.normal(0, 0.3, (HEIGHT, WIDTH, 1))).astype(np.float32)
    detailed = clean * print_
    np.testing.assert_array_equal(even_light(detailed, albedo, normal), detailed)
    dark = np.full_like(albedo, 0.05)
    spoilt = clean * blotches()
    np.testing.assert_array_equal(even_light(spoilt, dark, normal), spoilt)
    nothing = np.zeros_like(normal)
    np.testing.assert_array_equal(even_light(spoilt, albedo, nothing), spoilt)


@pytest.mark.parametrize("shape", [(8, 16), (30, 60)])
def test_any_size_is_taken(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(2)
    image = rng.uniform(0.1, 1.0, (*shape, 3)).astype(np.float32)
    normal = np.zeros_like(image)
    normal[..., 0] = 1
    found = even_light(image, image, normal)
    assert found.shape == image.shape
    assert found.dtype == np.float32
    assert np.isfinite(found).all()
