"""From padded batches to the objects and relations of single scenes."""

import torch

from panoscene.models.pose import PoseOutput
from panoscene.scene import CATEGORIES, Objects, Relations

from ._calibration import RELATIONS, Calibration, relation_probabilities
from ._estimates import Estimates, boxes_from_output
from ._relations import ContextOutput

_WALLS = ("touching_wall", "relative_yaw_wall")
_PAIRS = ("touching", "farther_than", "relative_yaw")


def objects_of(output: PoseOutput, estimates: Estimates, index: int) -> Objects:
    """Return the objects of one scene, without padding.

    Args:
        output: Initial or refined, batch shape (scenes, n).
        estimates: Of the same objects.
        index: Of the scene.

    Convention:
        - ``distance_score`` and ``yaw_score`` are the probabilities of the chosen bins
        - ids are the category and the place in the list, such as chair_4
    """
    real = estimates.valid[index]
    category = estimates.category[index][real]
    return Objects(
        boxes=boxes_from_output(output, estimates)[index][real],
        category=category,
        score=estimates.score[index][real],
        bfov=estimates.bfov[index][real],
        distance_score=output.distance_logit[index][real].softmax(dim=-1).amax(dim=-1),
        yaw_score=output.yaw_logit[index][real].softmax(dim=-1).amax(dim=-1),
        id=tuple(f"{CATEGORIES[k]}_{i}" for i, k in enumerate(category.tolist())),
    )


def relations_of(
    output: ContextOutput, index: int, calibration: Calibration | None = None
) -> Relations:
    """Return the relations of one scene as probabilities, without padding.

    Args:
        output: Of a network with relation heads.
        index: Of the scene.
        calibration: Of the network; without it the logits are taken as they are.

    Raises:
        ValueError: The output has no relations.
    """
    if output.relations is None:
        raise ValueError("output.relations: found none, expected those of relation heads")
    found = relation_probabilities(output.relations, output.valid, output.wall_valid, calibration)
    real, walls = output.valid[index], output.wall_valid[index]
    values: dict[str, torch.Tensor] = {}
    for name in RELATIONS:
        value = getattr(found, name)[index][real]
        if name in _PAIRS:
            value = value[:, real]
        elif name in _WALLS:
            value = value[:, walls]
        values[name] = value
    return Relations(**values)
