from collections.abc import Callable
from dataclasses import replace

import torch

from panoscene.scene import (
    Mesh,
    Scene,
    Shapes,
    relation_triples,
    relations_from_boxes,
    select,
)

Same = Callable[[object, object], bool]


def test_all_objects_are_the_scene_itself(bedroom: Scene, same: Same) -> None:
    assert same(select(bedroom, torch.arange(len(bedroom.objects.id))), bedroom)


def test_relations_follow_their_objects(bedroom: Scene, same: Same) -> None:
    index = torch.tensor([3, 0, 2])
    part = select(bedroom, index)
    names = [bedroom.objects.id[k] for k in index.tolist()]
    assert list(part.objects.id) == names
    assert same(part.objects.boxes, bedroom.objects.boxes[index])
    kept = {str(t) for t in relation_triples(bedroom) if "nightstand" not in (t.subject, t.object)}
    # an undirected pair is named in the order of the objects
    found = {str(t) for t in relation_triples(select(bedroom, torch.tensor([0, 2, 3])))}
    assert found == kept
    anew = relations_from_boxes(part.objects.boxes, part.layout)
    assert part.relations is not None
    assert torch.equal(part.relations.touching_wall > 0.5, anew.touching_wall > 0.5)


def test_an_object_may_come_twice_or_not_at_all(bedroom: Scene) -> None:
    twice = select(bedroom, torch.tensor([1, 1]))
    assert twice.objects.id == (bedroom.objects.id[1],) * 2
    nothing = select(bedroom, torch.zeros(0, dtype=torch.int64))
    assert nothing.objects.id == ()
    assert nothing.relations is not None
    assert nothing.relations.touching.shape == (0, 0)


def test_shapes_come_along(bedroom: Scene) -> None:
    count = len(bedroom.objects.id)
    meshes = tuple(
        Mesh(torch.full((3, 3), float(k)), torch.tensor([[0, 1, 2]])) for k in range(count)
    )
    shapes = Shapes(code=torch.arange(float(count))[:, None], mesh=meshes)
    scene = replace(bedroom, objects=replace(bedroom.objects, shapes=shapes))
    part = select(scene, torch.tensor([2, 0])).objects.shapes
    assert part.mesh == (meshes[2], meshes[0])
    assert part.code is not None
    assert part.code[:, 0].tolist() == [2, 0]
