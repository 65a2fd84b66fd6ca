"""Relation scores on scenes that can be worked by hand, and what must not matter."""

import dataclasses
import json
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.arrange import Thresholds
from panoscene.eval._relation_records import (
    RANDOM_YAW_ERROR_DEG,
    TURNS,
    YES_OR_NO,
    RelationCounts,
    YawErrors,
    score_relations,
)
from panoscene.eval._relation_scores import fidelity_record, relation_record
from panoscene.geometry import OrientedBoxes
from panoscene.scene import (
    RELATIVE_YAW_BINS,
    Layout,
    Objects,
    Relations,
    Scene,
    objects_from_boxes,
    relations_from_boxes,
    scene_from_boxes,
)
from panoscene.synth import PerturbNoise, corrupt_relations, perturb_scene, sample_room

ROOM = Layout(torch.tensor([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]), 0.0, 2.5)
CATEGORIES = ("chair", "sofa", "table", "bed", "shelf")


def scene(
    *centre: Sequence[float],
    yaw: Sequence[float] | None = None,
    category: Sequence[str] | None = None,
    layout: Layout = ROOM,
) -> Scene:
    """Return a room with unit cubes and the relations that they have."""
    n = len(centre)
    boxes = OrientedBoxes(
        torch.tensor(centre, dtype=torch.float32).reshape(n, 3),
        torch.ones(n, 3),
        torch.zeros(n) if yaw is None else torch.tensor(yaw, dtype=torch.float32),
    )
    objects = objects_from_boxes(boxes, category or CATEGORIES[:n], camera_height=1.6)
    return scene_from_boxes(objects, layout, camera_height=1.6)


def relations_of(room: Scene) -> Relations:
    assert room.relations is not None
    return room.relations


def claiming(room: Scene, **scores: torch.Tensor) -> Scene:
    """Return a scene with some relation scores replaced."""
    return replace(room, relations=replace(relations_of(room), **scores))


def three() -> Scene:
    """Two cubes side by side on the floor, the third in the corner of walls 1 and 2."""
    return scene((0, 0, 0.5), (1, 0, 0.5), (2.45, 2.45, 0.5))


def test_the_truth_scores_one():
    record = relation_record(three(), three())
    assert record.touching == RelationCounts(2, 0, 4, 0, 0, 0, 6)
    assert record.touching_wall == RelationCounts(2, 0, 10, 0, 0, 0, 12)
    assert record.on_floor == RelationCounts(3, 0, 0, 0, 0, 0, 3)
    assert record.under_ceiling == RelationCounts(0, 0, 3, 0, 0, 0, 3)
    assert record.farther_than.in_target == 6
    assert record.relative_yaw == YawErrors(6, 6, 0.0, 0.0)
    assert record.relative_yaw_wall == pytest.approx((12, 12, 0.0, 0.0), abs=1e-4)
    scores = score_relations([record])
    assert scores["touching_f1"] == scores["touching_tnr"] == scores["touching_accuracy"] == 1.0
    assert scores["farther_than_f1"] == scores["farther_than_f1_end_to_end"] == 1.0


def test_a_hand_worked_table():
    """Of 6 ordered pairs 2 touch; claimed are (0, 1), found, and (0, 2), false."""
    claims = torch.zeros(3, 3)
    claims[0, 1], claims[0, 2], claims[1, 0] = 0.9, 0.8, 0.5  # 0.5 is not above 0.5
    claims[1, 1] = 1.0  # nothing is related to itself
    record = relation_record(claiming(three(), touching=claims), three())
    assert record.touching == RelationCounts(1, 1, 3, 1, 0, 0, 6)
    scores = score_relations([record])
    assert scores["touching_f1"] == scores["touching_tpr"] == scores["touching_precision"] == 0.5
    assert scores["touching_tnr"] == 0.75
    assert scores["touching_accuracy"] == pytest.approx(4 / 6)
    assert scores["touching_compared"] == scores["touching_in_target"] == 6


def test_each_relation_has_its_threshold():
    claims = 0.3 * relations_of(three()).touching
    dim = claiming(three(), touching=claims, on_floor=torch.full((3,), 0.3))
    record = relation_record(dim, three(), thresholds=Thresholds(touching=0.2))
    assert record.touching.true_positive == 2
    assert record.on_floor.false_negative == 3


def test_missed_objects_do_not_vanish():
    """Only the third cube is found: no pair can be compared, two relations are missed."""
    found = scene((2.45, 2.45, 0.5), category=["table"])
    record = relation_record(found, three())
    assert record.touching == RelationCounts(0, 0, 0, 0, 2, 0, 6)
    assert record.on_floor == RelationCounts(1, 0, 0, 0, 2, 0, 3)
    assert record.relative_yaw == YawErrors(0, 6, 0.0, 0.0)
    assert record.relative_yaw_wall.compared == 4
    scores = score_relations([record])
    assert scores["touching_f1"] is None
    assert scores["touching_f1_end_to_end"] == 0.0
    assert scores["on_floor_f1"] == 1.0
    assert scores["on_floor_tpr_end_to_end"] == pytest.approx(1 / 3)
    assert scores["on_floor_f1_end_to_end"] == pytest.approx(0.5)
    assert scores["relative_yaw_error_deg"] is None


def test_all_relations_in_one_pool():
    """Of three cubes the third is found, and rightly said to stand on the floor, in the room."""
    found = scene((2.45, 2.45, 0.5), category=["table"])
    record = relation_record(found, three())
    counts = [getattr(record, name) for name in YES_OR_NO if name != "farther_than"]
    hits = sum(one.true_positive for one in counts)
    wrong = sum(one.false_positive + one.invented for one in counts)
    lost = sum(one.false_negative + one.missed for one in counts)
    scores = score_relations([record])
    assert hits > 0 < lost
    assert scores["all_f1_end_to_end"] == pytest.approx(2 * hits / (2 * hits + wrong + lost))
    assert scores["all_compared"] == sum(sum(one[:4]) for one in counts)
    assert scores["all_f1"] == 1.0


def test_invented_objects_do_not_vanish():
    """The target has the first cube only; the prediction claims contact with a ghost."""
    target = scene((0, 0, 0.5))
    prediction = scene((0, 0, 0.5), (1, 0, 0.5))
    record = relation_record(prediction, target)
    assert record.touching == RelationCounts(0, 0, 0, 0, 0, 2, 0)
    assert record.on_floor == RelationCounts(1, 0, 0, 0, 0, 1, 1)
    scores = score_relations([record])
    assert scores["on_floor_precision"] == 1.0
    assert scores["on_floor_precision_end_to_end"] == 0.5
    assert scores["touching_f1_end_to_end"] == 0.0


def test_empty_scenes_count():
    nothing, truth = scene(), three()
    missed = relation_record(nothing, truth)
    assert missed.touching == RelationCounts(0, 0, 0, 0, 2, 0, 6)
    assert relation_record(replace(nothing, relations=None), truth) == missed
    assert fidelity_record(nothing, truth) == missed
    empty = relation_record(nothing, nothing)
    assert {getattr(empty, name) for name in YES_OR_NO} == {RelationCounts(*[0] * 7)}
    assert relation_record(truth, nothing).on_floor == RelationCounts(0, 0, 0, 0, 0, 3, 0)
    assert fidelity_record(nothing) == empty
    single = scene((0, 0, 0.5))
    assert relation_record(single, single).touching == RelationCounts(*[0] * 7)


def test_scores_without_entries_are_none_and_the_rest_is_json():
    scores = score_relations([relation_record(scene(), scene())])
    named = {name: scores[f"{name}_f1"] for name in YES_OR_NO}
    assert set(named.values()) == {None}
    assert {scores[f"{name}_error_deg"] for name in TURNS} == {None}
    json.dumps(scores, allow_nan=False)
    json.dumps(relation_record(three(), three()).as_dict(), allow_nan=False)
    with pytest.raises(ValueError, match="records"):
        score_relations([])


def test_a_false_alarm_without_any_relation_has_f1_zero():
    target = scene((0, 0, 0.5), (2, 0, 0.5))
    claims = torch.tensor([[0.0, 0.9], [0.9, 0.0]])
    scores = score_relations([relation_record(claiming(target, touching=claims), target)])
    assert scores["touching_f1"] == 0.0
    assert scores["touching_tpr"] is None


def bins(*index: int) -> torch.Tensor:
    """Return n x n x 8 scores that say the same bin for both directions of two objects."""
    score = torch.zeros(2, 2, 8)
    score[0, 1, index[0]], score[1, 0, index[1]] = 0.4, 0.4
    return score


def test_rotation_errors_wrap_and_are_measured_in_bins_and_exactly():
    """True difference 170 degrees, bin -180; claimed are -135 and +180."""
    target = scene((0, 0, 0.5), (2, 0, 0.5), yaw=[0.0, math.radians(170)])
    claimed = claiming(target, relative_yaw=bins(1, 0))
    record = relation_record(claimed, target)
    compared, in_target, bin_error, error = record.relative_yaw
    assert (compared, in_target) == (2, 2)
    assert bin_error == pytest.approx(45 + 0, abs=1e-4)
    assert error == pytest.approx(55 + 10, abs=1e-3)
    scores = score_relations([record])
    assert scores["relative_yaw_error_deg"] == pytest.approx(32.5, abs=1e-3)


def test_a_relative_yaw_without_scores_is_a_random_guess():
    target = scene((0, 0, 0.5), (2, 0, 0.5))
    silent = claiming(target, relative_yaw=torch.zeros(2, 2, 8))
    record = relation_record(silent, target)
    assert record.relative_yaw == YawErrors(2, 2, 180.0, 180.0)


def test_a_random_guess_has_ninety_degrees():
    away = torch.rad2deg(torch.tensor(RELATIVE_YAW_BINS).abs())
    assert float(away.mean()) == pytest.approx(RANDOM_YAW_ERROR_DEG)
    rng = np.random.default_rng(0)
    room = sample_room(rng, objects=20)
    guess = torch.from_numpy(rng.random((20, 20, 8))).float()
    scores = score_relations([relation_record(claiming(room, relative_yaw=guess), room)])
    found = scores["relative_yaw_error_deg"]
    assert found == pytest.approx(90, abs=8)


def test_walls_are_those_of_the_predicted_layout():
    """The target stands at wall 1 of its room; the predicted room is wider and turned by a wall."""
    target = scene((2.45, 0, 0.5))
    assert relations_of(target).touching_wall[0].tolist() == [0, 1, 0, 0]
    turned = replace(ROOM, floor_polygon=ROOM.floor_polygon.roll(-1, 0))
    renamed = relation_record(scene((2.45, 0, 0.5), layout=turned), target)
    assert renamed.touching_wall == RelationCounts(1, 0, 3, 0, 0, 0, 4)
    assert renamed.relative_yaw_wall.bin_error_deg == 0
    wide = replace(ROOM, floor_polygon=1.2 * ROOM.floor_polygon)
    away = relation_record(scene((2.45, 0, 0.5), layout=wide), target)
    assert away.touching_wall == RelationCounts(0, 0, 4, 0, 0, 0, 4)
    low = relation_record(scene((2.45, 0, 0.5), layout=replace(ROOM, ceiling_height=1.05)), target)
    assert low.under_ceiling.true_positive == 1


def test_the_same_layout_keeps_the_targets_own_relations():
    """Labels of a data set are used as they are, also where the boxes say otherwise."""
    target = claiming(scene((2.45, 0, 0.5)), touching_wall=torch.zeros(1, 4))
    assert relation_record(scene((2.45, 0, 0.5)), target).touching_wall.false_positive == 1
    derived = relation_record(scene((2.45, 0, 0.5)), replace(target, relations=None))
    assert derived.touching_wall.true_positive == 1


def test_fidelity_is_of_the_boxes_and_not_of_the_scores():
    """The scores are right, the boxes 0.3 m apart."""
    boxes = scene((0, 0, 0.5), (1.3, 0, 0.5), (2.45, 2.45, 0.5))
    prediction = replace(boxes, relations=three().relations)
    assert relation_record(prediction, three()).touching.true_positive == 2
    assert fidelity_record(prediction, three()).touching == RelationCounts(0, 0, 4, 2, 0, 0, 6)
    assert fidelity_record(replace(prediction, relations=None), three()).touching[3] == 2


def test_fidelity_grows_boxes_for_pairs_too():
    """A gap of 8 cm is contact, as in the labels: the release's mix-up would miss it."""
    prediction = scene((0, 0, 0.5), (1.08, 0, 0.5), (2.45, 2.45, 0.5))
    assert fidelity_record(prediction, three()).touching.true_positive == 2


def test_boxes_are_held_to_their_own_claims():
    boxes = scene((0, 0, 0.5), (1.3, 0, 0.5), yaw=[0.0, math.radians(100)])
    claims = torch.tensor([[0.0, 0.9], [0.9, 0.0]])
    prediction = claiming(boxes, touching=claims, relative_yaw=bins(6, 2))
    record = fidelity_record(prediction)
    assert record.touching == RelationCounts(0, 0, 0, 2, 0, 0, 2)
    assert record.relative_yaw[:2] == (2, 2)
    assert record.relative_yaw.bin_error_deg == pytest.approx(0.0, abs=1e-4)
    assert record.relative_yaw.error_deg == pytest.approx(20.0, abs=1e-3)


def test_missing_or_foreign_relations_are_refused():
    bare = replace(three(), relations=None)
    with pytest.raises(ValueError, match=r"prediction\.relations"):
        relation_record(bare, three())
    with pytest.raises(ValueError, match=r"prediction\.relations"):
        fidelity_record(bare)
    with pytest.raises(ValueError, match="3 objects and 4 walls"):
        relation_record(replace(three(), relations=relations_of(scene((0, 0, 0.5)))), three())


def noisy(seed: int, objects: int) -> tuple[Scene, Scene]:
    rng = np.random.default_rng(seed)
    truth = sample_room(rng, objects=objects)
    estimate = perturb_scene(truth, rng, PerturbNoise(layout=0.05))
    return replace(estimate, relations=corrupt_relations(relations_of(truth), rng)), truth


def picked(objects: Objects, order: torch.Tensor) -> Objects:
    return replace(
        objects,
        boxes=objects.boxes[order],
        category=objects.category[order],
        score=objects.score[order],
        id=(),
    )


def permuted(room: Scene, order: torch.Tensor) -> Scene:
    """Return the scene with its objects in another order."""
    own = relations_of(room)
    changed = {}
    for field in dataclasses.fields(Relations):
        values = getattr(own, field.name)[order]
        among = field.name in {"touching", "farther_than", "relative_yaw"}
        changed[field.name] = values[:, order] if among else values
    return replace(room, objects=picked(room.objects, order), relations=Relations(**changed))


@settings(max_examples=5)
@given(seed=st.integers(0, 999), objects=st.integers(0, 10))
def test_the_order_of_objects_does_not_matter(seed: int, objects: int):
    prediction, target = noisy(seed, objects)
    generator = torch.Generator().manual_seed(seed)
    shuffled = permuted(prediction, torch.randperm(objects, generator=generator))
    other = permuted(target, torch.randperm(objects, generator=generator))
    for record, again in (
        (relation_record(prediction, target), relation_record(shuffled, other)),
        (fidelity_record(prediction, target), fidelity_record(shuffled, other)),
        (fidelity_record(prediction), fidelity_record(shuffled)),
    ):
        for name in (*YES_OR_NO, *TURNS):
            assert getattr(again, name) == pytest.approx(getattr(record, name), abs=1e-3)


@settings(max_examples=5)
@given(seed=st.integers(0, 999), quarter=st.integers(1, 3))
def test_turning_the_world_does_not_matter(seed: int, quarter: int):
    """Both scenes turned; by quarters, so that float32 coordinates stay what they are."""
    prediction, target = noisy(seed, 8)
    cos, sin = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarter]
    turn = torch.tensor([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]).double()

    def turned(room: Scene) -> Scene:
        boxes = room.objects.boxes
        boxes = OrientedBoxes(
            boxes.centre.double() @ turn.T,
            boxes.size.double(),
            boxes.yaw.double() + quarter * math.pi / 2,
        )
        polygon = room.layout.floor_polygon.double() @ turn[:2, :2].T
        return replace(
            room,
            objects=replace(room.objects, boxes=boxes),
            layout=replace(room.layout, floor_polygon=polygon),
        )

    for compare in (relation_record, fidelity_record):
        record, again = compare(prediction, target), compare(turned(prediction), turned(target))
        for name in (*YES_OR_NO, *TURNS):
            assert getattr(again, name) == pytest.approx(getattr(record, name), abs=1e-3)


def test_counts_add_up_and_pool():
    pairs = [noisy(seed, objects) for seed, objects in enumerate((0, 1, 6, 15))]
    records = [relation_record(prediction, target) for prediction, target in pairs]
    for record, (_, target) in zip(records, pairs, strict=True):
        n = len(target.objects.boxes)
        walls = len(target.layout.floor_polygon)
        assert record.touching.in_target == n * (n - 1)
        assert record.touching_wall.in_target == n * walls
        for name in YES_OR_NO:
            counts = getattr(record, name)
            assert min(counts) >= 0
            assert sum(counts[:4]) <= counts.in_target
    scores = score_relations(records)
    hit, false_alarm, _, overlooked, missed, invented, _ = (
        sum(record.touching_wall[k] for record in records) for k in range(7)
    )
    assert scores["touching_wall_f1"] == pytest.approx(hit / (hit + (false_alarm + overlooked) / 2))
    assert scores["touching_wall_f1_end_to_end"] == pytest.approx(
        hit / (hit + (false_alarm + overlooked + missed + invented) / 2)
    )


def test_matched_counts_agree_with_a_plain_loop():
    prediction, target = noisy(7, 12)
    from panoscene.eval._matching import match_objects  # noqa: PLC0415 - the oracle's only need

    match = match_objects(prediction.objects, target.objects).tolist()
    claims = relations_of(prediction).touching
    boxes = target.objects.boxes
    truth = relations_from_boxes(boxes, prediction.layout, inside="any_corner").touching
    wanted = [0, 0, 0, 0]
    for a, first in enumerate(match):
        for b, second in enumerate(match):
            if a == b or first < 0 or second < 0:
                continue
            claim, holds = bool(claims[a, b] > 0.5), bool(truth[first, second] > 0.5)
            wanted[[[2, 3], [1, 0]][claim][holds]] += 1
    assert relation_record(prediction, target).touching[:4] == tuple(wanted)
