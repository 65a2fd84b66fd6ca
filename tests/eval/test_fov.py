"""The field-of-view protocol: a partition of the objects, and a faithful way back."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from panoscene.arrange import ArrangementSettings, arrange
from panoscene.eval._fov import FOV_DEG, fov_sector, run_by_fov, split_by_fov
from panoscene.geometry import wrap_angle
from panoscene.scene import Detections, Relations, Scene, Shapes, box_mesh, select
from panoscene.synth import perturb_scene, sample_room


@pytest.fixture(scope="module")
def room() -> Scene:
    scene = sample_room(np.random.default_rng(4), objects=14)
    code = torch.arange(14.0)[:, None].expand(14, 5)
    mesh = tuple(box_mesh() if index % 2 else None for index in range(14))
    return replace(scene, objects=replace(scene.objects, shapes=Shapes(code, mesh)))


def assert_same_objects(a: Scene, b: Scene) -> None:
    one, other = a.objects, b.objects
    assert one.id == other.id
    for name in ("category", "score", "bfov", "distance_score", "yaw_score"):
        torch.testing.assert_close(getattr(one, name), getattr(other, name), rtol=0, atol=0)
    for name in ("centre", "size", "yaw"):
        torch.testing.assert_close(
            getattr(one.boxes, name), getattr(other.boxes, name), rtol=0, atol=0
        )
    assert one.shapes.mesh == other.shapes.mesh
    if one.shapes.code is not None or other.shapes.code is not None:
        torch.testing.assert_close(one.shapes.code, other.shapes.code, rtol=0, atol=0)


def relations_of(scene: Scene) -> Relations:
    assert scene.relations is not None
    return scene.relations


@given(
    st.lists(st.floats(-math.pi, math.pi, exclude_max=True), max_size=30),
    st.sampled_from(FOV_DEG),
    st.sampled_from([torch.float32, torch.float64]),
)
def test_every_lon_is_in_exactly_one_sector(
    lon: list[float], fov_deg: int, dtype: torch.dtype
) -> None:
    lons = torch.tensor(lon, dtype=dtype)
    n = len(lon)
    sector = fov_sector(lons, fov_deg)
    assert sector.shape == (n,)
    assert bool(((sector >= 0) & (sector < 360 // fov_deg)).all())
    # the centre of the sector is at most half a field of view away
    away = wrap_angle(lons.double() - sector.double() * math.radians(fov_deg)).abs()
    assert bool((away <= math.radians(fov_deg) / 2 + 1e-9).all())
    seen = Detections(
        bfov=torch.cat([lons[:, None], torch.zeros(n, 3, dtype=dtype)], dim=1),
        category=torch.arange(n),
        score=torch.ones(n),
        mask=torch.zeros(n, 2, 4, dtype=torch.bool),
    )
    splits = split_by_fov(seen, fov_deg)
    assert len(splits) == 360 // fov_deg
    assert sorted(k for split in splits for k in split.category.tolist()) == list(range(n))
    assert all(split.mask is not None and len(split.mask) == len(split.score) for split in splits)


def test_sectors_are_centred_on_the_cameras_and_half_open() -> None:
    lon = torch.tensor(
        [0.0, -math.pi / 4, math.pi / 4, math.pi / 2, -math.pi, 3.0], dtype=torch.float64
    )
    assert fov_sector(lon, 90).tolist() == [0, 0, 1, 1, 2, 2]
    assert fov_sector(lon, 180).tolist() == [0, 0, 0, 1, 1, 1]
    assert fov_sector(lon, 360).tolist() == [0] * 6
    assert fov_sector(lon + 2 * math.pi + 0.01, 90).tolist() == [0, 0, 1, 1, 2, 2]


@pytest.mark.parametrize("fov_deg", FOV_DEG)
def test_splits_are_parts_of_the_scene(room: Scene, fov_deg: int) -> None:
    splits = split_by_fov(room, fov_deg)
    assert len(splits) == 360 // fov_deg
    names = [name for split in splits for name in split.objects.id]
    assert sorted(names) == sorted(room.objects.id)
    if fov_deg < 360:
        assert max(len(split.objects.boxes) for split in splits) < 14
    whole = relations_of(room)
    for split in splits:
        assert split.layout is room.layout
        assert split.panorama is room.panorama
        chosen = [room.objects.id.index(name) for name in split.objects.id]
        assert chosen == sorted(chosen)
        part = relations_of(split)
        for i, k in enumerate(chosen):
            assert torch.equal(split.objects.boxes.centre[i], room.objects.boxes.centre[k])
            assert torch.equal(part.touching_wall[i], whole.touching_wall[k])
            for j, other in enumerate(chosen):
                assert part.touching[i, j] == whole.touching[k, other]
                assert part.farther_than[i, j] == whole.farther_than[k, other]
                assert torch.equal(part.relative_yaw[i, j], whole.relative_yaw[k, other])


@pytest.mark.parametrize("fov_deg", FOV_DEG)
def test_a_predictor_that_changes_nothing_changes_nothing(room: Scene, fov_deg: int) -> None:
    result = run_by_fov(lambda scene: scene, room, fov_deg)
    assert_same_objects(result, room)
    assert result.layout is room.layout
    before, after = relations_of(room), relations_of(result)
    sector = fov_sector(room.objects.bfov[:, 0], fov_deg)
    together = sector[:, None] == sector[None, :]
    for item in fields(Relations):
        old, new = getattr(before, item.name), getattr(after, item.name)
        if item.name in ("touching", "farther_than", "relative_yaw"):
            mask = together if old.ndim == 2 else together[..., None]
            old = torch.where(mask, old, 0.0)  # nothing is known across splits
        torch.testing.assert_close(new, old, rtol=0, atol=0)


def test_360_degrees_is_a_plain_call(room: Scene) -> None:
    settings = ArrangementSettings(steps=5)
    noisy = perturb_scene(room, np.random.default_rng(0))

    def repair(scene: Scene) -> Scene:
        return arrange(scene, settings).scene

    assert_same_objects(run_by_fov(repair, noisy, 360), repair(noisy))
    answer = replace(room, name="anything")
    assert run_by_fov(lambda _scene: answer, noisy, 360) is answer


def test_the_optimiser_runs_on_each_split_alone(room: Scene) -> None:
    settings = ArrangementSettings(steps=5, safe=False)
    noisy = perturb_scene(room, np.random.default_rng(0))
    result = run_by_fov(lambda scene: arrange(scene, settings).scene, noisy, 90)
    assert result.objects.id == noisy.objects.id
    assert not torch.equal(result.objects.boxes.centre, noisy.objects.boxes.centre)
    for split in split_by_fov(noisy, 90):
        if not len(split.objects.boxes):
            continue
        alone = arrange(split, settings).scene.objects
        for name, centre in zip(alone.id, alone.boxes.centre, strict=True):
            place = result.objects.id.index(name)
            assert torch.equal(result.objects.boxes.centre[place], centre)


def drop(scene: Scene, *names: str) -> Scene:
    kept = torch.tensor([k for k, name in enumerate(scene.objects.id) if name not in names])
    return select(scene, kept.long())


def test_dropped_objects_leave_the_others_in_order(room: Scene) -> None:
    gone = {room.objects.id[2], room.objects.id[9]}
    result = run_by_fov(lambda scene: drop(scene, *gone), room, 60)
    assert result.objects.id == tuple(name for name in room.objects.id if name not in gone)
    assert len(relations_of(result).touching) == 12
    nothing = run_by_fov(lambda scene: drop(scene, *scene.objects.id), room, 60)
    assert len(nothing.objects.boxes) == 0
    assert relations_of(nothing).touching.shape == (0, 0)


def test_added_objects_come_last(room: Scene) -> None:
    def rename_first(scene: Scene) -> Scene:
        ids = (f"new_{scene.objects.id[0]}", *scene.objects.id[1:])
        return replace(scene, objects=replace(scene.objects, id=ids))

    result = run_by_fov(rename_first, room, 120)
    new = [name for name in result.objects.id if name.startswith("new_")]
    assert 1 < len(new) <= 3
    assert result.objects.id[-len(new) :] == tuple(new)
    firsts = [split.objects.id[0] for split in split_by_fov(room, 120) if split.objects.id]
    assert new == [f"new_{name}" for name in firsts]


def test_objects_without_ids(room: Scene) -> None:
    bare = replace(room, objects=replace(room.objects, id=()))
    assert_same_objects(run_by_fov(lambda scene: scene, bare, 30), bare)

    def forget(scene: Scene) -> Scene:
        return replace(scene, objects=replace(scene.objects, id=()))

    assert_same_objects(run_by_fov(forget, bare, 30), bare)
    assert_same_objects(run_by_fov(forget, room, 30), room)
    with pytest.raises(ValueError, match="objects without ids"):
        run_by_fov(lambda scene: forget(drop(scene, *scene.objects.id[:1])), room, 90)


def test_a_scene_without_objects_comes_back(room: Scene) -> None:
    empty = drop(room, *room.objects.id)
    result = run_by_fov(lambda _scene: pytest.fail("called for nothing"), empty, 90)
    assert_same_objects(result, empty)
    assert [len(split.objects.boxes) for split in split_by_fov(empty, 90)] == [0, 0, 0, 0]


def test_predictors_without_relations(room: Scene) -> None:
    result = run_by_fov(lambda scene: replace(scene, relations=None), room, 90)
    assert result.relations is None
    unknown = replace(room, relations=None)
    assert run_by_fov(lambda scene: scene, unknown, 90).relations is None


def test_bad_arguments_are_refused(room: Scene) -> None:
    for fov_deg in (0, -90, 100, 720):
        with pytest.raises(ValueError, match=f"divisor of 360, found {fov_deg}"):
            split_by_fov(room, fov_deg)
    with pytest.raises(ValueError, match="not finite"):
        fov_sector(torch.tensor([math.nan]), 90)

    def one_name(scene: Scene) -> Scene:
        ids = ("same", *scene.objects.id[1:])
        return replace(scene, objects=replace(scene.objects, id=ids))

    with pytest.raises(ValueError, match="the id 'same' more than once"):
        run_by_fov(one_name, room, 90)

    def fewer_walls(scene: Scene) -> Scene:
        known = relations_of(scene)
        walls = known.touching_wall[:, 1:]
        yaws = known.relative_yaw_wall[:, 1:]
        return replace(scene, relations=replace(known, touching_wall=walls, relative_yaw_wall=yaws))

    with pytest.raises(ValueError, match=r"relations with \d+ walls; expected the \d+ of"):
        run_by_fov(fewer_walls, room, 90)
