"""Relations of predicted scenes, as scored and as their boxes have them, against the target."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from panoscene.arrange import Thresholds
from panoscene.eval._matching import IOU_THRESHOLD, match_objects
from panoscene.eval._relation_records import (
    RANDOM_YAW_ERROR_DEG,
    YES_OR_NO,
    RelationCounts,
    RelationRecord,
    YawErrors,
)
from panoscene.geometry import OrientedBoxes, wall_boxes, wrap_angle
from panoscene.scene import (
    Layout,
    Relations,
    Scene,
    relations_from_boxes,
    relative_yaw_angle,
)

_SAME_ROOM = 1e-4
"""Metres by which two layouts may differ and have the same walls."""
_AMONG_OBJECTS = ("touching", "farther_than")


def relation_record(
    prediction: Scene,
    target: Scene,
    *,
    thresholds: Thresholds | None = None,
    iou_threshold: float = IOU_THRESHOLD,
    same_category: bool = True,
) -> RelationRecord:
    """Return how the relation scores of a predicted scene answer for the target's relations.

    A relation is claimed when its score is above its threshold; the relative yaw is that of the
    most probable bin, whatever its score. An entry of eight zeros is no answer and counts as a
    random guess, 90 degrees off. Nothing is compared with itself (no diagonal).

    Relations with walls, floor and ceiling only mean something in one room. Where the two layouts
    differ, those of the target are derived again, from the true boxes in the predicted layout, as
    the paper's ground truth is: wall i is wall i of the prediction. So they say what a perfect
    relation network would say about this layout, and not how good the layout is.

    Args:
        prediction: a scene with relation scores.
        target: the true scene; relations that it lacks follow from its boxes.
        thresholds: one for each relation, 0.5 when omitted; those of the authors' release are
            ``PRESETS["released"].thresholds``.
        iou_threshold: as in ``match_objects``.
        same_category: as in ``match_objects``.

    Raises:
        ValueError: The prediction has objects and no relations, or relations of another number of
            objects or walls.

    Source: paper, Sec. 4 (relation estimation); classification scores of the authors' release.
    """
    if prediction.relations is None and len(prediction.objects.boxes) > 0:
        raise ValueError(
            "prediction.relations: expected scores, found None; fidelity_record needs none"
        )
    claims = _relations(prediction)
    match = match_objects(
        prediction.objects, target.objects, iou_threshold=iou_threshold, same_category=same_category
    )
    truth = _target_in(prediction.layout, target)
    turns = _true_turns(target.objects.boxes, prediction.layout)
    return _record(_claims(claims, thresholds or Thresholds()), _held(truth, turns), match)


def fidelity_record(
    prediction: Scene,
    target: Scene | None = None,
    *,
    thresholds: Thresholds | None = None,
    iou_threshold: float = IOU_THRESHOLD,
    same_category: bool = True,
) -> RelationRecord:
    """Return whether the predicted boxes obey relations: the target's, or the predicted ones.

    The relations that the boxes have (``relations_from_boxes``, with the tolerances of the labels)
    take the place of relation scores. With a target they are compared with its relations, as in
    ``relation_record``. Without one they are compared with what the prediction's own scores
    claim, object by object: do the boxes keep what the relations promise? Then ``error_deg`` is
    between the claimed bin and the boxes' own difference of yaws, and claims are in the role of
    the target; an entry of eight zeros claims nothing and is left out.

    Args:
        prediction: the scene whose boxes are judged, in its own layout.
        target: the true scene, or None for the prediction's own relation scores.
        thresholds: of the claims; used without a target only.
        iou_threshold: as in ``match_objects``.
        same_category: as in ``match_objects``.

    Raises:
        ValueError: There is no target and the prediction has objects and no relations, or
            relations of another number of objects or walls.

    Source: fidelity of the authors' release, which compares pairs after shrinking the boxes
        instead of growing them; here all relations use the tolerances of the labels.
    """
    had = _derived(prediction, prediction.layout)
    if target is not None:
        match = match_objects(
            prediction.objects,
            target.objects,
            iou_threshold=iou_threshold,
            same_category=same_category,
        )
        truth = _target_in(prediction.layout, target)
        turns = _true_turns(target.objects.boxes, prediction.layout)
        return _record(_claims(had, Thresholds()), _held(truth, turns), match)
    if prediction.relations is None and len(prediction.objects.boxes) > 0:
        raise ValueError("prediction.relations: expected scores without a target, found None")
    claims = _claims(_relations(prediction), thresholds or Thresholds())
    claims = _Answers(
        claims.holds, claims.turn, _true_turns(prediction.objects.boxes, prediction.layout)
    )
    every = torch.arange(len(prediction.objects.boxes))
    return _record(_claims(had, Thresholds()), claims, every)


@dataclass(frozen=True, slots=True)
class _Answers:
    """Relations as decisions."""

    holds: dict[str, Bool[Tensor, "..."]]
    turn: tuple[Float[Tensor, "n n"], Float[Tensor, "n m"]]
    """Values of the chosen relative-yaw bins in radians; NaN where none is chosen."""
    exact_turn: tuple[Float[Tensor, "n n"], Float[Tensor, "n m"]] | None = None
    """The differences of yaws themselves."""


def _record(claimed: _Answers, truth: _Answers, match: Int64[Tensor, " n"]) -> RelationRecord:
    """Return the comparison of claims with the truth of the objects that they match."""
    subject = (match >= 0).nonzero().squeeze(1)
    wanted = match[subject]
    counts = {
        name: _counts(claimed.holds[name], truth.holds[name], subject, wanted, name)
        for name in YES_OR_NO
    }
    exact = truth.exact_turn or truth.turn
    among, walls = (
        _yaw_errors(claimed.turn[k], truth.turn[k], exact[k], subject, wanted, among_objects=k == 0)
        for k in (0, 1)
    )
    return RelationRecord(**counts, relative_yaw=among, relative_yaw_wall=walls)


def _counts(
    claimed: Bool[Tensor, "..."],
    truth: Bool[Tensor, "..."],
    subject: Int64[Tensor, " k"],
    wanted: Int64[Tensor, " k"],
    name: str,
) -> RelationCounts:
    in_target = truth.numel()
    claims, truths = claimed[subject], truth[wanted]
    compared = claims.numel()
    if name in _AMONG_OBJECTS:
        in_target -= len(truth)
        claims, truths = claims[:, subject], truths[:, wanted]
        compared = claims.numel() - len(subject)
    hit, claims_made, truths_there, all_truths, all_claims = (
        int(part.sum()) for part in (claims & truths, claims, truths, truth, claimed)
    )
    return RelationCounts(
        true_positive=hit,
        false_positive=claims_made - hit,
        true_negative=compared - claims_made - truths_there + hit,
        false_negative=truths_there - hit,
        missed=all_truths - truths_there,
        invented=all_claims - claims_made,
        in_target=in_target,
    )


def _yaw_errors(
    claimed: Float[Tensor, "n b"],
    truth: Float[Tensor, "t c"],
    exact: Float[Tensor, "t c"],
    subject: Int64[Tensor, " k"],
    wanted: Int64[Tensor, " k"],
    *,
    among_objects: bool,
) -> YawErrors:
    in_target = int(truth.isfinite().sum())
    claimed, truth, exact = claimed[subject], truth[wanted], exact[wanted]
    if among_objects:
        claimed, truth, exact = claimed[:, subject], truth[:, wanted], exact[:, wanted]
    stated = truth.isfinite()
    errors = [
        torch.rad2deg(wrap_angle(claimed - angle).abs())[stated].nan_to_num(RANDOM_YAW_ERROR_DEG)
        for angle in (truth, exact)
    ]
    bin_error, error = (float(part.sum()) for part in errors)
    return YawErrors(int(stated.sum()), in_target, bin_error, error)


def _claims(relations: Relations, thresholds: Thresholds) -> _Answers:
    """Return relation scores as decisions; nothing is related to itself."""
    holds = {name: getattr(relations, name) > getattr(thresholds, name) for name in YES_OR_NO}
    self_pair = torch.eye(len(relations.on_floor), dtype=torch.bool)
    for name in _AMONG_OBJECTS:
        holds[name] = holds[name] & ~self_pair
    among = _bin_values(relations.relative_yaw).masked_fill(self_pair, torch.nan)
    return _Answers(holds, (among, _bin_values(relations.relative_yaw_wall)))


def _held(truth: Relations, turns: tuple[Float[Tensor, "n n"], Float[Tensor, "n m"]]) -> _Answers:
    answers = _claims(truth, Thresholds())
    return _Answers(answers.holds, answers.turn, turns)


def _bin_values(score: Float[Tensor, "a b 8"]) -> Float[Tensor, "a b"]:
    return torch.where((score > 0).any(-1), relative_yaw_angle(score), torch.nan)


def _true_turns(
    boxes: OrientedBoxes, layout: Layout
) -> tuple[Float[Tensor, "n n"], Float[Tensor, "n m"]]:
    """Return yaw of the other minus own yaw, in radians: objects, walls of a layout."""
    yaw = boxes.yaw.detach().cpu().double()
    polygon = layout.floor_polygon.detach().cpu().double()
    wall_yaw = wall_boxes(polygon, layout.floor_height, layout.ceiling_height).yaw
    return yaw[None] - yaw[:, None], wall_yaw[None] - yaw[:, None]


def _target_in(layout: Layout, target: Scene) -> Relations:
    """Return the target's relations, with those to the room as they are in another layout."""
    if target.relations is not None and _same_room(layout, target.layout):
        return _relations(target)
    derived = _derived(target, layout)
    if target.relations is None:
        return derived
    own = _relations(target)
    return Relations(
        touching=own.touching,
        touching_wall=derived.touching_wall,
        on_floor=derived.on_floor,
        under_ceiling=derived.under_ceiling,
        inside_room=derived.inside_room,
        farther_than=own.farther_than,
        relative_yaw=own.relative_yaw,
        relative_yaw_wall=derived.relative_yaw_wall,
    )


def _same_room(a: Layout, b: Layout) -> bool:
    first, second = (layout.floor_polygon.detach().cpu().double() for layout in (a, b))
    return (
        first.shape == second.shape
        and bool(((first - second).abs() <= _SAME_ROOM).all())
        and abs(a.floor_height - b.floor_height) <= _SAME_ROOM
        and abs(a.ceiling_height - b.ceiling_height) <= _SAME_ROOM
    )


def _derived(scene: Scene, layout: Layout) -> Relations:
    """Return the relations of a scene's boxes in a layout, with the tolerances of the labels."""
    boxes = scene.objects.boxes
    boxes = OrientedBoxes(
        boxes.centre.detach().cpu().double(),
        boxes.size.detach().cpu().double(),
        boxes.yaw.detach().cpu().double(),
    )
    # any_corner: layouts and boxes that were estimated are off by more than the tolerance
    return relations_from_boxes(boxes, layout, scene.panorama.camera_height, inside="any_corner")


def _relations(scene: Scene) -> Relations:
    """Return the relations of a scene in float64, checked; empty ones for an empty scene."""
    relations = scene.relations
    n, walls = len(scene.objects.boxes), len(scene.layout.floor_polygon)
    if relations is None:
        return _derived(scene, scene.layout)
    found = (tuple(relations.touching.shape), tuple(relations.touching_wall.shape))
    if found != ((n, n), (n, walls)):
        raise ValueError(
            f"relations: expected those of {n} objects and {walls} walls, found touching "
            f"{found[0]} and touching_wall {found[1]}"
        )
    return Relations(
        **{
            name: getattr(relations, name).detach().cpu().double()
            for name in (*YES_OR_NO, "relative_yaw", "relative_yaw_wall")
        }
    )
