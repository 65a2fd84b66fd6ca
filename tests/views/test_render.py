"""Rendered rooms: in the right place, the same every time, and never without a picture."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from panoscene.geometry import (
    OrientedBoxes,
    box_corners,
    lonlat_from_direction,
    panorama_directions,
    pixel_from_direction,
    pixel_in_perspective,
)
from panoscene.scene import (
    Layout,
    Mesh,
    Scene,
    Shapes,
    objects_from_boxes,
    scene_from_boxes,
    scene_surfaces,
)
from panoscene.synth import sample_room
from panoscene.views._cameras import FreeCamera, free_lens
from panoscene.views._default_view import default_view
from panoscene.views._model import build_model
from panoscene.views._rays import cast_rays
from panoscene.views._render import render_panorama, render_view

pytestmark = pytest.mark.render

ELL = ((-2.0, -2.0), (4.0, -2.0), (4.0, 1.0), (1.0, 1.0), (1.0, 5.0), (-2.0, 5.0))
PLAIN: dict[str, Any] = {"occlusion": False, "lines": False}


def room(*boxes: tuple[tuple[float, ...], tuple[float, ...], float], category: str = "sofa",
         polygon: tuple[tuple[float, float], ...] = ELL) -> Scene:  # fmt: skip
    centre = torch.tensor([box[0] for box in boxes]).reshape(-1, 3)
    size = torch.tensor([box[1] for box in boxes]).reshape(-1, 3)
    stack = OrientedBoxes(centre, size, torch.tensor([box[2] for box in boxes]).reshape(-1))
    objects = objects_from_boxes(stack, [category] * len(boxes))
    return scene_from_boxes(objects, Layout(torch.tensor(polygon)))


SOFA = ((-0.3, 2.5, 0.4), (1.8, 0.9, 0.8), 2.6)


def coloured(image: torch.Tensor) -> torch.Tensor:
    """Return the pixels that are not grey, as the room is."""
    return image.amax(0) - image.amin(0) > 0.12


def test_a_box_is_where_the_panorama_convention_puts_it() -> None:
    scene = room(SOFA)
    image = render_panorama(scene, height=256, **PLAIN)
    assert image.shape == (3, 256, 512)
    corners = box_corners(scene.objects.boxes)[0] - torch.tensor([0.0, 0.0, 1.6])
    uv = pixel_from_direction(corners, 256, 512)
    v, u = coloured(image).nonzero().unbind(-1)
    # vertical edges are straight lines in an equirectangular picture
    assert abs(float(u.min()) - float(uv[:, 0].min())) <= 1
    assert abs(float(u.max()) + 1 - float(uv[:, 0].max())) <= 1
    assert abs(float(v.max()) + 1 - float(uv[:, 1].max())) <= 1


def test_a_box_is_where_a_pinhole_camera_puts_it() -> None:
    scene = room(SOFA, polygon=((-2.0, -2.0), (4.0, -2.0), (4.0, 5.0), (-2.0, 5.0)))
    eye, target = (3.2, -1.5, 2.1), (-0.2, 2.2, 0.5)
    camera = FreeCamera(eye, target, fov_deg=50.0)
    image = render_view(scene, camera, size_px=(320, 200), **PLAIN)
    ahead = torch.tensor(target) - torch.tensor(eye)
    height = 2 * math.atan(math.tan(math.radians(25.0)) * 200 / 320)
    bfov = torch.cat([lonlat_from_direction(ahead), torch.tensor([math.radians(50.0), height])])
    corners = box_corners(scene.objects.boxes)[0] - torch.tensor(eye)
    uv, inside = pixel_in_perspective(corners, bfov, (200, 320))
    assert inside.all()
    v, u = coloured(image).nonzero().unbind(-1)
    found = [float(x) for x in (u.min(), v.min(), u.max() + 1, v.max() + 1)]
    expected = [*uv.amin(0).tolist(), *uv.amax(0).tolist()]
    assert np.abs(np.array(found) - expected).max() <= 1


def test_wall_corners_are_drawn_where_they_are() -> None:
    image = render_panorama(room(), height=256, occlusion=False).mean(0)
    row = image[128]
    for x, y in ELL:
        if (x, y) == (4.0, 1.0):
            continue  # behind the corner that juts out
        corner = pixel_from_direction(torch.tensor([x, y, 0.0]), 256, 512)
        near = (torch.arange(-4, 5) + int(corner[0])) % 512
        darkest = near[row[near].argmin()] + 0.5
        assert abs(float(darkest - corner[0])) <= 1
        assert row[near].min() < row[near].median() - 0.05


def test_the_seam_does_not_show() -> None:
    image = render_panorama(room(((0.0, -1.5, 1.2), (3.0, 0.4, 2.4), 0.0)), height=128)
    middle = image[:, 50:80]
    assert coloured(middle)[:, [0, -1]].all()
    assert (middle[:, :, 0] - middle[:, :, -1]).abs().max() < 0.02


@pytest.mark.parametrize("occlusion", [False, True])
def test_pictures_are_the_same_every_time(occlusion: bool) -> None:
    scene = sample_room(np.random.default_rng(3), objects=12)
    first = render_panorama(scene, height=64, occlusion=occlusion)
    assert torch.equal(first, render_panorama(scene, height=64, occlusion=occlusion))
    camera = default_view(scene)
    one, two = (render_view(scene, camera, size_px=(90, 70)) for _ in range(2))
    assert torch.equal(one, two)
    for image in (first, one):
        assert torch.isfinite(image).all()
        assert image.min() >= 0
        assert image.max() <= 1
        assert image.std() > 0.03


@pytest.mark.parametrize("size", [(1, 1), (2, 1), (1, 7), (33, 17), (101, 3)])
def test_any_size_is_possible(size: tuple[int, int]) -> None:
    scene = room(SOFA)
    assert render_view(scene, default_view(scene, size_px=size), size_px=size).shape == (
        3,
        *size[::-1],
    )
    for height in (1, 2, 13):
        assert render_panorama(scene, height=height).shape == (3, height, 2 * height)


def test_no_pixels_are_refused() -> None:
    with pytest.raises(ValueError, match="height"):
        render_panorama(room(), height=0)
    with pytest.raises(ValueError, match="size_px"):
        render_view(room(), FreeCamera((0.0, 0.0, 1.0), (0.0, 1.0, 1.0)), size_px=(0, 5))


def test_an_empty_room_is_grey() -> None:
    scene = room()
    assert not coloured(render_panorama(scene, height=48)).any()
    assert not coloured(render_view(scene, default_view(scene), size_px=(80, 60))).any()


def test_boxes_around_the_camera_do_not_hide_the_room() -> None:
    around = ((0.1, 0.0, 1.3), (1.0, 1.2, 2.0), 0.3)
    image = render_panorama(room(SOFA, around), height=64)
    assert torch.equal(image, render_panorama(room(SOFA), height=64))


def test_occlusion_darkens_where_things_meet() -> None:
    scene = room(((0.0, 3.0, 0.5), (1.0, 1.0, 1.0), 0.0))
    dark = render_panorama(scene, height=256, lines=False)
    light = render_panorama(scene, height=256, **PLAIN)
    assert (dark <= light + 1e-6).all()
    ratio = (dark / light).mean(0)
    camera = torch.tensor([0.0, 0.0, 1.6])
    places = torch.tensor([[0.0, 2.42, 0.0], [-0.5, -0.8, 0.0]])
    (u, v), (x, y) = pixel_from_direction(places - camera, 256, 512).long().tolist()
    assert ratio[v, u] < 0.88
    assert ratio[y, x] > 0.95


def test_the_photo_is_on_the_shell_and_nowhere_else() -> None:
    scene = room(SOFA)
    wave = panorama_directions(128, 256, like=torch.zeros(()))
    photo = 0.5 + 0.3 * wave.movedim(-1, 0)
    image = render_panorama(scene, height=128, image=photo, **PLAIN)
    eye = torch.tensor([0.0, 0.0, 1.6])
    sofa = len(scene_surfaces(scene)) - 1
    seen = (cast_rays(scene, eye, wave).surface == sofa).float()
    near = torch.nn.functional.max_pool2d(seen[None], 3, stride=1, padding=1)[0]
    difference = (image - photo).abs().amax(0)
    assert difference[near == 0].max() < 5e-3
    assert difference[seen == 1].median() > 0.05
    # from elsewhere the same place of the room has the same colour
    place = torch.tensor([1.0, 4.0, 1.0])
    view = render_view(scene, FreeCamera((-1.5, -1.0, 2.0), tuple(place.tolist()), 40.0),
                       size_px=(65, 65), image=photo, **PLAIN)  # fmt: skip
    direction = place - torch.tensor([0.0, 0.0, 1.6])
    expected = 0.5 + 0.3 * direction / direction.norm()
    assert (view[:, 32, 32] - expected).abs().max() < 5e-3


def test_fronts_differ_from_backs() -> None:
    box = ((-0.5, 3.0, 0.6), (1.0, 0.8, 1.2))
    camera = FreeCamera((-0.5, 0.0, 1.6), (-0.5, 3.0, 0.6), 30.0)
    faces = [
        render_view(room((*box, yaw)), camera, size_px=(64, 64), **PLAIN)[:, 34:50, 26:38]
        for yaw in (0.0, math.pi)
    ]
    assert faces[1].mean() < faces[0].mean() - 0.05


def test_shapes_replace_boxes() -> None:
    scene = room(SOFA)
    low = Mesh(
        torch.tensor([[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], [0.5, 0.5, -0.5], [-0.5, 0.5, -0.5]]),
        torch.tensor([[0, 1, 2], [0, 2, 3]]),
    )
    flat = replace(scene, objects=replace(scene.objects, shapes=Shapes(mesh=(low,))))
    areas = [coloured(render_panorama(s, height=64, **PLAIN)).sum() for s in (scene, flat)]
    assert 0 < areas[1] < areas[0]


def test_a_camera_outside_looks_into_the_room() -> None:
    scene = room(SOFA)
    camera = default_view(scene, size_px=(120, 90))
    lens = free_lens(camera, (120, 90))
    corners = torch.cat([
        torch.cat([scene.layout.floor_polygon, torch.full((6, 1), z)], 1) for z in (0.0, 2.6)
    ])  # fmt: skip
    uv, ahead = lens.pixels(corners.double().numpy())
    assert (ahead > 0).all()
    assert (uv > 0).all()
    assert (uv < [120, 90]).all()
    low, high = uv.min(0), uv.max(0)
    # the room fills one of the two sides, and lies in the middle
    assert ((high - low) / [120, 90]).max() > 0.85
    assert np.abs((low + high) / 2 - [60, 45]).max() < 3
    assert coloured(render_view(scene, camera, size_px=(120, 90))).any()


def test_doors_leave_with_their_wall() -> None:
    scene = room(((-0.5, 4.97, 1.0), (0.9, 0.06, 2.0), math.pi), category="door")
    for y, expected in ((-20.0, {0}), (20.0, set())):
        eye = np.array([0.0, y, 12.0])
        assert set(build_model(scene, eye, cut=True).item.tolist()) - {-1} == expected


def test_straight_down_is_north_up() -> None:
    scene = room(SOFA)
    image = render_view(scene, FreeCamera((1.0, 1.5, 30.0), (1.0, 1.5, 0.0), 20.0),
                        size_px=(90, 90), **PLAIN)  # fmt: skip
    v, u = coloured(image).double().nonzero().double().mean(0).tolist()
    assert u < 45
    assert v < 45


@pytest.mark.parametrize(
    ("eye", "target", "fov_deg", "word"),
    [
        ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 40.0, "eye and target"),
        ((math.nan, 0.0, 1.0), (0.0, 0.0, 1.0), 40.0, "eye and target"),
        ((0.0, 0.0, 1.0), (0.0, 1.0, 1.0), 0.0, "fov_deg"),
        ((0.0, 0.0, 1.0), (0.0, 1.0, 1.0), 170.0, "fov_deg"),
    ],
)
def test_impossible_cameras_are_refused(
    eye: tuple[float, float, float],
    target: tuple[float, float, float],
    fov_deg: float,
    word: str,
) -> None:
    with pytest.raises(ValueError, match=word):
        FreeCamera(eye, target, fov_deg)


def test_a_view_from_below_the_horizon_is_refused_only_when_impossible() -> None:
    with pytest.raises(ValueError, match="look_down_deg"):
        default_view(room(), look_down_deg=91.0)
