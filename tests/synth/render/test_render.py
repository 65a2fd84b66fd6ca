"""Pictures and labels of the small home, against geometry computed another way."""

import dataclasses
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import trimesh

from panoscene.synth.render import (
    Camera,
    LightSetting,
    LitScene,
    MissingRendererError,
    Renderer,
    RenderScene,
    home_from_camera,
    pixel_rays,
    sample_light,
)
from panoscene.synth.render._lamps import LUMINANCE, lamps_of
from panoscene.synth.render._tracer import Tracer

pytestmark = pytest.mark.render
# pictures of one size and number of samples share their machine code, which takes seconds to make
SAMPLES = 4
CAMERA = Camera((3.2, 1.6, 1.6), 0.3, width=128, height=64)
TILTED = Camera((4.2, 1.3, 1.5), -1.2, 0.06, -0.04, width=128, height=64)


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    try:
        return Renderer(1)
    except MissingRendererError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def lit(renderer: Renderer, scene: RenderScene) -> LitScene:
    return _lit(renderer, scene, sample_light(np.random.default_rng(0), scene, "sunny"))


@pytest.fixture(scope="module")
def day(lit: LitScene):
    return lit.photograph(CAMERA, 0, samples=SAMPLES)


def _lit(renderer: Renderer, scene: RenderScene, light: LightSetting) -> LitScene:
    return renderer.light_up(scene, light, outside_width=128)


def _soup(scene: RenderScene) -> tuple[trimesh.Trimesh, np.ndarray]:
    """Return all that is labelled as one mesh, with the instance of every triangle."""
    meshes, ids = [], []
    for part in scene.parts:
        meshes.append(trimesh.Trimesh(part.vertices, part.faces, process=False))
        ids += [part.instance] * len(part.faces)
    for placed in scene.placed:
        matrix = placed.world_from_object
        vertices = placed.model.vertices @ matrix[:3, :3].T + matrix[:3, 3]
        meshes.append(trimesh.Trimesh(vertices, placed.model.faces, process=False))
        ids += [placed.instance] * len(placed.model.faces)
    for pane in scene.panes:
        c, u, v = (np.array(a) for a in (pane.centre, pane.half_u, pane.half_v))
        corners = np.array([c - u - v, c + u - v, c + u + v, c - u + v])
        meshes.append(trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False))
        ids += [pane.instance] * 2
    soup = trimesh.util.concatenate(meshes)
    assert isinstance(soup, trimesh.Trimesh)
    return soup, np.array(ids)


@pytest.mark.parametrize("camera", [CAMERA, TILTED])
def test_labels_equal_an_independent_cast(lit: LitScene, scene: RenderScene, camera: Camera):
    mesh, ids = _soup(scene)
    picture = lit.photograph(camera, 0, samples=SAMPLES, depth=1)
    rays = pixel_rays(camera).reshape(-1, 3)
    origins = np.broadcast_to(camera.position, rays.shape)
    places, which, faces = mesh.ray.intersects_location(origins, rays, multiple_hits=False)
    distance = np.zeros(len(rays))
    distance[which] = np.linalg.norm(places - camera.position, axis=1)
    instance = np.zeros(len(rays), int)
    instance[which] = ids[faces]
    assert (instance > 0).all()
    found = picture.instance.reshape(-1)
    same = found == instance
    assert same.mean() > 0.998  # rays along a shared edge may take either side
    assert np.abs(picture.distance.reshape(-1) - distance)[same].max() < 2e-4
    normals = mesh.face_normals[faces[np.argsort(which)]]
    turned = picture.normal.reshape(-1, 3) @ home_from_camera(camera).T
    off = np.abs(np.abs((normals * turned).sum(axis=1)) - 1)
    assert off[same & (instance != scene.placed[-1].instance)].max() < 1e-3  # the globe is smooth


def test_walls_have_their_analytic_distance(day, scene: RenderScene):
    rays = pixel_rays(CAMERA)
    kinds = {part.instance: (part.kind, part.room, part.index) for part in scene.parts}
    x, y, z = CAMERA.position
    checked = 0
    for axis, sign, plane, name in (
        (2, -1, z, ("floor", 0, 0)), (2, 1, 2.6 - z, ("ceiling", 0, 0)),
        (1, -1, y, ("wall", 0, 0)), (0, 1, 5 - x, ("wall", 0, 1)),
        (1, 1, 4 - y, ("wall", 0, 2)), (0, -1, x, ("wall", 0, 3)),
    ):  # fmt: skip
        number = next(k for k, v in kinds.items() if v == name)
        mask = day.instance == number
        expected = plane / (sign * rays[mask][:, axis])
        np.testing.assert_allclose(day.distance[mask], expected, rtol=1e-5)
        checked += int(mask.sum())
    assert checked > 0.6 * day.instance.size


def test_normals_face_the_camera_and_labels_have_no_holes(day):
    local = pixel_rays(dataclasses.replace(CAMERA, yaw=0.0))
    assert ((local * day.normal).sum(axis=-1) <= 1e-6).all()
    np.testing.assert_allclose(np.linalg.norm(day.normal, axis=-1), 1, atol=1e-5)
    assert (day.instance > 0).all()
    assert (day.distance > 0.3).all()


def test_windows_and_mirrors_are_labelled_at_their_own_distance(day, scene: RenderScene):
    rays = pixel_rays(CAMERA)
    pane = next(p for p in scene.panes if p.room == 0)
    mask = day.instance == pane.instance
    assert mask.sum() > 20
    seen = rays[mask] * day.distance[mask][:, None] + CAMERA.position
    on_pane = np.abs(seen[:, 1] - pane.centre[1]) < 0.031  # the frame's bars are 3 cm before it
    assert on_pane.all()
    mirror = next(p for p in scene.placed if p.model.base == "mirror")
    mask = day.instance == mirror.instance
    assert mask.sum() > 10
    seen = rays[mask] * day.distance[mask][:, None] + CAMERA.position
    np.testing.assert_allclose(seen[:, 0], 0.04, atol=2e-3)
    # what it shows is the room: neither black nor white
    assert 15 < day.rgb[mask].mean() < 240


def test_one_seed_gives_one_picture(lit: LitScene, day):
    again, other = (
        lit.photograph(CAMERA, 0, samples=SAMPLES),
        lit.photograph(CAMERA, 1, samples=SAMPLES),
    )
    assert np.array_equal(again.rgb, day.rgb)
    assert np.array_equal(again.radiance, day.radiance)
    assert np.array_equal(again.instance, day.instance)
    assert np.array_equal(other.instance, day.instance)
    assert not np.array_equal(other.radiance, day.radiance)


def test_a_second_light_that_shares_the_scene_gives_the_same_picture(
    renderer: Renderer, scene: RenderScene, lit: LitScene
):
    night = sample_light(np.random.default_rng(5), scene, "night")
    alone = renderer.light_up(scene, night, outside_width=128)
    shared = renderer.light_up(scene, night, outside_width=128, like=lit)
    one, two = (place.photograph(CAMERA, 3, samples=SAMPLES, depth=3) for place in (alone, shared))
    assert np.array_equal(one.rgb, two.rgb)
    assert np.array_equal(one.distance, two.distance)


def test_a_light_is_shared_within_one_scene_only(
    renderer: Renderer, scene: RenderScene, lit: LitScene
):
    light = sample_light(np.random.default_rng(5), scene, "night")
    with pytest.raises(ValueError, match="another scene"):
        renderer.light_up(dataclasses.replace(scene), light, outside_width=128, like=lit)


def test_the_largest_seed_is_one(lit: LitScene):
    """Seeds of recipes fill 32 bits."""
    picture = lit.photograph(CAMERA, 2**32 - 1, samples=SAMPLES, depth=1)
    assert picture.rgb.shape == (64, 128, 3)


def test_the_seam_is_continuous(day):
    image = day.radiance.astype(float)
    image = np.log(image.clip(1e-4)).mean(axis=-1)
    steps = np.abs(np.diff(image, axis=1)).mean()
    seam = np.abs(image[:, 0] - image[:, -1]).mean()
    assert seam < 2 * steps + 0.02


def test_light_setting_and_exposure(renderer: Renderer, scene: RenderScene, day):
    night = sample_light(np.random.default_rng(1), scene, "night")
    dark = _lit(renderer, scene, night).photograph(CAMERA, 0, samples=SAMPLES)
    for picture in (day, dark):
        grey = picture.rgb.mean(axis=-1)
        assert 60 < grey.mean() < 185
        assert (grey > 250).mean() < 0.08
        assert (grey < 4).mean() < 0.05
    # a lamp-lit room is far darker than a day-lit one, and the outside darker than the inside
    middle = slice(16, 48)
    assert np.median(dark.radiance[middle]) < 0.5 * np.median(day.radiance[middle])
    pane = next(p for p in scene.panes if p.room == 0).instance
    assert np.median(dark.radiance[dark.instance == pane]) < np.median(dark.radiance[middle])
    assert np.median(day.radiance[day.instance == pane]) > np.median(day.radiance[middle])


def test_no_light_leaks_into_a_closed_room(renderer: Renderer, scene: RenderScene):
    """Without lamps, the sun and the sky outside must not be seen through any joint."""
    unlit = [
        dataclasses.replace(p, model=dataclasses.replace(p.model, lights=())) for p in scene.placed
    ]
    unlit = [p for p in unlit if not any(m.kind == "light" for m in p.model.materials)]
    light = sample_light(np.random.default_rng(0), scene, "sunny")
    closed = dataclasses.replace(scene, placed=tuple(unlit), panes=())
    picture = _lit(renderer, closed, light).photograph(CAMERA, 0, samples=SAMPLES)
    assert picture.radiance.max() < 1e-6
    # with the windows back it is light
    lit = dataclasses.replace(closed, panes=scene.panes)
    picture = _lit(renderer, lit, light).photograph(CAMERA, 0, samples=SAMPLES)
    assert picture.radiance.mean() > 0.01


def test_light_in_a_closed_box_keeps_its_energy(renderer: Renderer, closed_box):
    """All light that a lamp sends out is absorbed: irradiance = flux / area / (1 - albedo)."""
    albedo = 0.5
    box = closed_box(albedo)
    light = sample_light(np.random.default_rng(0), kind="night")
    camera = Camera((1.0, 1.2, 1.6), width=128, height=64)
    picture = _lit(renderer, box, light).photograph(camera, 0, samples=8, depth=20)
    rays = pixel_rays(camera)
    to_bulb = np.array([1.0, 0.8, -0.1])
    walls = rays @ to_bulb / np.linalg.norm(to_bulb) < 0.97  # without its halo
    lat = np.pi * (0.5 - (np.arange(64) + 0.5) / 64)
    facing = np.abs((rays * picture.normal).sum(axis=-1))
    area = np.cos(lat)[:, None] * picture.distance**2 / facing * walls
    irradiance = (picture.radiance @ LUMINANCE) * np.pi / albedo
    mean = (irradiance * area).sum() / area.sum()
    flux = lamps_of(box, light).flux.sum() / 1000
    assert mean == pytest.approx(flux / (2 * 16 + 4 * 12) / (1 - albedo), rel=0.03)


def test_rays_that_are_nowhere_read_the_table_of_rooms_where_it_is(renderer: Renderer) -> None:
    mi, dr = renderer._engine.mi, renderer._engine.dr
    rooms = np.arange(100, 112, dtype=np.uint32)  # four columns, three rows
    tracer = SimpleNamespace(
        engine=renderer._engine,
        columns=dr.opaque(mi.UInt32, 4),
        rows=dr.opaque(mi.UInt32, 3),
        origin=[dr.opaque(mi.Float, -1.0), dr.opaque(mi.Float, -1.0)],
        per_metre=2.0,
        cells=mi.UInt32(rooms),
    )
    nan, far = float("nan"), 1e30
    place = mi.Point3f([0.2, nan, 0.2, nan, far, -far], [0.2, 0.2, nan, nan, far, -far], [0] * 6)
    found = np.array(Tracer._room_of(cast("Tracer", tracer), place))
    assert found[[0, 4, 5]].tolist() == [110, 111, 100]
    assert np.isin(found, rooms).all()
