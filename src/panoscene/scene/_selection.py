"""Some of the objects of a scene, with what relates them."""

from dataclasses import replace

from jaxtyping import Float, Int64, Shaped
from torch import Tensor

from ._numbers import numbers_from_tensor
from ._records import Objects, Relations, Scene, Shapes


def select_objects(objects: Objects, index: Int64[Tensor, " chosen"]) -> Objects:
    """Return the objects of an index, in its order; an object may come twice, with the same id."""
    places: list[int] = numbers_from_tensor(index)
    shapes = objects.shapes
    return Objects(
        boxes=objects.boxes[index],
        category=objects.category[index],
        score=objects.score[index],
        bfov=objects.bfov[index],
        distance_score=objects.distance_score[index],
        yaw_score=objects.yaw_score[index],
        id=tuple(objects.id[k] for k in places) if objects.id else (),
        shapes=Shapes(
            code=None if shapes.code is None else shapes.code[index],
            mesh=tuple(shapes.mesh[k] for k in places) if shapes.mesh else (),
            source=tuple(shapes.source[k] for k in places) if shapes.source else (),
        ),
    )


def select_relations(relations: Relations, index: Int64[Tensor, " chosen"]) -> Relations:
    """Return the relations among the objects of an index, and of them to all walls.

    Scores are kept; that of an object to its own copy is that of an object to itself, which
    carries no meaning.
    """

    def among(pairs: Shaped[Tensor, "n n *rest"]) -> Shaped[Tensor, "chosen chosen *rest"]:
        return pairs[index[:, None], index[None, :]]

    def of(values: Float[Tensor, "n *rest"]) -> Float[Tensor, "chosen *rest"]:
        return values[index]

    return Relations(
        touching=among(relations.touching),
        touching_wall=of(relations.touching_wall),
        on_floor=of(relations.on_floor),
        under_ceiling=of(relations.under_ceiling),
        inside_room=of(relations.inside_room),
        farther_than=among(relations.farther_than),
        relative_yaw=among(relations.relative_yaw),
        relative_yaw_wall=of(relations.relative_yaw_wall),
    )


def select(scene: Scene, index: Int64[Tensor, " chosen"]) -> Scene:
    """Return the scene with only the objects of an index, in its order."""
    relations = scene.relations
    return replace(
        scene,
        objects=select_objects(scene.objects, index),
        relations=None if relations is None else select_relations(relations, index),
    )
