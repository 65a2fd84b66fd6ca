"""The relations of a finished scene: what its boxes have, and what the network saw."""

from dataclasses import replace

import torch

from panoscene.scene import Relations, Scene, built_in, relations_from_boxes

CONTACTS = ("touching", "touching_wall", "on_floor")
"""Relations that can be right although the boxes of an estimate leave a gap. Contacts with the
ceiling are too few to learn: 4 in 135 panoramas, and the network finds none likely."""
_GAP = 0.3
_LIKELY = 0.5
_UNLIKELY = 0.3
_DOUBTFUL = 0.6
"""Score below which an object may well not be there: it touches a wall by chance."""
_UNLIKELY_IF_DOUBTFUL = 0.45


def box_relations(scene: Scene, tolerance: float = 0.1) -> Relations:
    """Return the relations of a scene's boxes, which may stand out of the room by centimetres.

    Args:
        scene: its boxes and its room.
        tolerance: metres that contacts may be apart.
    """
    return relations_from_boxes(
        scene.objects.boxes,
        scene.layout,
        scene.panorama.camera_height,
        inside="any_corner",
        tolerance=tolerance,
        floor_tolerance=tolerance,
    )


def held_relations(scene: Scene) -> Relations:
    """Return the relations that the arrangement holds a scene to.

    They are the scene's own, or those of its boxes, but walls let doors and windows be: those stand
    in them, their centre a decimetre behind the surface, and the arrangement would push them out.

    Args:
        scene: before the arrangement.
    """
    found = scene.relations or box_relations(scene)
    inside = found.inside_room.masked_fill(built_in(scene.objects.category), 0)
    return replace(found, inside_room=inside)


def final_relations(scene: Scene, said: Relations | None) -> Relations:
    """Return the relations of a scene's boxes; of contacts the network has a say.

    A contact that the boxes have holds, 1, unless a network finds it unlikely: below 0.3. One that
    they miss by at most 0.3 m, about the error of an estimate, holds where a network finds it
    likely, above 0.5, and is as probable as the network says. So no contact is told of what is
    apart. A doubtful object, with a score below 0.6, needs a chance of 0.45 to touch a wall. The
    rule was chosen on homes of the training and the validation part; there it is better than either
    of the two alone. Contacts with the ceiling are those of the boxes.

    Args:
        scene: after the arrangement.
        said: by the network, of the same objects and walls; None if there was none.
    """
    had = box_relations(scene)
    if said is None:
        return had
    near = box_relations(scene, _GAP)
    contacts = {}
    doubtful = scene.objects.score[:, None] < _DOUBTFUL
    at_walls = torch.where(doubtful, _UNLIKELY_IF_DOUBTFUL, _UNLIKELY)
    for name in CONTACTS:
        chance = getattr(said, name).to(getattr(had, name))
        unlikely = at_walls if name == "touching_wall" else _UNLIKELY
        sure = torch.where(chance >= unlikely, getattr(had, name), 0.0)
        seen = torch.where(chance > _LIKELY, chance, 0.0) * getattr(near, name)
        contacts[name] = torch.maximum(sure, seen)
    return replace(had, **contacts)
