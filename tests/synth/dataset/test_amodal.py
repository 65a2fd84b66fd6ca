"""How much of a mesh there would be to see: the rays that are not cast would miss it."""

import numpy as np
import trimesh

from panoscene.synth.dataset._amodal import points_seen_alone, whole_solid_angle
from panoscene.synth.dataset._pixels import pixel_directions, pixel_solid_angle

HEIGHT, WIDTH = 48, 96


def test_no_ray_that_would_hit_is_left_out() -> None:
    rays = pixel_directions(HEIGHT, WIDTH).reshape(-1, 3).astype(np.float32)
    weight = np.repeat(pixel_solid_angle(HEIGHT, WIDTH), WIDTH)
    nothing = np.zeros(len(rays), bool)
    rng = np.random.default_rng(3)
    places = [
        np.array([0.02, 0.03, 2.0]),
        np.array([0.1, 0.0, -1.2]),
        *rng.normal(size=(30, 3)) * 2,
    ]
    seen = 0
    for place in places:
        box = trimesh.creation.box(rng.uniform(0.1, 1.5, 3))
        vertices, faces = box.vertices + place, box.faces.astype(np.int32)
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        _, hit = mesh.ray.intersects_id(
            np.zeros((len(rays), 3)), rays.astype(float), multiple_hits=False
        )
        hit = np.unique(hit)
        seen += len(hit)
        assert len(points_seen_alone(vertices, faces, rays)) == len(hit)
        whole = whole_solid_angle(vertices, faces, rays, weight, nothing)
        assert np.isclose(whole, weight[hit].sum())
    assert seen > 1000
