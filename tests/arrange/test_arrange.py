"""The optimiser as users meet it: repairs, promises, bad input, batches."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
import torch

from panoscene.arrange import (
    PRESETS,
    TERM_NAMES,
    Arrangement,
    ArrangementSettings,
    arrange,
    arrange_scenes,
    collate_scenes,
    energy,
    solver_states,
)
from panoscene.eval import broken_promises, run_arrange_safety
from panoscene.geometry import OrientedBoxes, paired_box_iou
from panoscene.scene import (
    Layout,
    Scene,
    category_index,
    objects_from_boxes,
    relations_from_boxes,
    scene_from_boxes,
)
from panoscene.synth import sample_nonsense, sample_room

from .conftest import noisy_room

ROOM = Layout(torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]))


def scene_of(*rows: tuple[float, ...], layout: Layout = ROOM) -> Scene:
    """A scene of tables with rows (x, y, z, width, depth, height, yaw)."""
    values = torch.tensor(rows, dtype=torch.float32).reshape(-1, 7)
    n = len(values)
    boxes = OrientedBoxes(values[:, :3], values[:, 3:6], values[:, 6])
    objects = objects_from_boxes(boxes, torch.full((n,), 46))
    return scene_from_boxes(objects, layout)


def mean_iou(found: Scene, truth: Scene) -> float:
    return float(paired_box_iou(found.objects.boxes, truth.objects.boxes).mean())


def promised(before: Scene, result: Arrangement) -> None:
    """What ``default`` promises of every result, measured on the boxes themselves."""
    assert broken_promises(before, result.scene) == []
    old, new = result.certificate.before, result.certificate.after
    assert new.energy <= old.energy * (1 + 1e-5) + 1e-5


def test_default_brings_rooms_nearer_to_the_truth(noisy_rooms: list[tuple[Scene, Scene]]):
    results = arrange_scenes([noisy for _, noisy in noisy_rooms])
    gains = []
    for (truth, noisy), result in zip(noisy_rooms, results, strict=True):
        promised(noisy, result)
        gains.append(mean_iou(result.scene, truth) - mean_iou(noisy, truth))
    assert np.mean(gains) > 0.25
    assert sum(r.certificate.after.colliding_pairs for r in results) == 0
    assert sum(r.certificate.before.colliding_pairs for r in results) > 3
    assert all(result.certificate.changed for result in results)


@pytest.mark.usefixtures("unchecked")
def test_batch_and_single_agree(noisy_rooms: list[tuple[Scene, Scene]]):
    scenes = [noisy for _, noisy in noisy_rooms[:4]]
    for name in ("default", "released"):
        together = arrange_scenes(scenes, name)
        for scene, result in zip(scenes, together, strict=True):
            alone = arrange(scene, name)
            torch.testing.assert_close(
                alone.scene.objects.boxes.centre,
                result.scene.objects.boxes.centre,
                atol=0.02,  # sums of padded rows round differently, and contacts amplify it
                rtol=0,
            )


def test_the_same_input_gives_the_same_output():
    _, noisy = noisy_room(3)
    first, second = arrange(noisy), arrange(noisy)
    assert torch.equal(first.scene.objects.boxes.centre, second.scene.objects.boxes.centre)
    assert first.certificate == second.certificate


def test_released_descends_its_energy():
    scenes = [noisy_room(seed)[1] for seed in range(4)]
    for result in arrange_scenes(scenes, "released"):
        assert result.certificate.after.energy < 0.5 * result.certificate.before.energy


def test_a_good_room_stays_nearly_as_it_is():
    truth = sample_room(np.random.default_rng(5), objects=15)
    result = arrange(truth)
    promised(truth, result)
    moved = (result.scene.objects.boxes.centre - truth.objects.boxes.centre).norm(dim=-1)
    assert moved.max() < 0.05


@pytest.mark.usefixtures("unchecked")
def test_nothing_is_broken_by_wrong_relations():
    """Relations of another room are as wrong as they get."""
    for seed in range(5):
        _, noisy = noisy_room(seed, objects=10, corners=6)
        other = sample_room(np.random.default_rng(seed + 100), objects=10, corners=6)
        walls = len(noisy.layout.floor_polygon)
        assert walls == len(other.layout.floor_polygon)
        wrong = dataclasses.replace(noisy, relations=other.relations)
        promised(wrong, arrange(wrong))


def test_certificate_adds_up_and_names_every_term():
    _, noisy = noisy_room(1)
    certificate = arrange(noisy).certificate
    for violations in (certificate.before, certificate.after):
        assert tuple(violations.terms) == TERM_NAMES
        assert sum(violations.terms.values()) == pytest.approx(violations.energy, rel=1e-5)
    assert certificate.preset == "default"
    assert certificate.as_dict()["before"]


def test_certificate_measures_by_hand():
    scene = scene_of(
        (0, 0, 0.5, 1, 1, 1, 0), (0.7, 0, 0.5, 1, 1, 1, 0), (1.8, 0, 0.5, 0.2, 1, 1, 0)
    )
    poking = scene_of((1.9, 0, 0.5, 1, 1, 1, 0))
    pair = arrange(scene, PRESETS["default"].model_copy(update={"steps": 0})).certificate
    assert pair.before.colliding_pairs == 1
    assert pair.before.worst_penetration == pytest.approx(0.3)
    assert pair.before.out_of_room_volume == pytest.approx(0, abs=1e-6)
    assert not pair.changed
    outside = arrange(poking, "default").certificate.before
    assert outside.worst_out_of_room == pytest.approx(0.4)
    assert outside.out_of_room_volume == pytest.approx(0.4)


def test_a_single_fault_is_repaired_and_nothing_else_moves():
    scene = scene_of((0, 0, 0.5, 1, 1, 1, 0), (0.9, 0, 0.5, 1, 1, 1, 0), (-1, 1, 0.5, 1, 1, 1, 0))
    result = arrange(scene)
    promised(scene, result)
    assert result.certificate.after.worst_penetration < 0.02
    still = result.scene.objects.boxes.centre[2] - scene.objects.boxes.centre[2]
    assert still.norm() < 0.02


@pytest.mark.parametrize("preset", PRESETS)
def test_an_empty_room(preset: str):
    result = arrange(scene_of(), preset)
    assert len(result.scene.objects.boxes) == 0
    assert result.certificate.after.energy == 0
    assert not result.certificate.changed


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("count", [1, 64])
def test_counts(preset: str, count: int):
    _, noisy = noisy_room(2, objects=count)
    result = arrange(noisy, preset)
    assert len(result.scene.objects.boxes) == count
    if preset == "default":
        promised(noisy, result)


@pytest.mark.parametrize(
    "rows",
    [
        [(0, 0, 1, 9, 9, 5, 0.3)],  # larger than the room
        [(9, 9, 0.5, 1, 1, 1, 0)],  # outside
        [(1, 1, 0.5, 1, 1, 1, 0)] * 4,  # coincident
        [(0, 0, 1.6, 1, 1, 1, 0)],  # around the camera
        [(0, 0, 0.2, 1, 1, 0.4, 0)],  # under the camera
        [(2, 2, 0.5, 1e-3, 1e-3, 1e-3, 0), (2, 2, 0.5, 1e-3, 1e-3, 1e-3, 0)],  # specks in a corner
        [(1e4, 0, 0, 1, 1, 1, 0), (0, 0, -50, 100, 100, 100, 3)],  # absurd
    ],
)
def test_strange_scenes(rows: list[tuple[float, ...]]):
    scene = scene_of(*rows)
    for preset in PRESETS:
        result = arrange(scene, preset)
        boxes = result.scene.objects.boxes
        assert bool(torch.isfinite(boxes.centre).all())
        assert bool((boxes.size > 0).all())
    promised(scene, arrange(scene))


def test_non_convex_rooms_keep_objects_out_of_the_notch():
    layout = Layout(torch.tensor([[-2.0, -2], [2, -2], [2, 0], [0.5, 0], [0.5, 2], [-2, 2]]))
    scene = scene_of((0.25, 0.9, 0.5, 1, 1, 1, 0), layout=layout)
    result = arrange(scene)
    promised(scene, result)
    assert result.certificate.before.worst_out_of_room > 0.2
    assert result.certificate.after.worst_out_of_room < 0.02


def test_empty_list():
    assert arrange_scenes([]) == []


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("centre", math.nan, "object 1, centre"),
        ("size", math.inf, "object 1, size"),
        ("yaw", math.nan, "object 1, yaw"),
        ("size", 0.0, "above 0"),
        ("size", -1.0, "above 0"),
    ],
)
def test_bad_boxes_are_refused(field: str, value: float, words: str):
    scene = scene_of((0, 0, 0.5, 1, 1, 1, 0), (1, 1, 0.5, 1, 1, 1, 0))
    values = getattr(scene.objects.boxes, field).clone()
    values[1] = value
    boxes = dataclasses.replace(scene.objects.boxes, **{field: values})
    bad = dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, boxes=boxes))
    with pytest.raises(ValueError, match=words):
        arrange(bad)


def with_objects(scene: Scene, **changes: torch.Tensor) -> Scene:
    return dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, **changes))


def with_relations(scene: Scene, **changes: torch.Tensor) -> Scene:
    assert scene.relations is not None
    return dataclasses.replace(scene, relations=dataclasses.replace(scene.relations, **changes))


def with_layout(scene: Scene, **changes: torch.Tensor | float) -> Scene:
    return dataclasses.replace(scene, layout=dataclasses.replace(scene.layout, **changes))


PAIR = scene_of((0, 0, 0.5, 1, 1, 1, 0), (1, 1, 0.5, 1, 1, 1, 0))
TRIPLE = scene_of(*[(x, 0, 0.5, 0.4, 1, 1, 0) for x in (-1, 0, 1)])
ELL = torch.tensor([[-2.0, -2], [2, -2], [2, 0], [0.5, 0], [0.5, 2], [-2, 2]])
CROSSED = torch.tensor([[-2.0, -2], [2, 2], [2, -2], [-2, 2]])


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (with_objects(PAIR, bfov=torch.full((2, 4), math.nan)), "object 0, bfov"),
        (with_objects(PAIR, score=torch.tensor([1.0, 1.5])), "object 1, score"),
        (with_objects(PAIR, yaw_score=torch.tensor([math.nan, 1])), "object 0, yaw_score"),
        (with_relations(PAIR, touching=torch.full((2, 2), -5.0)), "relations.touching"),
        (with_relations(PAIR, on_floor=torch.full((2,), math.nan)), "relations.on_floor"),
        (dataclasses.replace(PAIR, relations=TRIPLE.relations), r"found shape \(3, 3\)"),
        (with_layout(PAIR, floor_polygon=ELL), r"expected \(2, 6\)"),
        (with_layout(PAIR, floor_polygon=CROSSED), "floor_polygon: found that walls cross"),
        (with_layout(PAIR, ceiling_height=-1.0), "ceiling_height"),
        (with_layout(PAIR, ceiling_height=math.nan), "ceiling_height"),
        (
            dataclasses.replace(
                PAIR, panorama=dataclasses.replace(PAIR.panorama, camera_height=math.inf)
            ),
            "camera_height",
        ),
    ],
)
def test_bad_scenes_are_refused(bad: Scene, words: str):
    with pytest.raises(ValueError, match=words):
        arrange(bad)


@pytest.mark.parametrize("field", ["weights", "clearance", "learning_rate"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_bad_settings_are_refused(field: str, value: float):
    wrong = {"size": value} if field == "weights" else value
    with pytest.raises(ValueError, match=r"greater than|finite"):
        ArrangementSettings.model_validate({field: wrong})


def test_thin_boxes_keep_their_thickness():
    """A carpet of 8 mm is not made one of 1 cm, and lies where it lies."""
    carpet = scene_of((0, 1, 0.004, 2, 1.7, 0.008, 0))
    result = arrange(carpet)
    promised(carpet, result)
    assert result.certificate.before.out_of_room_volume == pytest.approx(0, abs=1e-6)
    assert result.scene.objects.boxes.size[0, 2].item() == pytest.approx(0.008, rel=0.351)


@pytest.mark.usefixtures("unchecked")
def test_sizes_stay_near_their_estimate():
    """Room is made by moving, not by crushing furniture."""
    scenes = [noisy_room(seed, objects=15)[1] for seed in range(12)]
    for scene, result in zip(scenes, arrange_scenes(scenes), strict=True):
        ratio = result.scene.objects.boxes.size / scene.objects.boxes.size
        assert ratio.min() > 1 / 1.3501
        assert ratio.max() < 1.3501
        change = torch.maximum(ratio, 1 / ratio).max()
        assert result.certificate.largest_size_change == pytest.approx(float(change))


def test_boxes_in_the_same_place_part():
    twins = scene_of((0, 1, 0.4, 1, 0.5, 0.8, 0), (0, 1, 0.4, 1, 0.5, 0.8, 0))
    result = arrange(twins)
    promised(twins, result)
    assert result.certificate.after.colliding_pairs == 0


def test_what_does_not_belong_in_the_room_is_counted():
    result = arrange(scene_of((9, 9, 0.5, 1, 1, 1, 0), (0, 1, 0.5, 1, 1, 1, 0)))
    assert result.certificate.left_outside == 1


def test_a_diverged_run_does_not_claim_to_be_solved():
    _, noisy = noisy_room(2)
    assert arrange(noisy, "paper").certificate.outcome == "worse than the input"


def test_a_descent_that_ends_too_early_is_not_called_solved():
    _, noisy = noisy_room(2)
    for steps, outcome in ((2, "improved, not converged"), (100, "solved")):
        settings = PRESETS["default"].model_copy(update={"steps": steps})
        certificate = arrange(noisy, settings).certificate
        assert certificate.outcome == outcome
        assert certificate.converged == (outcome == "solved")


def test_mixed_precision_comes_back_as_it_went_in():
    double = dataclasses.replace(
        PAIR,
        objects=dataclasses.replace(
            PAIR.objects,
            boxes=OrientedBoxes(
                PAIR.objects.boxes.centre.double(),
                PAIR.objects.boxes.size.double(),
                PAIR.objects.boxes.yaw.double(),
            ),
        ),
    )
    first, second = arrange_scenes([PAIR, double])
    assert first.scene.objects.boxes.centre.dtype == torch.float32
    assert second.scene.objects.boxes.centre.dtype == torch.float64


def test_unknown_preset():
    with pytest.raises(ValueError, match="expected one of"):
        arrange(scene_of(), "best")


def test_frames_run_from_start_to_end():
    _, noisy = noisy_room(4)
    result = arrange(noisy, frames=5)
    assert len(result.path) == 5
    torch.testing.assert_close(result.path[0].centre, noisy.objects.boxes.centre, atol=1e-3, rtol=0)
    torch.testing.assert_close(
        result.path[-1].centre, result.scene.objects.boxes.centre, atol=0.01, rtol=0
    )


def test_missing_relations_are_derived():
    _, noisy = noisy_room(6)
    bare = dataclasses.replace(noisy, relations=None)
    derived = dataclasses.replace(
        noisy,
        relations=relations_from_boxes(noisy.objects.boxes, noisy.layout, inside="any_corner"),
    )
    first, second = arrange(bare), arrange(derived)
    assert torch.equal(first.scene.objects.boxes.centre, second.scene.objects.boxes.centre)


def test_energy_of_other_boxes_is_that_of_the_variables():
    """The boxes after a step, judged by the start's observation, descend in energy."""
    _, noisy = noisy_room(7)
    batch = collate_scenes([noisy])
    for settings in (PRESETS["default"], PRESETS["released"]):
        start = energy(batch, settings).sum()
        torch.testing.assert_close(energy(batch, settings, boxes=batch.boxes).sum(), start)
        running = solver_states(batch, settings)
        states = dict(itertools.islice(running, 20))
        assert torch.is_grad_enabled(), "a generator that is held must not switch gradients off"
        assert energy(batch, settings, boxes=states[20]).sum() < 0.7 * start


def test_settings_are_strict():
    with pytest.raises(ValueError, match="extra"):
        ArrangementSettings.model_validate({"step": 3})


@pytest.mark.slow
@pytest.mark.usefixtures("unchecked")
def test_random_scenes_are_never_made_worse():
    """A sample of what ``panoscene experiment safety`` does with 10,000 scenes."""
    result = run_arrange_safety(scenes=40, seed=1)
    assert result["worse"] == 0, result["broken"]


FORGIVING = PRESETS["default"].model_copy(update={"tolerance": 0.08})


def test_what_is_forgiven_stays():
    """Overlaps and corners outside by less than the tolerance are within the error of boxes."""
    small = scene_of(
        (0, 1, 0.5, 1, 1, 1, 0), (0.95, 1, 0.5, 1, 1, 1, 0), (-1.55, 1, 0.5, 1, 1, 1, 0)
    )
    still, moved = (arrange(small, way).certificate.after for way in (FORGIVING, "default"))
    assert still.worst_penetration > 0.02
    assert still.worst_out_of_room > 0.04
    assert moved.worst_penetration < 0.01
    assert moved.worst_out_of_room < 0.01
    large = scene_of((0, 0, 0.5, 1, 1, 1, 0), (0.7, 0, 0.5, 1, 1, 1, 0))
    result = arrange(large, FORGIVING)
    assert result.certificate.after.colliding_pairs == 0
    assert 0.04 < result.certificate.after.worst_penetration < 0.1


def test_the_doubtful_object_gives_way():
    scene = scene_of((0, 1.2, 0.5, 1, 1, 1, 0), (0.6, 1.2, 0.5, 1, 1, 1, 0))
    sure = with_objects(scene, score=torch.tensor([1.0, 0.2]))
    settings = PRESETS["default"].model_copy(update={"doubtful_yield": True, "firmness": 0.9})
    result = arrange(sure, settings)
    assert result.certificate.after.colliding_pairs == 0
    first, second = (
        (result.scene.objects.boxes.centre - sure.objects.boxes.centre).norm(dim=-1).tolist()
    )
    assert second > 3 * first


def test_what_is_before_a_door_makes_room():
    scene = scene_of((0, 1.2, 0.5, 1, 1, 1, 0), (0.6, 1.2, 0.5, 1, 1, 1, 0))
    before_door = with_objects(
        scene, category=torch.tensor([category_index("door"), category_index("chest")])
    )
    moved = {}
    for pace in (1.0, 0.0):
        settings = PRESETS["default"].model_copy(update={"built_in_pace": pace})
        found = arrange(before_door, settings)
        assert found.certificate.after.colliding_pairs == 0
        centre = found.scene.objects.boxes.centre
        moved[pace] = (centre - scene.objects.boxes.centre).norm(dim=-1).tolist()
    assert moved[1.0][0] > 0.04
    assert moved[0.0][0] < 1e-3
    assert moved[0.0][1] > moved[1.0][1]


def test_what_lies_in_another_box_stays():
    scene = scene_of((0, 1.2, 0.4, 1, 2, 0.8, 0), (0.2, 1.2, 0.6, 0.4, 0.4, 0.3, 0))
    moved = {}
    for names in (("sofa", "cushion"), ("sofa", "basket")):
        objects = with_objects(scene, category=torch.tensor([category_index(n) for n in names]))
        for stay in (False, True):
            settings = PRESETS["default"].model_copy(update={"nested_stay": stay})
            found = arrange(objects, settings)
            centre = found.scene.objects.boxes.centre
            way = (centre - scene.objects.boxes.centre).norm(dim=-1).max()
            moved[names[1], stay] = float(way)
            left = stay and names[1] == "cushion"
            assert found.certificate.after.colliding_pairs == int(left)
    assert moved["cushion", True] < 1e-3
    assert moved["cushion", False] > 0.1
    assert moved["basket", True] == pytest.approx(moved["basket", False])


def stuck_scene() -> Scene:
    """A pair that can be parted, and a box too large for the room with another in it."""
    return scene_of(
        (-1, -1, 0.5, 0.8, 0.8, 1, 0),
        (-0.5, -1, 0.5, 0.8, 0.8, 1, 0),
        (1.9, 0, 1.2, 0.3, 6, 2.6, 0),
        (1.7, 1.5, 1.2, 0.5, 0.9, 2.6, 0),
    )


@pytest.mark.usefixtures("unchecked")
def test_one_stuck_object_does_not_stop_the_others():
    scenes = [stuck_scene(), *(noisy_room(seed)[1] for seed in range(3))]
    scenes += [sample_nonsense(np.random.default_rng(seed), 12) for seed in range(20)]
    by_object = PRESETS["default"].model_copy(update={"safe_by": "object"})
    whole, parts = arrange_scenes(scenes), arrange_scenes(scenes, by_object)
    for scene, result in zip(scenes, parts, strict=True):
        promised(scene, result)
    solved = [result.certificate.outcome for result in parts].count("solved in part")
    assert solved > 1
    pairs = [sum(r.certificate.after.colliding_pairs for r in rs) for rs in (whole, parts)]
    assert pairs[1] < pairs[0]
