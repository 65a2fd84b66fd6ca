"""Training of the layout network: it learns a scene, and the truth scores full marks."""

import math
from pathlib import Path

import pytest
import torch

from panoscene.data import layout_targets, room_view
from panoscene.eval import layout_record
from panoscene.models.layout import (
    CONFIGS,
    LayoutConfig,
    LayoutPrediction,
    build_layout,
    layout_losses,
    room_from_signals,
)
from panoscene.scene import Scene
from panoscene.synth.dataset import open_dataset
from panoscene.train import TrainRecipe
from panoscene.train._layout import LayoutOptions, LayoutTask, layout_scores, layout_task, scene_of
from panoscene.train._layout_pictures import layout_picture

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
CONFIG_FOLDER = Path(__file__).parents[2] / "configs"


def recipe(**changes: object) -> TrainRecipe:
    settings = {
        "stage": "layout", "edition": "compact", "steps": 10, "batch_size": 2,
        "learning_rate": 0.003, "data": SAMPLES,
    }  # fmt: skip
    return TrainRecipe.model_validate(settings | changes)


@pytest.fixture(scope="module")
def task() -> LayoutTask:
    return layout_task(recipe())


def every_corner_is_seen(scene: Scene) -> bool:
    corners = scene.layout.floor_polygon
    far = corners.norm(dim=-1)
    lon = torch.atan2(corners[:, 0], corners[:, 1])
    column = ((lon / (2 * math.pi) + 0.5) * 1024).long() % 1024
    floor = layout_targets(room_view(scene))[0][1, column]
    return bool((scene.panorama.camera_height / torch.tan(-floor) > 0.9 * far).all())


def truth_read_back(index: int) -> tuple[LayoutPrediction, Scene]:
    scene = open_dataset(SAMPLES)[index].scene()
    boundary, corner = layout_targets(room_view(scene))
    reading = room_from_signals(boundary, corner, scene.panorama.camera_height)
    return LayoutPrediction(reading.layout, reading.ambiguous, boundary, corner), scene


def test_the_truth_scores_full_marks() -> None:
    records, seen = [], []
    for index in range(10):
        prediction, scene = truth_read_back(index)
        record = layout_record(scene_of(prediction, scene), scene)
        records.append(record)
        if every_corner_is_seen(scene):
            seen.append(record.regularised.errors.iou_3d)
    scores = layout_scores(records)
    assert len(seen) >= 6
    assert min(seen) > 0.995
    assert scores["iou_3d"] > 0.93  # corners that nothing sees are guessed
    assert scores["iou_3d"] >= scores["raw_iou_3d"] - 0.005
    assert scores["pixel_error"] < 0.5


@pytest.mark.train
def test_overfits_one_scene(task: LayoutTask) -> None:
    config = LayoutConfig.model_validate(
        CONFIGS["compact"].model_dump()
        | {"image_height": 64, "image_width": 128, "steps": 64, "frozen_stages": 0, "dropout": 0.0}
    )
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        network = build_layout(config).train()
    batch = task.collate([task.samples.plain(0)])
    image = torch.nn.functional.avg_pool2d(batch.image, 2)
    # corners have soft edges, so the truth itself costs something
    least = torch.nn.functional.binary_cross_entropy(batch.corner, batch.corner)
    optimiser = torch.optim.Adam(network.parameters(), lr=0.003)
    boundary, corner = [], []
    for step in range(55):
        optimiser.param_groups[0]["lr"] = 0.003 if step < 37 else 0.0006
        terms = layout_losses(network(image), batch.boundary, batch.corner, boundary_weight=5.0)
        optimiser.zero_grad()
        (terms["boundary"] + terms["corner"]).backward()
        optimiser.step()
        boundary.append(float(terms["boundary"].detach()))
        corner.append(float(terms["corner"].detach() - least))
    assert boundary[-1] < 0.15 * boundary[0]
    assert corner[-1] < 0.3 * corner[0]
    with torch.no_grad():
        signals = network.eval()(image)
    scene = open_dataset(SAMPLES, "train")[0].scene()
    found = (signals.boundary[0], signals.corner[0].sigmoid())
    reading = room_from_signals(*found, scene.panorama.camera_height)
    prediction = LayoutPrediction(reading.layout, reading.ambiguous, *found)
    record = layout_record(scene_of(prediction, scene), scene)
    assert record.regularised.errors.iou_3d > 0.75


def test_samples_and_losses_fit(task: LayoutTask) -> None:
    assert task.sample_count() == len(open_dataset(SAMPLES, "train"))
    samples = [task.sample(0, torch.Generator().manual_seed(seed)) for seed in (0, 1)]
    terms = task.losses(task.model, task.collate(samples))
    assert set(terms) == {"boundary", "corner"}
    assert all(bool(term.isfinite()) for term in terms.values())
    assert task.config() == CONFIGS["compact"].model_dump(mode="json")


def test_validation_reports_both_polygons_by_corners(task: LayoutTask) -> None:
    task.validation = task.samples
    task.model.eval()
    with torch.no_grad():
        scores = task.validate(task.model, 2)
        pictures = task.pictures(task.model)
    assert {"selection", "iou_2d", "iou_3d", "raw_iou_3d", "corner_error", "pixel_error"} <= set(
        scores
    )
    assert scores["scenes"] == 2
    assert any(name.startswith("iou_3d_") for name in scores)
    assert all(picture.shape == (512, 1536, 3) for picture in pictures.values())


def test_pictures_show_truth_and_prediction() -> None:
    prediction, scene = truth_read_back(0)
    photo = torch.zeros(3, 128, 256, dtype=torch.uint8).numpy()
    with_truth = layout_picture(photo, prediction, scene)
    without = layout_picture(photo, prediction)
    assert with_truth.shape == without.shape == (512, 1536, 3)
    green = (with_truth == (27, 158, 119)).all(-1)
    assert green.any()
    assert not (without == (27, 158, 119)).all(-1).any()


@pytest.mark.parametrize("edition", ["compact", "paper"])
def test_recipes_are_valid(edition: str) -> None:
    from panoscene.train import read_train_recipe  # noqa: PLC0415

    found = read_train_recipe(CONFIG_FOLDER / edition / "layout.yaml")
    assert (found.stage, found.edition) == ("layout", edition)
    assert found.stage_options(LayoutOptions).augmentation.stretch > 1


def test_a_recipe_without_data_is_told() -> None:
    with pytest.raises(ValueError, match="data"):
        layout_task(recipe(data=None))
