"""The energy E = E^c + E^r + E^o of a batch of scenes, term by term."""

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.arrange import _terms as terms
from panoscene.arrange._problem import Problem, boxes_from_variables, variables_from_boxes
from panoscene.arrange._settings import TERM_NAMES
from panoscene.geometry import OrientedBoxes


def energy_terms(
    variables: Float[Tensor, "7 scenes n"], problem: Problem, boxes: OrientedBoxes | None = None
) -> Float[Tensor, "scenes terms"]:
    """Return every weighted term of every scene, in the order of ``TERM_NAMES``.

    Entries are multiplied by their confidence, then Huber errors (``loss_beta``) are summed or
    averaged, then multiplied by the term's weight. Differentiable; the sum over the last axis is
    the energy of the paper (Sec. 3.3). ``boxes`` spares decoding the variables, or are the boxes
    that the variables were encoded from.
    """
    boxes = boxes_from_variables(variables, problem) if boxes is None else boxes
    errors = {
        **_collision_errors(boxes, problem),
        **_relation_errors(boxes, variables[2], problem),
        **_observation_errors(boxes, variables, problem),
    }
    rows = [
        problem.scale[name] * _huber(errors[name], problem.beta).flatten(1).sum(-1)
        for name in TERM_NAMES
    ]
    return torch.stack(rows, -1)


def energy_of_boxes(boxes: OrientedBoxes, problem: Problem) -> Float[Tensor, "scenes terms"]:
    """Return the terms of ``energy_terms`` for boxes of batch shape (scenes, n).

    Rounding in the descent's variables can hide what the boxes show: straight under the camera a
    hair's breadth is half a turn.
    """
    return energy_terms(variables_from_boxes(boxes, problem), problem, boxes)


def _huber(error: Tensor, beta: float) -> Tensor:
    """Return error^2 / (2 beta) below beta and error - beta / 2 above."""
    return torch.where(error < beta, error * error / (2 * beta), error - beta / 2)


def _collision_errors(boxes: OrientedBoxes, problem: Problem) -> dict[str, Tensor]:
    batch, settings, conf = problem.batch, problem.settings, problem.confidence
    pair = terms.object_collision(
        boxes,
        clearance=problem.apart,
        axis_weight=settings.axis_weight,
        kind=settings.collision,
    )
    wall = terms.wall_collision(boxes, batch.polygon, clearance=2 * problem.off_walls)
    apart = settings.clearance
    floor = terms.floor_collision(boxes, batch.floor_height, clearance=apart)
    ceiling = terms.ceiling_collision(boxes, batch.ceiling_height, clearance=apart)
    if settings.reduction == "mean":  # the release averages over all eight corners
        above = terms.floor_collision(boxes, batch.floor_height, upper=True, clearance=apart)
        below = terms.ceiling_collision(boxes, batch.ceiling_height, lower=True, clearance=apart)
        floor = torch.stack([floor, above], -1).repeat_interleave(4, -1)
        ceiling = torch.stack([ceiling, below], -1).repeat_interleave(4, -1)
    return {
        "object_collision": pair * conf.object_pair,
        "wall_collision": wall.repeat(1, 1, 2) * conf.inside_room[..., None],
        "floor_collision": floor * conf.valid.view(*conf.valid.shape, *[1] * (floor.ndim - 2)),
        "ceiling_collision": ceiling * conf.valid.view(*conf.valid.shape, *[1] * (floor.ndim - 2)),
    }


def _relation_errors(boxes: OrientedBoxes, distance: Tensor, problem: Problem) -> dict[str, Tensor]:
    batch, conf = problem.batch, problem.confidence
    share, apart = problem.settings.axis_weight, problem.settings.clearance
    return {
        "relative_yaw": terms.relative_yaw(boxes, boxes, problem.yaw_target) * conf.relative_yaw,
        "relative_yaw_wall": terms.relative_yaw(boxes, batch.walls, problem.yaw_target_wall)
        * conf.relative_yaw_wall,
        "touching": terms.touching(boxes, boxes, axis_weight=share, clearance=apart)
        * conf.touching,
        "touching_wall": terms.touching(boxes, batch.walls, axis_weight=share, clearance=apart)
        * conf.touching_wall,
        "on_floor": terms.on_floor(boxes, batch.floor_height, clearance=apart) * conf.on_floor,
        "under_ceiling": terms.under_ceiling(boxes, batch.ceiling_height, clearance=apart)
        * conf.under_ceiling,
        "farther_than": terms.farther_than(distance) * conf.farther_than,
    }


def _observation_errors(
    boxes: OrientedBoxes, variables: Tensor, problem: Problem
) -> dict[str, Tensor]:
    batch, conf = problem.batch, problem.confidence
    error = terms.observation(variables, problem.start)
    rectangle = terms.projected_rectangle(boxes, batch.bfov, batch.camera_height)
    image = terms.reprojection(rectangle, batch.bfov, kind=problem.settings.projection)
    return {
        "direction": (error[:2] * conf.direction).movedim(0, 1),
        "distance": error[2] * conf.distance,
        "yaw": error[3] * conf.yaw,
        "size": (error[4:] * conf.size).movedim(0, 1),
        "reprojection": image * conf.reprojection[..., None],
    }
