"""Samples of the relation graph network: exact under every augmentation."""

import functools
import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from panoscene.data import (
    ContextAugmentation,
    ContextScene,
    EncodedObjects,
    EstimateRecord,
    collate_context,
    context_sample,
    estimates_of,
    noise_of,
    noisy_output,
    plain_context_sample,
    read_context_scenes,
    targets_of,
)
from panoscene.data._context_noise import OutputNoise
from panoscene.geometry import decode_box_code, wrap_angle
from panoscene.models import Edition
from panoscene.models.pose import PoseOutput
from panoscene.models.shape import CONFIGS as SHAPES
from panoscene.models.shape import ShapeConfig, analytic_code, blob_centres, elements_from_code
from panoscene.scene import MEAN_SIZE, Layout, Relations, Scene, relations_from_boxes
from panoscene.synth.dataset import open_dataset

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
EXACT = ContextAugmentation(
    detections=0.0, moved=0.0, dropped=0.0, spurious=0, most_objects=100, unsure=0.0,
    true_layout=1.0, wall=0.0, shift=0.0, blind=0.0,
)  # fmt: skip
FEATURES, CODES = 4, 320


def encoded(scene: Scene, target: Tensor, seed: int = 0) -> EncodedObjects:
    """Return objects whose first feature is which object they show, negative in the mirror."""
    generator = torch.Generator().manual_seed(seed)
    n = len(target)
    appearance = torch.rand(2, n, FEATURES, generator=generator)
    appearance[..., 0] = torch.stack([target + 1.0, -target - 1.0])
    objects = scene.objects
    known = target.clamp(min=0)
    return EncodedObjects(
        bfov=objects.bfov[known],
        category=objects.category[known],
        score=torch.rand(n, generator=generator),
        target=target,
        appearance=appearance,
        shape_code=torch.randn(2, n, CODES, generator=generator),
    )


def source(scene: Scene, layout: Layout | None = None) -> ContextScene:
    every = torch.arange(len(scene.objects.category))
    found = encoded(scene, torch.where(every % 3 == 0, -1, every), seed=1)
    record = EstimateRecord(found, encoded(scene, every), (encoded(scene, every, 2),), layout)
    return ContextScene(open_dataset(SAMPLES)[0], scene, record)


@functools.cache
def all_scenes() -> list[ContextScene]:
    return [source(item.scene()) for item in open_dataset(SAMPLES)[:3]]


@pytest.fixture
def scenes() -> list[ContextScene]:
    return all_scenes()


def shown(appearance: Tensor) -> Tensor:
    """Return which object each one shows."""
    return appearance[..., 0].abs().round().long() - 1


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_turned_and_mirrored_worlds_keep_everything_exactly(seed: int) -> None:
    scenes = all_scenes()
    scene = scenes[0].scene
    sample = context_sample(
        scenes, 0, MEAN_SIZE, torch.Generator().manual_seed(seed), augmentation=EXACT
    )
    order = shown(sample.appearance)
    mirrored = bool(sample.appearance[0, 0] < 0)
    sign = -1.0 if mirrored else 1.0
    assert order.sort().values.tolist() == list(range(len(scene.objects.category)))
    boxes = decode_box_code(sample.code, sample.bfov, sample.mean_size, sample.camera_height)
    true = scene.objects.boxes[order]
    turn = wrap_angle(sample.bfov[:, 0] - sign * scene.objects.bfov[order, 0])
    turn = turn[0] + wrap_angle(turn - turn[0])
    assert torch.allclose(turn, turn[0].expand_as(turn), atol=1e-5)
    # the same turn for BFoVs, boxes and walls: lon runs clockwise, yaw does not
    cos, sin = turn[0].cos(), turn[0].sin()
    matrix = torch.tensor([[cos * sign, sin], [-sin * sign, cos]])
    assert torch.allclose(boxes.centre[:, :2], true.centre[:, :2] @ matrix.T, atol=2e-4)
    assert torch.allclose(boxes.centre[:, 2], true.centre[:, 2], atol=2e-4)
    assert torch.allclose(boxes.size, true.size, atol=1e-5)
    yaw = wrap_angle(boxes.yaw - (sign * true.yaw - turn[0]))
    assert torch.allclose(yaw, torch.zeros_like(yaw), atol=1e-4)
    corners = scene.layout.floor_polygon @ matrix.T
    corners = corners.flip(0) if mirrored else corners
    assert torch.allclose(sample.layout.floor_polygon, corners, atol=1e-4)
    _same_relations(sample.relations, scene, order, mirrored=mirrored)


def _same_relations(found: Relations, scene: Scene, order: Tensor, *, mirrored: bool) -> None:
    """Relations of the augmented boxes are the augmented relations, but for rounding."""
    layout, height = scene.layout, scene.panorama.camera_height
    boxes = scene.objects.boxes[order]
    strict, loose = (
        relations_from_boxes(
            boxes, layout, height, tolerance=by, floor_tolerance=by, inside="any_corner"
        )
        for by in (0.0995, 0.1005)
    )
    walls, bins = torch.arange(len(layout.floor_polygon)), torch.arange(8)
    if mirrored:
        # corners run the other way round: the wall from i to i + 1 is now that from n - 2 - i
        walls, bins = (len(walls) - 2 - walls) % len(walls), (8 - bins) % 8
    for name in ("touching", "on_floor", "under_ceiling", "inside_room", "touching_wall"):
        pair = getattr(strict, name), getattr(loose, name)
        if name == "touching_wall":
            pair = pair[0][:, walls], pair[1][:, walls]
        sure = pair[0] == pair[1]
        assert sure.float().mean() > 0.9
        assert torch.equal(getattr(found, name)[sure], pair[0][sure]), name
    assert (found.farther_than != strict.farther_than).float().mean() < 0.01
    among = strict.relative_yaw[..., bins].argmax(-1)
    to_walls = strict.relative_yaw_wall[:, walls][..., bins].argmax(-1)
    for name, expected in (("relative_yaw", among), ("relative_yaw_wall", to_walls)):
        # a yaw between two bins may fall into either
        apart = (getattr(found, name).argmax(-1) - expected) % 8
        assert bool(((apart <= 1) | (apart == 7)).all()), name
        assert (apart != 0).float().mean() < 0.1, name


def test_the_same_generator_gives_the_same_sample(scenes: list[ContextScene]) -> None:
    first, second = (
        collate_context([context_sample(scenes, 1, MEAN_SIZE, torch.Generator().manual_seed(7))])
        for _ in range(2)
    )
    assert first.keys() == second.keys()
    assert all(torch.equal(first[name], second[name]) for name in first)


def test_targets_are_relations_in_the_layout_that_is_told(scenes: list[ContextScene]) -> None:
    scene = scenes[0].scene
    wide = Layout(scene.layout.floor_polygon * 1.3, ceiling_height=scene.layout.ceiling_height + 1)
    one = source(scene, wide)
    change = EXACT.model_copy(update={"true_layout": 0.0})
    for seed in range(4):
        generator = torch.Generator().manual_seed(seed)
        sample = context_sample([one], 0, MEAN_SIZE, generator, augmentation=change)
        boxes = decode_box_code(sample.code, sample.bfov, sample.mean_size, sample.camera_height)
        told = relations_from_boxes(boxes, sample.layout, sample.camera_height, inside="any_corner")
        assert math.isclose(sample.layout.ceiling_height, wide.ceiling_height, rel_tol=1e-6)
        for name in ("touching", "touching_wall", "on_floor", "inside_room"):
            # decoding rounds, so a box at the edge of a tolerance may fall on either side
            assert (getattr(told, name) != getattr(sample.relations, name)).float().mean() < 0.06
        assert not bool(sample.relations.under_ceiling.any())


def test_what_is_not_matched_has_no_targets(scenes: list[ContextScene]) -> None:
    change = EXACT.model_copy(update={"detections": 1.0, "spurious": 3})
    for seed in range(6):
        generator = torch.Generator().manual_seed(seed)
        sample = context_sample(scenes, 0, MEAN_SIZE, generator, augmentation=change)
        unknown = ~sample.matched
        assert bool(unknown.any())
        assert not bool(sample.relations.touching[unknown].any())
        assert not bool(sample.relations.touching[:, unknown].any())
        assert not bool(sample.relations.relative_yaw_wall[unknown].any())
        # what is known has exactly one relative yaw to every other thing that is known
        known = sample.relations.relative_yaw[sample.matched][:, sample.matched].sum(-1)
        assert torch.equal(known, 1 - torch.eye(len(known)))
        assert bool((sample.relations.relative_yaw_wall[sample.matched].sum(-1) == 1).all())


def test_objects_are_left_out_but_never_all(scenes: list[ContextScene]) -> None:
    whole = len(scenes[0].scene.objects.category)
    change = ContextAugmentation(dropped=1.0, spurious=0, most_objects=6)
    counts = [
        len(
            context_sample(
                scenes, 0, MEAN_SIZE, torch.Generator().manual_seed(seed), augmentation=change
            ).category
        )
        for seed in range(12)
    ]
    assert min(counts) >= 1
    assert max(counts) <= min(6, whole)
    assert len(set(counts)) > 1


def test_batches_are_padded_and_say_so(scenes: list[ContextScene]) -> None:
    few = plain_context_sample(
        scenes[0],
        scenes[0].record.true,
        Layout(scenes[0].scene.layout.floor_polygon[:3]),
        MEAN_SIZE,
    )
    many = plain_context_sample(scenes[1], scenes[1].record.true, scenes[1].scene.layout, MEAN_SIZE)
    batch = collate_context([few, many])
    assert batch["valid"].sum(-1).tolist() == [len(few.category), len(many.category)]
    assert batch["wall_valid"][0].sum() == 3
    assert torch.equal(batch["polygon"][0, 2:], few.layout.floor_polygon[2:].expand_as(
        batch["polygon"][0, 2:]
    ))  # fmt: skip
    assert not bool(batch["matched"][~batch["valid"]].any())
    assert bool((batch["bfov"][..., 2:] > 0).all())
    target = targets_of(batch)
    n = len(few.category)
    assert torch.equal(target.relations.touching_wall[0, :n, :3], few.relations.touching_wall)
    assert not bool(target.relations.touching_wall[0, n:].any())
    output = _output(batch["valid"].shape)
    estimates = estimates_of(batch, output, SHAPES["compact"])
    assert estimates.blob_centre.shape[-2:] == (48, 3)
    assert estimates_of(batch, output).blob_centre.shape[-2] == 0


def _output(shape: tuple[int, ...]) -> PoseOutput:
    generator = torch.Generator().manual_seed(3)
    return PoseOutput(*(torch.randn(*shape, k, generator=generator) for k in (2, 6, 6, 6, 6, 3)))


def test_noise_moves_boxes_by_what_it_says() -> None:
    output = _output((1, 2))
    none = OutputNoise.none(2)
    batched = OutputNoise(*(getattr(none, name)[None] for name in OutputNoise.__slots__))
    same = noisy_output(output, batched)
    assert torch.equal(same.distance_residual, output.distance_residual)
    assert torch.equal(same.yaw_logit, output.yaw_logit)
    bfov, one = torch.tensor([[[0.0, -0.1, 0.3, 0.3]] * 2]), torch.ones(1, 2, 3)

    def decoded(what: PoseOutput) -> tuple[Tensor, Tensor]:
        boxes = decode_box_code(what.code(), bfov, one, 1.6)
        ray = boxes.centre - torch.tensor([0.0, 0.0, 1.6])
        return ray.norm(dim=-1), boxes.yaw

    distance, yaw = decoded(output)
    moved = replace(
        batched, distance=torch.full((1, 2), 0.1), yaw=torch.full((1, 2), 0.2),
        turned=torch.tensor([[False, True]]),
    )  # fmt: skip
    new_distance, new_yaw = decoded(noisy_output(output, moved))
    assert torch.allclose(new_distance, distance * 1.1, atol=1e-5)
    change = wrap_angle(new_yaw - yaw + 0.2)
    assert torch.allclose(change.abs(), torch.tensor([[0.0, math.pi]]), atol=1e-5)
    found = noise_of({f"noise_{name}": getattr(batched, name) for name in OutputNoise.__slots__})
    assert torch.equal(found.size, batched.size)


@pytest.mark.parametrize("edition", ["compact", "paper"])
def test_blobs_are_where_the_shape_network_has_them(edition: Edition) -> None:
    config: ShapeConfig = SHAPES[edition]
    code = torch.randn(3, config.code, generator=torch.Generator().manual_seed(0))
    size = torch.tensor([[1.0, 1.0, 1.0], [2.0, 1.0, 0.5], [0.1, 0.4, 0.2]])
    found = blob_centres(analytic_code(code, config), size, config)
    centre = elements_from_code(code, config).centre
    if config.frame == "longest":
        # the field's unit is the longest side, the box's each side for itself
        centre = centre * (size.amax(-1)[:, None] / size)[:, None]
    assert torch.allclose(found, centre, atol=1e-6)


def test_scenes_without_objects_or_records_are_left_out() -> None:
    items = open_dataset(SAMPLES)[:]
    record = source(items[0].scene()).record
    assert [one.item.name for one in read_context_scenes(items, {items[0].name: record})] == [
        items[0].name
    ]
