"""Lamps, the outside, the choice of lights and the development of pictures; numpy only."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from panoscene.synth.assets import LightSource, Material
from panoscene.synth.models import make_model
from panoscene.synth.render import (
    LIGHT_SHARES,
    LightKind,
    RenderScene,
    colour_of_kelvin,
    sample_light,
)
from panoscene.synth.render._develop import develop, tone_curve, wrap_pad
from panoscene.synth.render._lamps import LUMINANCE, _within, lamps_of
from panoscene.synth.render._light_choice import alias_table, light_choice, room_grid
from panoscene.synth.render._outside import outside_picture, sky_cells
from panoscene.synth.render._paint import pack_paints


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_the_alias_table_has_the_right_chances(weights: list[float]):
    chance = np.array(weights) + 1e-3
    chance /= chance.sum()
    accept, alias = alias_table(chance)
    found = accept / len(chance)
    np.add.at(found, alias, (1 - accept) / len(chance))
    np.testing.assert_allclose(found, chance, atol=1e-9)


def test_every_room_asks_its_own_lights_most(scene: RenderScene):
    light = sample_light(np.random.default_rng(0), scene, "night")
    lamps = lamps_of(scene, light)
    assert (lamps.flux > 0).any()
    choice = light_choice(scene, lamps, light)
    np.testing.assert_allclose(choice.chance.sum(axis=1), 1)
    rooms = np.concatenate([[p.room for p in scene.panes], lamps.room[lamps.flux > 0]])
    for room in range(2):
        assert choice.chance[room, rooms == room].sum() > 0.6


def test_the_room_grid_knows_rooms_and_walls(scene: RenderScene):
    grid = room_grid(scene)

    def at(x: float, y: float) -> int:
        column, row = (int((a - o) / grid.cell) for a, o in zip((x, y), grid.origin, strict=True))
        return int(grid.cells[row, column])

    assert (at(1, 1), at(7, 3), at(4.98, 2), at(5.1, 2)) == (0, 1, 0, 1)
    assert at(2, 4.2) == 0  # inside the outer wall


@pytest.mark.parametrize("kind", list(LIGHT_SHARES))
def test_the_outside_is_as_bright_as_it_should_be(kind: LightKind):
    light = sample_light(np.random.default_rng(3), kind=kind)
    picture = outside_picture(light, 256)
    assert picture.shape == (128, 256, 3)
    assert np.isfinite(picture).all()
    assert (picture >= 0).all()
    if kind in ("sunny", "overcast"):
        sky = float((picture[:64] @ LUMINANCE).mean())
        assert 0.4 * light.sky_radiance < sky < 1.2 * light.sky_radiance  # houses and trees
    assert (light.sun_irradiance is not None) == (kind == "sunny")
    assert np.array_equal(picture, outside_picture(light, 256))
    # no step where the panorama closes
    step = np.abs(np.diff(picture, axis=1)).mean()
    assert np.abs(picture[:, 0] - picture[:, -1]).mean() < 4 * step + 1e-6


def test_sky_cells_look_where_the_directions_point():
    picture = np.zeros((64, 128, 3), np.float32)
    picture[:32, 64:] = 1.0  # the upper right: x > 0, z > 0
    cells = sky_cells(picture)
    assert cells[32, 63 - 8].mean() > 0.99
    assert cells[32, 8].mean() == 0.0
    assert cells[0, 0].mean() == 0.0  # straight down


def test_lamps_get_bluer_as_they_get_hotter():
    colours = colour_of_kelvin(np.array([2000.0, 2700.0, 4000.0, 6500.0, 10000.0]))
    ratio = colours[:, 2] / colours[:, 0]
    assert (np.diff(ratio) > 0).all()
    np.testing.assert_allclose(colours @ LUMINANCE, 1)
    np.testing.assert_allclose(colours[3], 1, atol=0.08)


def test_rooms_without_daylight_have_a_lamp_on(scene: RenderScene):
    for seed in range(20):
        lamps = lamps_of(scene, sample_light(np.random.default_rng(seed), scene, "night"))
        assert {0, 1} == set(lamps.room[lamps.flux > 0].tolist())


def test_exposure_does_not_depend_on_the_brightness_of_a_scene():
    rng = np.random.default_rng(0)
    light = sample_light(rng, kind="overcast")
    albedo = rng.uniform(0.2, 0.9, (64, 128, 3)).astype(np.float32)
    bright = albedo * np.float32(3.0)
    one, two = develop(bright, albedo, light), develop(bright * np.float32(0.1), albedo, light)
    assert np.abs(one.astype(int) - two).max() <= 1
    assert 60 < one.mean() < 190


def test_white_balance_takes_most_of_a_cast_away():
    rng = np.random.default_rng(0)
    light = sample_light(rng, kind="night")
    albedo = np.full((64, 128, 3), 0.5, np.float32)
    orange = albedo * colour_of_kelvin(np.array([2700.0]))[0].astype(np.float32)
    cast = tone_curve(orange).mean(axis=(0, 1))
    found = develop(orange, albedo, light).mean(axis=(0, 1))
    assert np.ptp(found) < 0.6 * np.ptp(cast)


@given(st.floats(1e-4, 100.0), st.floats(1.01, 3.0))
def test_the_tone_curve_rises(light: float, factor: float):
    low, high = (tone_curve(np.full((1, 3), a, np.float32)) for a in (light, light * factor))
    assert (high >= low).all()


def test_padding_continues_the_sphere():
    lon, lat = np.meshgrid(np.arange(32), np.arange(16))
    image = np.stack([lon, lat], axis=-1).astype(np.float32)
    padded = wrap_pad(image, 4)
    assert padded.shape == (24, 40, 2)
    np.testing.assert_array_equal(padded[4:-4, 4:-4], image)
    np.testing.assert_array_equal(padded[10, 0], (28, 6))
    np.testing.assert_array_equal(padded[3, 4], (16, 0))  # over the pole: the opposite meridian


def test_paints_keep_colour_texture_and_flags():
    texture = np.zeros((2, 4, 3), np.uint8)
    texture[0, 1] = 200, 100, 50
    plain = Material("plain", (1.0, 0.5, 0.0), 0.4)
    materials = [
        plain,
        Material("picture", (1.0, 1.0, 1.0), texture=texture),
        Material("m", kind="mirror"),
    ]
    paints = pack_paints(materials)
    start, width, height = paints.table[1, :3]
    assert (width, height) == (4, 2)
    texel = int(paints.texels[start + 1])
    found = [(texel >> (8 * k)) & 255 for k in range(4)]
    np.testing.assert_allclose(found, (200, 100, 50, 178), atol=1)
    texel = int(paints.texels[paints.table[0, 0]])
    assert (texel >> 24) & 255 == 102
    assert paints.table[:, 6].tolist() == [0, 0, 1]
    assert paints.table[0, 7] == texel  # the mean of one texel


def test_bulbs_are_inside_their_lamps() -> None:
    lamp = make_model("floor_lamp", 0, 0)
    top = lamp.size[2] / 2
    for height, found in ((top + 0.06, top - 0.05), (top - 0.2, top - 0.2)):
        bulb = LightSource((0.0, 0.0, height), 0.1)
        assert _within(replace(lamp, lights=(bulb,)), bulb) == pytest.approx((0.0, 0.0, found))
