"""Counts, volumes and falls on rooms that can be worked by hand, and what must not matter."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from panoscene.eval._matched_recall import (
    highest_recall,
    plausibility_at_recall,
    score_threshold_at_recall,
)
from panoscene.eval._plausibility import (
    PlausibilityRecord,
    plausibility_record,
    plausibility_records,
    score_plausibility,
)
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Scene, objects_from_boxes, scene_from_boxes
from panoscene.synth import PerturbNoise, perturb_scene, sample_room

ROOM = Layout(torch.tensor([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]), 0.0, 2.5)


def scene(
    *boxes: tuple[Sequence[float], Sequence[float]],
    yaw: Sequence[float] | None = None,
    category: Sequence[str] | None = None,
    layout: Layout = ROOM,
) -> Scene:
    """Return a room with boxes of given centre and size."""
    n = len(boxes)
    placed = OrientedBoxes(
        torch.tensor([centre for centre, _ in boxes], dtype=torch.float32).reshape(n, 3),
        torch.tensor([size for _, size in boxes], dtype=torch.float32).reshape(n, 3),
        torch.zeros(n) if yaw is None else torch.tensor(yaw, dtype=torch.float32),
    )
    objects = objects_from_boxes(placed, category or ["chair"] * n, camera_height=1.6)
    return scene_from_boxes(objects, layout, camera_height=1.6)


CUBE = (1.0, 1.0, 1.0)


def test_a_scene_without_objects_is_all_zeros():
    record = plausibility_record(scene())
    assert set(record.as_dict().values()) == {0}
    assert plausibility_records([]) == ()


def test_one_good_object_is_all_zeros_but_itself():
    record = plausibility_record(scene(((0, 2, 0.5), CUBE)))
    assert record == PlausibilityRecord(1, 0, 0, 0, 0, 0, 0, 1.0, 0.0, 0, 0, 0, 0.0)


@pytest.mark.parametrize(("overlap", "collides"), [(0.08, 0), (0.12, 1)])
def test_pairs_may_overlap_by_ten_centimetres(overlap: float, collides: int):
    record = plausibility_record(scene(((0, 1, 0.5), CUBE), ((1 - overlap, 1, 0.5), CUBE)))
    assert (record.pairs, record.paper_colliding_pairs) == (1, collides)
    assert record.paper_hitting_object == 2 * collides


def test_pairs_and_objects_are_counted_apart():
    """Three boxes in a row, the middle one in both others."""
    row = scene(*[((x, 1, 0.5), CUBE) for x in (-0.8, 0, 0.8)], ((0, -2, 0.5), CUBE))
    record = plausibility_record(row)
    assert record.pairs == 6
    assert record.paper_colliding_pairs == 2
    assert record.paper_hitting_object == 3


@pytest.mark.parametrize(("past", "hits"), [(0.08, 0), (0.12, 1)])
def test_room_may_be_left_by_ten_centimetres(past: float, hits: int):
    wall = plausibility_record(scene(((3 - 0.5 + past, 0, 0.5), CUBE)))
    assert wall.paper_hitting_wall == hits
    assert wall.out_of_room_volume == pytest.approx(past, abs=1e-5)
    assert wall.partly_outside == 1  # more than 5 % already
    floor = plausibility_record(scene(((0, 1, 0.5 - past), CUBE)))
    assert (floor.paper_hitting_floor, floor.paper_hitting_ceiling) == (hits, 0)
    ceiling = plausibility_record(scene(((0, 1, 2.0 + past), CUBE)))
    assert (ceiling.paper_hitting_floor, ceiling.paper_hitting_ceiling) == (0, hits)
    assert ceiling.out_of_room_volume == pytest.approx(past, abs=1e-5)


def test_an_object_entirely_outside_hits_no_wall():
    """The loophole of the paper's count; the other numbers see it."""
    inside_wall = plausibility_record(scene(((3.6, 0, 0.5), CUBE)))
    assert inside_wall.paper_hitting_wall == 0
    assert (inside_wall.outside, inside_wall.partly_outside) == (1, 1)
    assert inside_wall.out_of_room_volume == pytest.approx(1.0)
    half_way = plausibility_record(scene(((3.2, 0, 0.5), CUBE)))
    assert (half_way.paper_hitting_wall, half_way.outside) == (1, 0)


def test_a_wall_that_runs_on_behind_a_corner_is_not_hit_by_padding():
    """Rooms of 4 and 6 corners in one batch: the 4-corner one is padded."""
    el = Layout(torch.tensor([[-3, -3], [3, -3], [3, 0], [0, 0], [0, 3], [-3, 3]]).float())
    corner = (((-3.06 + 0.5, 2.97 - 0.5, 0.5), CUBE),)
    both = plausibility_records([scene(*corner), scene(*corner, layout=el), scene()])
    assert both[0] == both[1]
    assert both[0].paper_hitting_wall == 0
    assert both[2].objects == 0


def test_a_thin_carpet_hits_the_floor_in_the_papers_count():
    """Extents below a centimetre grow to one; this is how the paper's number comes about."""
    carpet = scene(((0, 1, 0.004), (2, 1.5, 0.008)))
    assert plausibility_record(carpet).paper_hitting_floor == 1
    thick = scene(((0, 1, 0.006), (2, 1.5, 0.012)))
    assert plausibility_record(thick).paper_hitting_floor == 0


def test_a_tilted_pair_needs_its_own_axes():
    """Bounding boxes overlap, the boxes do not."""
    boxes = (((0, 1, 0.5), (2.0, 0.2, 1.0)), ((0.9, 1.9, 0.5), (2.0, 0.2, 1.0)))
    apart = plausibility_record(scene(*boxes, yaw=[math.pi / 4] * 2))
    crossed = plausibility_record(scene(*boxes, yaw=[math.pi / 4, -math.pi / 4]))
    assert apart.paper_colliding_pairs == 1  # in line with each other
    assert crossed.paper_colliding_pairs == 0


def test_another_layout_can_judge():
    small = replace(ROOM, floor_polygon=ROOM.floor_polygon / 2)
    room = scene(((1.5, 0, 0.5), CUBE))
    assert plausibility_record(room).paper_hitting_wall == 0
    record = plausibility_record(room, small)
    assert record.paper_hitting_wall == 1
    assert record.out_of_room_volume == pytest.approx(0.5)


def test_floating_boxes_fall_to_the_highest_support_below():
    table = ((0, 1, 0.4), (1.0, 1.0, 0.8))
    lamp = ((0, 1, 1.5), (0.3, 0.3, 0.4))  # bottom at 1.3, half a metre above the table
    ghost = ((2, -1, 1.5), (0.3, 0.3, 0.4))  # bottom at 1.3, nothing below
    record = plausibility_record(scene(table, lamp, ghost))
    assert record.floating == 2
    assert record.floating_distance == pytest.approx(0.5 + 1.3, abs=1e-5)


@pytest.mark.parametrize(
    "held",
    [
        ((0, 0, 0.55), CUBE),  # 5 cm above the floor
        ((0, 0, 1.95), CUBE),  # 5 cm below the ceiling
        ((2.45, 0, 1.2), CUBE),  # 5 cm from a wall
    ],
)
def test_the_room_holds_objects_within_tolerance(held: tuple[Sequence[float], Sequence[float]]):
    assert plausibility_record(scene(held)).floating == 0


def test_a_shelf_holds_what_is_beside_it_and_chains_count():
    shelf = ((0, 1, 1.0), (0.5, 0.5, 2.0))
    books = [((0.35 + 0.2 * k, 1, 1.5), (0.2, 0.2, 0.3)) for k in range(4)]
    assert plausibility_record(scene(shelf, *books)).floating == 0
    assert plausibility_record(scene(*books)).floating == 4


def test_floating_boxes_do_not_hold_each_other():
    """A pile in the air: each falls to the floor, not to the one below."""
    pile = scene(((0, 1, 1.0), (1, 1, 0.4)), ((0, 1, 1.4), (0.5, 0.5, 0.4)))
    record = plausibility_record(pile)
    assert record.floating == 2
    assert record.floating_distance == pytest.approx(0.8 + 1.2, abs=1e-5)


def test_what_stands_on_top_does_not_hold():
    """A cabinet on the wall above a floating box: near its top, but not under it."""
    cabinet = ((0, 2.75, 2.0), (1.0, 0.5, 0.8))
    box = ((0, 2.65, 1.4), (0.2, 0.2, 0.3))
    record = plausibility_record(scene(cabinet, box))
    assert record.floating == 1
    assert record.floating_distance == pytest.approx(1.25, abs=1e-5)


def test_ground_truth_rooms_are_plausible():
    rng = np.random.default_rng(5)
    rooms = [sample_room(rng, objects=n) for n in (0, 1, 8, 20, 30)]
    for room, record in zip(rooms, plausibility_records(rooms), strict=True):
        carpets = int((room.objects.boxes.size[:, 2] < 0.01).sum())
        assert record.paper_hitting_floor <= carpets
        found = replace(record, objects=0, pairs=0, box_volume=0.0, paper_hitting_floor=0)
        assert found.out_of_room_volume < 1e-4
        assert set(replace(found, out_of_room_volume=0.0).as_dict().values()) == {0}


def noisy_room(seed: int, objects: int) -> Scene:
    rng = np.random.default_rng(seed)
    return perturb_scene(sample_room(rng, objects=objects), rng, PerturbNoise(layout=0.05))


def in_float64(room: Scene) -> Scene:
    boxes = room.objects.boxes
    boxes = OrientedBoxes(boxes.centre.double(), boxes.size.double(), boxes.yaw.double())
    layout = replace(room.layout, floor_polygon=room.layout.floor_polygon.double())
    return replace(room, objects=replace(room.objects, boxes=boxes), layout=layout)


def close(a: PlausibilityRecord, b: PlausibilityRecord) -> bool:
    return list(a.as_dict().values()) == pytest.approx(list(b.as_dict().values()), abs=1e-6)


@settings(max_examples=6)
@given(seed=st.integers(0, 999), objects=st.integers(0, 12), turn=st.floats(-3.1, 3.1))
def test_turning_the_world_and_renaming_objects_change_nothing(
    seed: int, objects: int, turn: float
):
    room = in_float64(noisy_room(seed, objects))
    boxes = room.objects.boxes
    cos, sin = math.cos(turn), math.sin(turn)
    world = torch.tensor([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    order: Tensor = torch.from_numpy(np.random.default_rng(seed).permutation(objects))
    turned = OrientedBoxes(boxes.centre @ world.T, boxes.size, boxes.yaw + turn)[order]
    polygon = room.layout.floor_polygon @ world[:2, :2].T
    other = replace(
        room,
        objects=replace(room.objects, boxes=turned),
        layout=replace(room.layout, floor_polygon=polygon),
    )
    assert close(plausibility_record(room), plausibility_record(other))


def test_many_scenes_at_once_are_as_one_by_one():
    rooms = [noisy_room(seed, objects) for seed, objects in enumerate((7, 0, 25, 1, 12, 3))]
    together = plausibility_records(rooms)
    for room, record in zip(rooms, together, strict=True):
        assert close(plausibility_record(room), record)


def test_scores_are_means_over_scenes_and_rates_of_sums():
    colliding = plausibility_record(scene(((0, 1, 0.5), CUBE), ((0.5, 1, 0.5), CUBE)))
    floating = plausibility_record(scene(((0, 1, 1.5), (1, 1, 0.5)), *[((0, -2, 0.5), CUBE)] * 2))
    scores = score_plausibility([colliding, floating, plausibility_record(scene())])
    assert scores["scenes"] == 3
    assert scores["paper_colliding_pairs"] == pytest.approx(2 / 3)
    assert scores["paper_hitting_object"] == pytest.approx(4 / 3)
    assert scores["collision_rate"] == pytest.approx(2 / 4)
    assert scores["floating"] == pytest.approx(1 / 3)
    assert scores["floating_share"] == pytest.approx(1 / 5)
    assert scores["floating_distance"] == pytest.approx(1.25 / 5)
    assert scores["out_of_room_share"] == pytest.approx(0, abs=1e-6)


def test_rates_of_nothing_are_none_and_no_records_an_error():
    scores = score_plausibility([plausibility_record(scene())])
    assert scores["paper_colliding_pairs"] == 0
    assert scores["collision_rate"] is None
    assert scores["out_of_room_share"] is None
    with pytest.raises(ValueError, match="records"):
        score_plausibility([])


def test_nonsense_is_refused_by_name():
    good = scene(((0, 1, 0.5), CUBE))
    bad = replace(
        good,
        objects=replace(
            good.objects, boxes=replace(good.objects.boxes, yaw=torch.tensor([math.nan]))
        ),
    )
    with pytest.raises(ValueError, match=r"scene 1: boxes\.yaw"):
        plausibility_records([good, bad])
    flat = replace(ROOM, ceiling_height=0.0)
    with pytest.raises(ValueError, match=r"layout\.ceiling_height"):
        plausibility_record(good, flat)
    clockwise = replace(ROOM, floor_polygon=ROOM.floor_polygon.flip(0))
    with pytest.raises(ValueError, match=r"layout\.floor_polygon"):
        plausibility_record(good, clockwise)


def scored(room: Scene, *score: float) -> Scene:
    return replace(room, objects=replace(room.objects, score=torch.tensor(score)))


def recall_example() -> tuple[list[Scene], list[Scene]]:
    """Return two scenes with 4 targets: 3 found, one false object that collides."""
    first = scene(((0, 1, 0.5), CUBE), ((2, 1, 0.5), CUBE))
    second = scene(((0, 1, 0.5), CUBE), ((2, 1, 0.5), CUBE))
    seen = scored(scene(((0, 1, 0.5), CUBE), ((2, 1, 0.5), CUBE)), 0.9, 0.4)
    # the second collides with the first and is on no target of its own
    doubled = scored(scene(((0, 1, 0.5), CUBE), ((0.1, 1, 0.5), CUBE)), 0.8, 0.6)
    return [seen, doubled], [first, second]


def test_threshold_is_the_highest_that_reaches_the_recall():
    predictions, targets = recall_example()
    found, wanted = [s.objects for s in predictions], [s.objects for s in targets]
    assert highest_recall(found, wanted) == 0.75
    for recall, threshold in ((0.25, 0.9), (0.3, 0.8), (0.5, 0.8), (0.75, 0.4)):
        assert score_threshold_at_recall(found, wanted, recall) == pytest.approx(threshold)
    assert score_threshold_at_recall(found, wanted, 0.76) is None
    assert score_threshold_at_recall(found, wanted, 0.0) == math.inf
    with pytest.raises(ValueError, match="recall"):
        score_threshold_at_recall(found, wanted, 1.1)
    with pytest.raises(ValueError, match="targets"):
        highest_recall(found, wanted[:1])


def test_collisions_at_recall_count_what_is_above_the_threshold():
    predictions, targets = recall_example()
    half = plausibility_at_recall(predictions, targets, 0.5)
    assert half is not None
    assert half.recall == 0.5
    assert [record.objects for record in half.records] == [1, 1]
    most = plausibility_at_recall(predictions, targets, 0.75)
    assert most is not None
    assert [record.objects for record in most.records] == [2, 2]
    assert [record.paper_colliding_pairs for record in most.records] == [0, 1]
    assert plausibility_at_recall(predictions, targets, 1.0) is None


def test_scenes_that_keep_nothing_are_kept():
    predictions, targets = recall_example()
    result = plausibility_at_recall([*predictions, scene()], [*targets, scene()], 0.25)
    assert result is not None
    assert [record.objects for record in result.records] == [1, 0, 0]
    nothing = plausibility_at_recall([scene()], [scene()], 1.0)
    assert nothing is not None
    assert nothing.recall == 1.0
    empty = plausibility_at_recall([], [], 0.5)
    assert empty is not None
    assert empty.records == ()


def test_recall_at_the_threshold_is_that_of_a_new_matching():
    """Dropping low scores leaves the matches of the others alone."""
    rng = np.random.default_rng(3)
    targets = [sample_room(rng, objects=12) for _ in range(4)]
    predictions = [perturb_scene(room, rng) for room in targets]
    result = plausibility_at_recall(predictions, targets, 0.3)
    assert result is not None
    kept = []
    for room in predictions:
        mask = room.objects.score.double() >= result.threshold
        boxes = room.objects.boxes[mask]
        some = objects_from_boxes(
            boxes, ["chair"] * len(boxes), camera_height=1.6, score=room.objects.score[mask]
        )
        kept.append(replace(some, category=room.objects.category[mask]))
    again = highest_recall(kept, [room.objects for room in targets])
    assert again == pytest.approx(result.recall)
    assert 0.3 <= result.recall < 0.3 + 1 / 48
