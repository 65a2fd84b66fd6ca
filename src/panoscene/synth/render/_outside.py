"""What is seen out of the windows: sky, clouds, trees, houses and the ground, made from noise."""

from dataclasses import dataclass

import numpy as np
import scipy.ndimage
from jaxtyping import Float, Float32

from panoscene.synth.render._lamps import LUMINANCE
from panoscene.synth.render._light_choice import sun_direction
from panoscene.synth.render._records import LightSetting

_TILE = 512
SKY_CELLS = 64
"""Cells along an edge of the map of the outside as light."""


@dataclass(slots=True)
class _Canvas:
    """The picture in the making and what its painters share."""

    picture: Float32[np.ndarray, "height width 3"]
    lon: Float32[np.ndarray, "height width"]
    lat: Float32[np.ndarray, "height width"]
    haze: Float32[np.ndarray, "width 3"]
    """Light of the sky at the horizon."""
    eye: float
    """Metres of the camera above the ground outside."""
    noise: Float32[np.ndarray, "n n"]
    rng: np.random.Generator

    def rows(self, low: float, high: float) -> slice:
        """Return the rows of the picture between two latitudes."""
        height = len(self.lat)
        first, last = (int((0.5 - lat / np.pi) * height) for lat in (high, low))
        return slice(max(first - 1, 0), min(last + 2, height))


def outside_picture(
    light: LightSetting, width: int = 1536
) -> Float32[np.ndarray, "height width 3"]:
    """Return the outside as a panorama in the home's frame, linear, in 1000 cd/m2.

    Its centre column looks along the home's +y. The view is from a random storey on a street, a
    garden, a field, a wood's edge or a city. The sun's disc is not in it.
    """
    rng = np.random.default_rng([light.seed, 2])
    height = width // 2
    lon = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    lat = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    lon, lat = np.meshgrid(lon.astype(np.float32), lat.astype(np.float32))
    noise = _fractal(rng)
    place = str(rng.choice(["garden", "street", "field", "city"], p=[0.3, 0.35, 0.15, 0.2]))
    eye = 1.6 + 2.9 * int(rng.integers(0, {"city": 9, "street": 5}.get(place, 2)))
    half = height // 2
    picture = np.zeros((height, width, 3), np.float32)
    picture[:half] = _sky(lon[:half], lat[:half], light, noise, rng)
    picture[:half] *= np.float32(
        light.sky_radiance / max(float((picture[:half] @ LUMINANCE).mean()), 1e-9)
    )
    day = light.kind in ("sunny", "overcast")
    sun = np.zeros(3) if light.sun_irradiance is None else np.array(light.sun_irradiance)
    over = picture[:half].mean(axis=(0, 1))
    flat = (over * np.pi + sun * np.sin(light.sun_elevation)) / np.pi
    upright = (over * np.pi * 0.55 + sun * 0.45) / np.pi
    haze = picture[half - 4].copy()
    canvas = _Canvas(picture, lon, lat, haze, eye, noise, rng)
    _ground(canvas, flat, place)
    _trees(canvas, upright, rng.uniform(180, 400), 22.0)
    if place in ("street", "city"):
        _houses(canvas, upright, day, place)
    for _ in range(int(rng.integers(0, 3))):
        _trees(canvas, upright, rng.uniform(14, 60), rng.uniform(4, 11), rng.uniform(0.3, 0.7))
    if not day:
        _street_lamps(canvas)
    return np.ascontiguousarray(picture, dtype=np.float32)


def _fractal(rng: np.random.Generator) -> Float32[np.ndarray, "n n"]:
    """Return a square of noise that repeats, of mean 0 and deviation 1."""
    white = np.fft.rfft2(rng.standard_normal((_TILE, _TILE)))
    fy, fx = np.fft.fftfreq(_TILE)[:, None], np.fft.rfftfreq(_TILE)[None]
    size = np.hypot(fx, fy)
    size[0, 0] = 1.0
    field = np.fft.irfft2(white * size**-1.6, s=(_TILE, _TILE))
    return ((field - field.mean()) / field.std()).astype(np.float32)


def _look(noise: np.ndarray, x: np.ndarray, y: np.ndarray) -> Float32[np.ndarray, "..."]:
    """Return the noise at places given in tiles."""
    return scipy.ndimage.map_coordinates(
        noise, [np.mod(y, 1.0) * _TILE, np.mod(x, 1.0) * _TILE], order=1, mode="grid-wrap"
    )


_SKIES = {
    "sunny": ((0.16, 0.33, 0.85), (0.62, 0.78, 1.0)),
    "overcast": ((0.75, 0.8, 0.88), (0.9, 0.92, 0.95)),
    "dusk": ((0.10, 0.16, 0.45), (1.0, 0.62, 0.42)),
    "night": ((0.35, 0.4, 0.62), (0.9, 0.72, 0.55)),
}
"""Linear colours of the zenith and the horizon."""


def _sky(lon, lat, light, noise, rng) -> Float32[np.ndarray, "height width 3"]:
    """Return the sky with clouds; the latitudes are those of its upper half."""
    zenith, horizon = (np.array(c, np.float32) for c in _SKIES[light.kind])
    up = np.clip(np.sin(lat), 0, 1)[..., None]
    picture = horizon + (zenith - horizon) * up ** np.float32(rng.uniform(0.35, 0.6))
    to_sun = sun_direction(light)
    way = np.stack([np.cos(lat) * np.sin(lon), np.cos(lat) * np.cos(lon), np.sin(lat)], axis=-1)
    near = np.clip(way @ to_sun.astype(np.float32), 0, 1)
    if light.kind in ("sunny", "dusk"):
        glow = (
            np.array([1.0, 0.85, 0.6], np.float32)
            if light.kind == "sunny"
            else np.array([1.2, 0.5, 0.2], np.float32)
        )
        picture = picture + glow * (0.8 * near**8 + 1.2 * near**90)[..., None]
    deck = np.maximum(way[..., 2], 0.0) + 0.08
    shift = rng.random(2)
    x, y = 0.05 * way[..., 0] / deck + shift[0], 0.05 * way[..., 1] / deck + shift[1]
    cloud = _look(noise, x, y) + 0.35 * _look(noise, 4.1 * x, 4.1 * y)
    level = {"sunny": rng.uniform(0.4, 1.8), "overcast": -1.0}.get(light.kind, rng.uniform(0, 1.5))
    cover = 1 / (1 + np.exp(-4.0 * (cloud - level))) * np.clip(8 * way[..., 2], 0, 1)
    tone = {"sunny": 1.5, "overcast": 0.8, "dusk": 0.5, "night": 0.6}[light.kind]
    body = (
        np.array([1.0, 0.98, 0.96], np.float32)
        if light.kind != "dusk"
        else np.array([1.0, 0.55, 0.45], np.float32)
    )
    lit = tone * (1 - 0.28 * np.clip(cloud - level, 0, 2))[..., None] * body
    return (picture + (lit - picture) * 0.85 * cover[..., None]).astype(np.float32)


def _ground(canvas: _Canvas, light: Float[np.ndarray, "3"], place: str) -> None:
    """Draw grass, paving or a road on everything below the horizon, in place."""
    picture, rng, noise, eye = canvas.picture, canvas.rng, canvas.noise, canvas.eye
    rows = picture.shape[0] // 2
    lon, lat = canvas.lon[rows:], canvas.lat[rows:]
    far = np.minimum(eye / np.maximum(np.tan(-lat), 1e-4), 4000.0)
    x, y = far * np.sin(lon), far * np.cos(lon)
    rough = 0.5 * _look(noise, x / 60, y / 60) + 0.5 * _look(noise, x / 5, y / 5) * np.exp(
        -far / 60
    )
    grass = (
        np.array([0.075, 0.12, 0.03], np.float32)
        * rng.uniform(0.7, 1.4)
        * rng.uniform(0.85, 1.15, 3)
    )
    paved = np.array([0.2, 0.19, 0.18], np.float32) * rng.uniform(0.7, 1.3)
    base = grass if place in ("garden", "field") else paved
    colour = base * np.clip(1 + 0.3 * rough, 0.3, 2)[..., None]
    if place in ("street", "city"):
        turn = int(rng.integers(0, 2))
        across, along = (x, y) if turn else (y, x)
        offset = rng.uniform(9, 16)
        for side in (-1, 1):
            road = np.abs(across - side * offset) < 3.2
            colour[road] = 0.07 * np.clip(1 + 0.2 * rough[road], 0.5, 1.5)[:, None]
            line = (np.abs(across - side * offset) < 0.08) & (np.mod(along, 9.0) < 4.5)
            colour[line] = 0.5
            lawn = np.abs(across - side * (offset - 5.5)) < 1.4
            colour[lawn] = np.array([0.07, 0.11, 0.03], np.float32)
    fade = np.exp(-far / 500.0)[..., None]
    picture[rows:] = light * colour * fade + 0.8 * canvas.haze * (1 - fade)


def _trees(
    canvas: _Canvas, light: Float[np.ndarray, "3"], far: float, tall: float, gaps: float = 0.0
) -> None:
    """Draw a row of trees at a distance, in place; ``gaps`` of it is open."""
    rng, noise, eye = canvas.rng, canvas.noise, canvas.eye
    band = canvas.rows(np.arctan2(-0.5 - eye, far), np.arctan2(1.6 * tall - eye, far))
    picture, lon, lat = canvas.picture[band], canvas.lon[band], canvas.lat[band]
    shift, seedy = rng.random(2), rng.random()
    turn = lon / (2 * np.pi)
    line = _look(noise, turn * max(round(far / 20), 1) + shift[0], np.full_like(lon, seedy))
    leaf = _look(noise, turn * max(round(6.28 * far / 14), 2), (lat * far) / 14 + shift[1])
    crown = tall * (0.75 + 0.3 * line + 0.12 * leaf)
    if gaps:
        crown = crown - 40.0 * np.clip(gaps - 0.5 - 0.6 * line, 0, 1)
    z = eye + far * np.tan(np.clip(lat, -1.3, 1.3))
    mask = np.clip((crown - z) * 3.0, 0, 1) * (z > -0.3)
    green = np.array([0.04, 0.075, 0.02], np.float32) * rng.uniform(0.7, 1.6, 3).astype(np.float32)
    body = light * green * np.clip(0.9 + 0.45 * leaf + 0.04 * (z - tall / 2), 0.15, 2.2)[..., None]
    fade = np.exp(-far / 600.0)
    body = body * fade + canvas.haze * (1 - fade) * 0.9
    picture += (body - picture) * mask[..., None]


def _houses(canvas: _Canvas, light: Float[np.ndarray, "3"], day: bool, place: str) -> None:
    """Draw rows of houses with windows, from far to near, in place."""
    picture, lon, lat, rng = canvas.picture, canvas.lon, canvas.lat, canvas.rng
    eye, city = canvas.eye, place == "city"
    distances = np.sort(rng.uniform(28 if city else 22, 220 if city else 120, 46))[::-1]
    for far in distances:
        middle, wide = rng.uniform(-np.pi, np.pi), rng.uniform(9, 26)
        tall = rng.uniform(9, 40) if city else rng.uniform(5.5, 11)
        half = np.arctan(wide / 2 / far)
        columns = np.flatnonzero(np.abs(np.angle(np.exp(1j * (lon[0] - middle)))) < half)
        if len(columns) == 0:
            continue
        side = far * np.tan(np.angle(np.exp(1j * (lon[:, columns] - middle))))
        z = eye + far / np.cos(np.arctan(side / far)) * np.tan(np.clip(lat[:, columns], -1.4, 1.4))
        gable = rng.random() < (0.1 if city else 0.7)
        roof = tall + (wide * 0.28 * (1 - np.abs(side) / (wide / 2)) if gable else 0.0)
        wall = np.clip(
            rng.uniform(0.25, 0.75) * rng.uniform(0.85, 1.1, 3) * (1.0, 0.93, 0.82), 0.05, 0.8
        )
        shade = rng.uniform(0.55, 1.0)
        colour = np.broadcast_to(wall * shade, (*z.shape, 3)).copy()
        colour[z > tall] = np.array([0.16, 0.07, 0.05]) * rng.uniform(0.6, 1.5)
        step_x, step_z = rng.uniform(2.2, 3.4), 2.9
        cell_x, cell_z = np.floor(side / step_x), np.floor(z / step_z)
        in_x, in_z = side / step_x - cell_x, z / step_z - cell_z
        glass = (
            (np.abs(in_x - 0.5) < 0.23)
            & (np.abs(in_z - 0.58) < 0.24)
            & (z < tall - 0.4)
            & (z > 0.3)
        )
        luck = np.mod(np.sin(cell_x * 12.99 + cell_z * 78.23 + far) * 43758.5, 1.0)
        image = light * colour
        image[glass] = light * 0.12
        if not day:
            lit = glass & (luck < 0.35)
            warm = np.array([1.0, 0.62, 0.3])
            image[lit] = warm * (0.02 + 0.1 * luck[lit, None])
        inside = (z > 0) & (z < roof)
        block = picture[:, columns]
        block[inside] = image[inside]
        picture[:, columns] = block


def _street_lamps(canvas: _Canvas) -> None:
    """Draw glowing points and their haloes, in place."""
    eye, rng = canvas.eye, canvas.rng
    for _ in range(int(rng.integers(4, 16))):
        far, middle = rng.uniform(15, 90), rng.uniform(-np.pi, np.pi)
        up = np.arctan((5.5 - eye) / far)
        band = canvas.rows(up - 0.2, up + 0.2)
        picture, lon, lat = canvas.picture[band], canvas.lon[band], canvas.lat[band]
        apart2 = (np.angle(np.exp(1j * (lon - middle))) ** 2 + (lat - up) ** 2).astype(np.float32)
        size = 0.2 / far
        warm = np.array([1.0, 0.7, 0.35] if rng.random() < 0.6 else [0.9, 0.95, 1.0], np.float32)
        glow = 0.6 * np.exp(-apart2 / size**2) + 0.004 / (1 + apart2 / (6 * size) ** 2) ** 2
        picture += glow[..., None] * warm


def sky_cells(
    outside: Float32[np.ndarray, "rows columns 3"], cells: int = SKY_CELLS
) -> Float32[np.ndarray, "cells cells 3"]:
    """Return the outside as light: means over the cells of an octahedral map."""
    fine = cells * 4
    x, y = np.meshgrid(*2 * [(np.arange(fine) + 0.5) / fine * 2 - 1])
    z = 1 - np.abs(x) - np.abs(y)
    fold_x, fold_y = (1 - np.abs(y)) * np.sign(x), (1 - np.abs(x)) * np.sign(y)
    x, y = np.where(z < 0, fold_x, x), np.where(z < 0, fold_y, y)
    rows, columns = outside.shape[:2]
    lat = np.arcsin(z / np.sqrt(x * x + y * y + z * z))
    row = np.clip((0.5 - lat / np.pi) * rows, 0, rows - 1).astype(int)
    column = np.clip((np.arctan2(x, y) / (2 * np.pi) + 0.5) * columns, 0, columns - 1).astype(int)
    values = outside[row, column]
    # light from below is less green than it looks: real lawns have paths, houses and shade
    grey = values.mean(axis=-1, keepdims=True)
    values = np.where(z[..., None] < 0, grey + 0.5 * (values - grey), values)
    values = values.reshape(cells, 4, cells, 4, 3)
    return np.ascontiguousarray(values.mean(axis=(1, 3)), dtype=np.float32)
