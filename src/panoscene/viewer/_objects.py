"""Single objects of a scene: taken out, put in, given a new box."""

from dataclasses import fields, replace

import torch
from jaxtyping import Shaped
from torch import Tensor

from panoscene.geometry import OrientedBoxes, bfov_from_boxes
from panoscene.scene import Relations, Scene, relations_from_boxes


def with_relations(scene: Scene) -> Scene:
    """Return the scene with its relations, or with those that follow from boxes that may be off.

    Raises:
        ValueError: they cannot be derived: boxes or layout are not valid.
    """
    if scene.relations is not None:
        return scene
    return replace(scene, relations=_derived(scene))


def with_box(scene: Scene, index: int, box: OrientedBoxes) -> Scene:
    """Return the scene with one object where somebody put it (a box of batch shape ()).

    The object is taken at its word: its BFoV becomes that of the box, its distance and yaw are
    certain, and its relations, to others and of others to it, are those of the boxes.
    """
    old = scene.objects
    boxes = OrientedBoxes(
        _set(old.boxes.centre, index, box.centre),
        _set(old.boxes.size, index, box.size),
        _set(old.boxes.yaw, index, box.yaw),
    )
    seen = bfov_from_boxes(boxes[index], scene.panorama.camera_height)
    certain = torch.ones(())
    objects = replace(
        old,
        boxes=boxes,
        bfov=_set(old.bfov, index, seen),
        distance_score=_set(old.distance_score, index, certain),
        yaw_score=_set(old.yaw_score, index, certain),
    )
    return with_derived_relations(replace(scene, objects=objects), index)


def with_derived_relations(scene: Scene, index: int) -> Scene:
    """Return the scene with everything that relates one object derived from the boxes."""
    old, new = scene.relations, _derived(scene)
    if old is None:
        return replace(scene, relations=new)
    touched = torch.zeros(len(scene.objects.boxes), dtype=torch.bool)
    touched[index] = True
    pair = touched[:, None] | touched[None, :]
    masks = {"touching": pair, "farther_than": pair, "relative_yaw": pair}

    def chosen(name: str) -> Shaped[Tensor, "..."]:
        before, after = getattr(old, name), getattr(new, name)
        mask = masks.get(name, touched)
        mask = mask.reshape(*mask.shape, *[1] * (before.ndim - mask.ndim))
        return torch.where(mask, after.to(before), before)

    return replace(scene, relations=Relations(**{f.name: chosen(f.name) for f in fields(old)}))


def _derived(scene: Scene) -> Relations:
    # as convert and arrange: boxes that are being put right may stick out
    return relations_from_boxes(
        scene.objects.boxes, scene.layout, scene.panorama.camera_height, inside="any_corner"
    )


def _set(
    values: Shaped[Tensor, "n *rest"], index: int, value: Shaped[Tensor, "*rest"]
) -> Shaped[Tensor, "n *rest"]:
    """Return a copy with one row replaced."""
    copy = values.clone()
    copy[index] = value.to(copy)
    return copy
