"""Penetration of meshes against exact booleans and against cases that can be worked by hand."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from panoscene.eval._mesh_penetration import (
    Penetration,
    mesh_penetrations,
    penetration_record,
    score_penetration,
)
from panoscene.eval._solid_depth import distance_to_faces, faces_from_triangles
from panoscene.eval._solids import is_closed
from panoscene.geometry import OrientedBoxes
from panoscene.scene import (
    Layout,
    Mesh,
    Scene,
    Shapes,
    box_mesh,
    object_surface,
    objects_from_boxes,
    scene_from_boxes,
)

ROOM = Layout(torch.tensor([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]))


def canonical(*parts: trimesh.Trimesh) -> Mesh:
    """Return parts as one mesh, scaled to the unit box."""
    whole = trimesh.util.concatenate(list(parts))
    assert isinstance(whole, trimesh.Trimesh)
    low, high = whole.bounds
    vertices = (whole.vertices - (low + high) / 2) / (high - low)
    return Mesh(
        torch.tensor(vertices, dtype=torch.float32),
        torch.tensor(whole.faces.tolist(), dtype=torch.int64),
    )


def block(size: Sequence[float], centre: Sequence[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(size, trimesh.transformations.translation_matrix(centre))


def chair() -> Mesh:
    """A seat half way up, a back and four legs, whose vertices touch."""
    legs = [block([0.1, 0.1, 0.45], [x, y, 0.225]) for x in (-0.45, 0.45) for y in (-0.45, 0.45)]
    return canonical(
        block([1, 1, 0.1], [0, 0, 0.5]), block([1, 0.1, 0.45], [0, -0.45, 0.775]), *legs
    )


def table() -> Mesh:
    """A thin top at the very top, on four legs in the corners; legs and top overlap."""
    legs = [block([0.05, 0.05, 1], [x, y, 0.5]) for x in (-0.475, 0.475) for y in (-0.475, 0.475)]
    return canonical(block([1, 1, 0.05], [0, 0, 0.975]), *legs)


def ball() -> Mesh:
    return canonical(trimesh.creation.icosphere(3, 0.5))


def ring() -> Mesh:
    return canonical(trimesh.creation.torus(0.4, 0.1, 32, 16))


def cross() -> Mesh:
    """Two blocks through each other: the middle is inside both."""
    return canonical(block([1, 0.5, 0.5], [0, 0, 0]), block([0.5, 1, 1], [0, 0, 0]))


def room(
    *things: tuple[Sequence[float], Sequence[float], float, Mesh | None],
) -> Scene:
    """Return a room with objects of given centre, size, yaw and mesh."""
    n = len(things)
    boxes = OrientedBoxes(
        torch.tensor([thing[0] for thing in things], dtype=torch.float32).reshape(n, 3),
        torch.tensor([thing[1] for thing in things], dtype=torch.float32).reshape(n, 3),
        torch.tensor([thing[2] for thing in things], dtype=torch.float32),
    )
    objects = objects_from_boxes(boxes, ["chair"] * n, camera_height=1.6)
    shapes = Shapes(mesh=tuple(thing[3] for thing in things))
    return scene_from_boxes(replace(objects, shapes=shapes), ROOM, camera_height=1.6)


def only(scene: Scene, **options: int) -> Penetration:
    (found,) = mesh_penetrations(scene, **options)
    return found


def exact_volume(scene: Scene) -> float:
    """Return the volume of the intersection of objects 0 and 1 by manifold3d."""
    parts = []
    for index in (0, 1):
        surface = object_surface(scene, index)
        whole = trimesh.Trimesh(
            surface.vertices.double().numpy(), surface.faces.numpy(), process=False
        )
        pieces = list(whole.split(only_watertight=False))
        parts.append(trimesh.boolean.union(pieces, engine="manifold"))
    return float(trimesh.boolean.intersection(parts, engine="manifold").volume)


CUBE = (1.0, 1.0, 1.0)


@pytest.mark.parametrize("mesh", [box_mesh(), None])
def test_two_cubes(mesh: Mesh | None):
    """As meshes and in closed form: a slab of 0.25 x 0.5 x 1."""
    found = only(room(((0, 1, 0.5), CUBE, 0, mesh), ((0.75, 1.5, 0.5), CUBE, 0, mesh)))
    assert found.depth == pytest.approx(0.25, abs=2e-3)
    assert found.volume == pytest.approx(0.125, rel=1e-5)
    assert set(found.kinds) == {"box" if mesh is None else "mesh"}


def test_a_cube_in_a_cube():
    """To come out, the small one must cross to the nearest side of the big one."""
    found = only(room(((0, 1, 1), (2, 2, 2), 0.4, box_mesh()), ((0, 1, 1), CUBE, 0.4, box_mesh())))
    assert found.depth == pytest.approx(1.5, abs=5e-3)
    assert found.volume == pytest.approx(1.0, rel=1e-4)


def test_boxes_apart_are_not_looked_at():
    scene = room(((0, 1, 0.5), CUBE, 0, box_mesh()), ((1.5, 1, 0.5), CUBE, 0.3, ball()))
    assert mesh_penetrations(scene) == ()


def test_a_chair_under_a_table_penetrates_nothing():
    seat = ((0.0, 0.9, 0.35), (0.5, 0.5, 0.7), 0.0, chair())
    desk = ((0.0, 1.2, 0.375), (1.4, 0.8, 0.75), 0.0, table())
    found = only(room(seat, desk))
    assert found.kinds == ("mesh", "mesh")
    assert (found.depth, found.volume) == (0.0, 0.0)
    # in a closed box of the same size it would
    boxed = only(room((*seat[:3], None), (*desk[:3], None)))
    assert boxed.depth > 0.3
    record = penetration_record(room(seat, desk))
    assert (record.overlapping_boxes, record.penetrating_pairs) == (1, 0)


def test_a_chair_too_high_for_the_table_penetrates_its_top():
    found = only(
        room(
            ((0.0, 1.2, 0.4), (0.5, 0.5, 0.8), 0.0, chair()),
            ((0.0, 1.2, 0.375), (1.4, 0.8, 0.75), 0.0, table()),
        )
    )
    assert found.volume == pytest.approx(0.5 * 0.05 * 0.05 * 0.75, rel=1e-3)
    # the top is 3.75 cm thick, and the chair's back reaches 5 cm above it
    assert 0.0375 <= found.depth <= 0.05


def test_a_rod_through_a_ring_touches_nothing():
    rod = canonical(block([1, 1, 1], [0, 0, 0]))
    through = room(((0, 1, 1), (1, 1, 0.2), 0, ring()), ((0, 1, 1), (0.3, 0.3, 1), 0.2, rod))
    assert only(through).depth == 0.0


@pytest.mark.parametrize(
    ("first", "other"),
    [
        (((0, 1, 0.5), CUBE, 0.0, ball()), ((0.6, 1, 0.5), CUBE, 0.3, ball())),
        (((0, 1, 0.5), CUBE, 0.2, ball()), ((0.3, 1.2, 0.6), (1, 0.5, 1), 0.5, None)),
        (((0, 1, 0.5), (0.5, 0.6, 0.9), 0.0, chair()), ((0.2, 1.1, 0.5), CUBE, 0.5, chair())),
        (((0, 1, 0.9), (1, 0.02, 0.8), 0.7, box_mesh()), ((0.2, 1, 0.8), CUBE, 0.1, ring())),
        (((0, 1, 0.5), CUBE, 0.2, cross()), ((0.1, 1, 0.6), CUBE, 0.5, None)),
        (((0, 1, 0.5), (0.8, 0.7, 0.6), -2.0, ring()), ((0.1, 1, 0.5), CUBE, 2.5, chair())),
    ],
)
def test_volumes_agree_with_exact_booleans(
    first: tuple[Sequence[float], Sequence[float], float, Mesh | None],
    other: tuple[Sequence[float], Sequence[float], float, Mesh | None],
):
    scene = room(first, other)
    wanted = exact_volume(scene)
    assert wanted > 1e-4
    assert only(scene, resolution=120).volume == pytest.approx(wanted, rel=0.02)
    assert only(scene).volume == pytest.approx(wanted, rel=0.06)


def test_depth_of_two_balls_is_their_overlap():
    found = only(room(((0, 1, 0.5), CUBE, 0, ball()), ((0.5, 1, 0.5), CUBE, 1, ball())))
    # the icosphere is inscribed: a little less
    assert 0.49 < found.depth <= 0.5


def test_moving_by_the_depth_is_needed():
    """Along the direction of the centres, anything shorter leaves them in contact."""
    one = ((0.0, 1.0, 0.5), (0.8, 0.6, 0.7), 0.3, ball())
    found = only(room(one, ((0.3, 1.1, 0.6), (0.5, 0.9, 0.8), -0.4, chair())))
    rng = np.random.default_rng(0)
    for _ in range(4):
        move = rng.standard_normal(3)
        move *= 0.9 * found.depth / np.linalg.norm(move)
        centre = (0.3 + move[0], 1.1 + move[1], 0.6 + move[2])
        assert only(room(one, (centre, (0.5, 0.9, 0.8), -0.4, chair()))).volume > 0


def test_turning_the_world_and_swapping_objects_change_little():
    one = ((0.5, 1.0, 0.5), (0.8, 0.6, 0.7), 0.3, chair())
    other = ((0.7, 1.2, 0.6), (0.5, 0.9, 0.8), -0.4, ball())
    found = only(room(one, other))

    def turned(
        thing: tuple[Sequence[float], Sequence[float], float, Mesh],
    ) -> tuple[Sequence[float], Sequence[float], float, Mesh]:
        (x, y, z), size, yaw, mesh = thing
        cos, sin = math.cos(1.1), math.sin(1.1)
        return (cos * x - sin * y, sin * x + cos * y, z), size, yaw + 1.1, mesh

    again = only(room(turned(other), turned(one)))
    assert again.volume == pytest.approx(found.volume, rel=1e-3)
    assert again.depth == pytest.approx(found.depth, rel=1e-2)


def test_what_is_not_closed_becomes_its_hull_or_box_and_says_so():
    whole = ball()
    torn = Mesh(whole.vertices, whole.faces[:-40])
    sheet = Mesh(
        torch.tensor([[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5]]), torch.tensor([[0, 1, 2]])
    )
    scene = room(
        ((0, 1, 0.5), CUBE, 0, torn),
        ((0.2, 1, 0.5), CUBE, 0, sheet),
        ((0.4, 1, 0.5), CUBE, 0, None),
    )
    found = mesh_penetrations(scene)
    assert [pair.kinds for pair in found] == [("hull", "box"), ("hull", "box"), ("box", "box")]
    assert found[0].volume > 0.3
    record = penetration_record(scene)
    assert (record.looked_at, record.as_hull, record.as_box) == (3, 1, 2)


def test_closed_or_not():
    whole = ball()
    assert is_closed(box_mesh())
    assert is_closed(whole)
    assert is_closed(chair())  # parts that share corners
    soup = Mesh(whole.vertices[whole.faces].flatten(0, 1), torch.arange(3840).view(-1, 3))
    assert is_closed(soup)
    assert not is_closed(Mesh(whole.vertices, whole.faces[1:]))
    mixed = whole.faces.clone()
    mixed[0] = mixed[0].flip(0)
    assert not is_closed(Mesh(whole.vertices, mixed))


def test_a_mesh_inside_out_is_turned():
    inverted = Mesh(ball().vertices, ball().faces.flip(1))
    cubes = ((0.3, 1, 0.5), CUBE, 0.5, None)
    right = only(room(((0, 1, 0.5), CUBE, 0, ball()), cubes))
    wrong = only(room(((0, 1, 0.5), CUBE, 0, inverted), cubes))
    assert wrong.kinds[0] == "mesh"
    assert wrong.volume == pytest.approx(right.volume, rel=1e-9)


def test_distances_to_triangles_agree_with_trimesh():
    mesh = trimesh.creation.torus(0.4, 0.1, 24, 12)
    points = np.random.default_rng(1).uniform(-1, 1, (200, 3))
    found = distance_to_faces(points, faces_from_triangles(np.asarray(mesh.triangles)))
    wanted = trimesh.proximity.closest_point(mesh, points)[1]
    assert np.allclose(found, wanted, atol=1e-9)


def test_records_of_empty_and_single_scenes_are_zero():
    for scene in (room(), room(((0, 1, 0.5), CUBE, 0, ball()))):
        record = penetration_record(scene)
        assert set(record.as_dict().values()) <= {0, len(scene.objects.boxes)}
        assert record.depth == record.volume == 0.0


def test_scores_are_per_scene_and_rates_of_sums():
    deep = room(((0, 1, 0.5), CUBE, 0, None), ((0.75, 1, 0.5), CUBE, 0, None))
    scores = score_penetration([penetration_record(deep), penetration_record(room())])
    assert scores["penetration_depth"] == pytest.approx(0.125)
    assert scores["penetration_volume"] == pytest.approx(0.125)
    assert scores["penetration_rate"] == 1.0
    assert scores["worst_penetration"] == pytest.approx(0.25)
    assert scores["box_share"] == 1.0
    nothing = score_penetration([penetration_record(room())])
    assert nothing["penetration_rate"] is None
    assert nothing["box_share"] is None
    with pytest.raises(ValueError, match="records"):
        score_penetration([])
    with pytest.raises(ValueError, match="resolution"):
        mesh_penetrations(deep, resolution=1)
