"""What rays hit agrees with formulas that know nothing of triangles."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry import (
    OrientedBoxes,
    bfov_contains,
    bfov_from_boxes,
    object_from_world,
    panorama_directions,
    wall_distance,
)
from panoscene.scene import Layout, Scene, objects_from_boxes, scene_from_boxes, scene_surfaces
from panoscene.views._rays import cast_rays

pytestmark = pytest.mark.render

SQUARE = ((-3.0, -2.5), (3.0, -2.5), (3.0, 4.0), (-3.0, 4.0))
ELL = ((-2.0, -2.0), (4.0, -2.0), (4.0, 1.0), (1.0, 1.0), (1.0, 5.0), (-2.0, 5.0))
NOTHING = OrientedBoxes(torch.zeros(0, 3), torch.ones(0, 3), torch.zeros(0))


def room(boxes: OrientedBoxes = NOTHING, polygon: tuple[tuple[float, float], ...] = ELL) -> Scene:
    objects = objects_from_boxes(boxes, ["sofa"] * len(boxes))
    return scene_from_boxes(objects, Layout(torch.tensor(polygon)))


def one_box(centre: tuple[float, ...], size: tuple[float, ...], yaw: float) -> OrientedBoxes:
    return OrientedBoxes(torch.tensor([centre]), torch.tensor([size]), torch.tensor([yaw]))


def slab_distance(
    boxes: OrientedBoxes, eye: torch.Tensor, rays: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return where rays enter and leave the only box, by the slab test in its own axes."""
    to_box = object_from_world(boxes)[0]
    start = to_box[:3, :3] @ eye + to_box[:3, 3]
    along = rays @ to_box[:3, :3].T
    half = boxes.size[0] / 2
    near, far = (-half - start) / along, (half - start) / along
    return torch.minimum(near, far).amax(-1), torch.maximum(near, far).amin(-1)


def test_walls_floor_and_ceiling_are_where_the_layout_says() -> None:
    scene = room()
    rays = panorama_directions(64, 128, like=torch.zeros((), dtype=torch.float64))
    eye = torch.tensor([0.0, 0.0, 1.6], dtype=torch.float64)
    hits = cast_rays(scene, eye, rays)
    polygon = scene.layout.floor_polygon.double()
    flat = wall_distance(polygon, torch.atan2(rays[..., 0], rays[..., 1]).flatten()).view(64, 128)
    across, z = rays[..., :2].norm(dim=-1), rays[..., 2]
    level = torch.where(z > 0, 1.0 / z, -1.6 / z)
    assert hits.distance.dtype == torch.float64
    torch.testing.assert_close(hits.distance, torch.minimum(flat / across, level),
                               rtol=1e-5, atol=1e-5)  # fmt: skip
    surfaces = scene_surfaces(scene)
    kind = [[surfaces[k].kind for k in row] for row in hits.surface.tolist()]
    expected = torch.where(flat / across < level, 0, torch.where(z > 0, 1, 2)).tolist()
    assert kind == [[("wall", "ceiling", "floor")[k] for k in row] for row in expected]
    # the shell faces the eye inside it
    assert ((hits.normal * rays).sum(-1) < 0).all()
    torch.testing.assert_close(hits.normal.norm(dim=-1), torch.ones(64, 128, dtype=torch.float64))


@given(
    distance=st.floats(1.0, 1.4),
    lon=st.floats(-math.pi, math.pi),
    yaw=st.floats(-math.pi, math.pi),
    size=st.tuples(*[st.floats(0.1, 0.9)] * 3),
)
@settings(max_examples=10)
def test_the_pixels_of_a_box_are_those_of_the_slab_test(
    distance: float, lon: float, yaw: float, size: tuple[float, float, float]
) -> None:
    place = (distance * math.sin(lon), distance * math.cos(lon), size[2] / 2 + 0.2)
    boxes = one_box(place, size, yaw)
    scene, eye = room(boxes, SQUARE), torch.tensor([0.0, 0.0, 1.6])
    rays = panorama_directions(48, 96, like=eye)
    hits = cast_rays(scene, eye, rays)
    index = [surface.kind for surface in scene_surfaces(scene)].index("object")
    seen = hits.surface == index
    enters, leaves = slab_distance(boxes, eye, rays)
    sure = (enters - leaves).abs() > 1e-4
    expected = (enters < leaves) & (enters > 0)
    assert torch.equal(seen[sure], expected[sure])
    both = seen & expected
    torch.testing.assert_close(hits.distance[both], enters[both], rtol=1e-4, atol=1e-4)
    wider = bfov_from_boxes(boxes, 1.6)[0] + torch.tensor([0.0, 0.0, 1e-4, 1e-4])
    assert bfov_contains(wider.expand(int(seen.sum()), 4), rays[seen]).all()


def test_from_inside_a_box_its_inner_side_is_hit() -> None:
    boxes = one_box((0.1, 0.2, 1.5), (1.0, 2.0, 0.8), 0.4)
    eye = torch.tensor([0.0, 0.0, 1.6])
    rays = panorama_directions(16, 32, like=eye)
    hits = cast_rays(room(boxes), eye, rays)
    torch.testing.assert_close(hits.distance, slab_distance(boxes, eye, rays)[1])
    assert ((hits.normal * rays).sum(-1) > 0).all()


def test_rays_broadcast_and_may_leave_the_scene() -> None:
    scene = room()
    origins = torch.tensor([[10.0, 0.0, 1.0], [0.0, 0.0, 1.0]])[:, None]
    directions = torch.tensor([[3.0, 0.0, 0.0], [0.0, 0.0, 0.5], [-5.0, 0.0, 0.0]])
    hits = cast_rays(scene, origins, directions)
    assert hits.surface.shape == (2, 3)
    assert (hits.surface[0, :2] == -1).all()
    assert hits.distance[0].tolist() == pytest.approx([math.inf, math.inf, 6.0])
    assert hits.distance[1].tolist() == pytest.approx([4.0, 1.6, 2.0])
    assert hits.normal[0, 0].tolist() == [0.0, 0.0, 0.0]
    # seen from outside, the wall still faces the room
    assert hits.normal[0, 2].tolist() == pytest.approx([-1.0, 0.0, 0.0])
    assert cast_rays(scene, torch.zeros(0, 3), torch.zeros(0, 3)).surface.shape == (0,)


@pytest.mark.parametrize("ray", [(0.0, 0.0, 0.0), (math.nan, 0.0, 1.0), (math.inf, 0.0, 1.0)])
def test_rays_without_a_direction_are_refused(ray: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="rays"):
        cast_rays(room(), torch.zeros(3), torch.tensor(ray))


def test_boxes_that_are_not_finite_are_refused() -> None:
    scene = room(one_box((0.0, 2.0, 0.5), (1.0, 1.0, 1.0), 0.0))
    scene.objects.boxes.centre[0, 1] = np.nan
    with pytest.raises(ValueError, match=r"boxes\.centre"):
        cast_rays(scene, torch.zeros(3), torch.ones(3))
