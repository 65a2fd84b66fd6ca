"""Training of the relation graph network, in all its steps."""

import json
import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from panoscene.arrange import collate_scenes, optimise_boxes
from panoscene.data import (
    ESTIMATES,
    EncodedObjects,
    EstimateRecord,
    targets_of,
    write_estimate_record,
)
from panoscene.geometry import decode_box_code
from panoscene.models import WeightsHeader, read_weights_header, write_weights
from panoscene.models.context import CONFIGS, ContextOutput, RelationBatch
from panoscene.models.pose import CONFIGS as POSE_CONFIGS
from panoscene.models.pose import PoseOutput, build_pose
from panoscene.pipeline import PHOTO
from panoscene.pipeline._relations import held_relations
from panoscene.scene import Scene
from panoscene.synth.dataset import open_dataset
from panoscene.train import TrainError, TrainRecipe, read_train_recipe, train
from panoscene.train._context import ContextOptions, ContextTask, context_task
from panoscene.train._context_arrange import arranged_losses, arrangement_batch
from panoscene.train._context_scores import (
    arranged,
    box_scores,
    relation_quality,
    relation_scores,
    with_oracle,
    with_rule,
)
from panoscene.train._context_views import viewed_scenes
from panoscene.train._environment import data_hash
from panoscene.train._precompute import HEADER
from panoscene.train._precompute_estimates import file_hash

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples" / "synth"
FEATURES = 32
TINY_POSE = POSE_CONFIGS["compact"].model_copy(
    update={"crop_px": 64, "features": FEATURES, "hidden": 16}
)
TINY = CONFIGS["compact"].model_copy(update={"width": 16, "hidden": 16, "steps": 2})


def _view(scene: Scene, keep: int | None = None) -> EncodedObjects:
    objects = scene.objects
    index = torch.arange(len(objects.category))[:keep]
    generator = torch.Generator().manual_seed(len(index))
    return EncodedObjects(
        objects.bfov[index],
        objects.category[index],
        torch.ones(len(index)),
        index,
        torch.rand(2, len(index), FEATURES, generator=generator),
        torch.randn(2, len(index), 320, generator=generator),
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return estimates of four panoramas, and the weights of a pose network that knows nothing."""
    path = tmp_path_factory.mktemp("context")
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        pose = build_pose(TINY_POSE)
    header = WeightsHeader(
        stage="pose", edition="compact", config=TINY_POSE.model_dump(mode="json")
    )
    write_weights(path / "pose.safetensors", pose, header)
    (path / ESTIMATES).mkdir()
    made = {
        "data_hash": data_hash(SAMPLES), "edition": "compact",
        "pose": file_hash(path / "pose.safetensors"),
    }  # fmt: skip
    (path / HEADER).write_text(json.dumps(made))
    items = (*open_dataset(SAMPLES, "train")[:2], *open_dataset(SAMPLES, "val")[:1])
    for item in items:
        scene = item.scene()
        record = EstimateRecord(_view(scene, 5), _view(scene, 7), (), scene.layout)
        write_estimate_record(record, path / ESTIMATES / f"{item.name}.safetensors")
    return path


@pytest.fixture(autouse=True)
def _tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("panoscene.train._context.CONFIGS", {"compact": TINY})


def recipe_for(folder: Path, step: str, start: Path | None = None, **changes: Any) -> TrainRecipe:
    options = {
        "estimates": str(folder), "pose": str(folder / "pose.safetensors"), "step": step,
        "arrange_steps": 3,
    }  # fmt: skip
    settings = {
        "stage": "context", "edition": "compact", "steps": 2, "batch_size": 2,
        "learning_rate": 1e-3, "data": SAMPLES, "start": start, "validate_every": 2,
        "save_every": 1, "workers": 0, "ema": 0.5, "options": options | changes.pop("options", {}),
    }  # fmt: skip
    return TrainRecipe.model_validate(settings | changes)


def task_for(folder: Path, step: str, **options: Any) -> ContextTask:
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        return context_task(recipe_for(folder, step, options=options))


def test_it_learns_from_so_many_panoramas(folder: Path) -> None:
    assert context_task(recipe_for(folder, "relations", panoramas=2)).sample_count() == 2
    assert context_task(recipe_for(folder, "relations", panoramas=1)).sample_count() == 1


def batch_of(task: ContextTask) -> dict[str, Tensor]:
    return task.collate([task.sample(k, torch.Generator().manual_seed(k)) for k in range(2)])


def test_every_step_learns_what_it_should(folder: Path) -> None:
    names: dict[str, set[str]] = {}
    for step in ("pose", "relations", "joint"):
        task = task_for(folder, step)
        losses = task.losses(task.model, batch_of(task))
        assert all(math.isfinite(float(value.detach())) for value in losses.values())
        torch.stack(list(losses.values())).sum().backward()
        learns = any(p.grad is not None and bool(p.grad.any()) for p in task.pose.parameters())
        assert learns == (step == "joint")
        relations = task.network.relations
        assert relations is not None
        assert any(p.grad is not None for p in relations.parameters()) == (step != "pose")
        names[step] = set(losses)
    assert names["pose"] < names["relations"] < names["joint"]
    assert {"touching", "relative_yaw_wall"} <= names["relations"] - names["pose"]
    assert {"arranged_yaw", "pose_delta", "corner"} <= names["joint"] - names["relations"]


def test_gradients_of_arranged_boxes_reach_the_pose_network(folder: Path) -> None:
    task = task_for(folder, "joint")
    norms = task.gradient_norms()
    assert norms["arranged_gradient_pose"] > 0
    assert norms["arranged_gradient_context"] > 0
    assert all(math.isfinite(value) for value in norms.values())
    rates = {name: task.rate(name) for name, _ in task.model.named_parameters()}
    assert {rate for name, rate in rates.items() if name.startswith("pose.")} == {0.1}
    assert {rate for name, rate in rates.items() if name.startswith("context.")} == {1.0}


@pytest.mark.usefixtures("unchecked")
def test_steps_follow_each_other_and_resume(folder: Path, tmp_path: Path) -> None:
    whole = train(recipe_for(folder, "relations"), tmp_path / "whole", context_task)
    first = recipe_for(folder, "relations")
    with pytest.raises(KeyboardInterrupt):
        train(first, tmp_path / "stopped", context_task, _stop_after_one)
    again = train(first, tmp_path / "stopped", context_task)
    assert (whole.steps, again.steps) == (2, 2)
    losses = [_losses(tmp_path / name) for name in ("whole", "stopped")]
    assert losses[0] == losses[1]
    start = tmp_path / "whole" / "weights.safetensors"
    assert read_weights_header(start).stage == "context"
    joint = train(recipe_for(folder, "joint", start), tmp_path / "joint", context_task)
    assert joint.steps == 2
    # what comes out fits the stages it is for
    for name, stage in (("weights", "context"), ("pose", "pose")):
        header = read_weights_header(tmp_path / "joint" / f"{name}.safetensors")
        assert header.stage == stage
        assert header.metrics["arranged_gradient_pose"] > 0
    after = recipe_for(folder, "joint", tmp_path / "joint" / "weights.safetensors")
    assert context_task(after).joint


def _stop_after_one(done: int, total: int, words: str) -> None:
    del total, words
    if done == 2:
        raise KeyboardInterrupt


def _losses(run: Path) -> list[float]:
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    found = {row["step"]: row["loss"] for row in rows if row["kind"] == "train"}
    return [found[step] for step in sorted(found)]


def test_estimates_of_other_weights_are_refused(folder: Path, tmp_path: Path) -> None:
    other = tmp_path / "pose.safetensors"
    header = WeightsHeader(stage="pose", edition="compact")
    write_weights(other, torch.nn.Linear(1, 1), header)
    with pytest.raises(TrainError, match="estimates of another pose"):
        task_for(folder, "pose", pose=str(other))
    with pytest.raises(TrainError, match="make them with panoscene precompute"):
        task_for(tmp_path, "pose")
    recipe = recipe_for(folder, "pose").model_copy(update={"data": None})
    with pytest.raises(TrainError, match="data: found none"):
        context_task(recipe)


def test_the_truth_scores_one(folder: Path) -> None:
    task = task_for(folder, "relations")
    seen = viewed_scenes(task.validation, "true", task.mean_size, true_layout=True)
    target = targets_of(seen.batch)
    estimates = seen.estimates(task._said, task.shape_config)
    # the true code as an output, and the true relations as sure logits
    sure = 40.0
    bins = torch.arange(6)
    code = target.code
    output = PoseOutput(
        delta=code.delta,
        distance_logit=sure * (bins == code.distance_bin[..., None]).float(),
        distance_residual=code.distance_residual[..., None].expand(*code.delta.shape[:2], 6),
        yaw_logit=sure * (bins == code.yaw_bin[..., None]).float(),
        yaw_residual=code.yaw_residual[..., None].expand(*code.delta.shape[:2], 6),
        size_residual=code.size_residual,
    )
    estimates = replace(estimates, output=output)
    logits = RelationBatch(
        **{
            f.name: sure * (2 * getattr(target.relations, f.name) - 1)
            for f in fields(RelationBatch)
        }
    )
    found = ContextOutput(output, logits, estimates.valid, estimates.wall_valid)
    truth = [_with_first(scene, 7) for scene in seen.truth]
    judged = with_oracle(truth, truth)
    scores = box_scores(judged, truth) | relation_scores(judged, truth)
    assert scores["ap_50"] == scores["ranked_ap_50"] == scores["released_ap_50"] == 1.0
    assert scores["touching_wall_f1"] == scores["on_floor_f1"] == 1.0
    assert scores["relative_yaw_bin_error_deg"] == 0.0
    assert relation_quality(scores) > 0.9
    # and through the batch that the unrolled arrangement works on
    batch = arrangement_batch(estimates, found)
    expected = collate_scenes(
        [
            replace(scene, relations=rule.relations)
            for scene, rule in zip(truth, judged, strict=True)
        ]
    )
    assert torch.allclose(batch.boxes.centre, expected.boxes.centre, atol=1e-3)
    assert torch.allclose(batch.touching_wall, expected.touching_wall, atol=1e-3)
    assert torch.allclose(batch.walls.centre, expected.walls.centre, atol=1e-5)
    assert torch.allclose(batch.relative_yaw, expected.relative_yaw, atol=1e-3)
    boxes = decode_box_code(
        code, estimates.bfov, estimates.mean_size, seen.batch["camera_height"][:, None]
    )
    zero = arranged_losses(boxes, boxes, target.matched, seen.batch["camera_height"])
    assert all(float(value) < 1e-9 for value in zero.values())


def _with_first(scene: Scene, count: int) -> Scene:
    from panoscene.scene import select  # noqa: PLC0415

    return replace(
        select(scene, torch.arange(min(count, len(scene.objects.category)))), relations=None
    )


def test_unrolled_batch_is_that_of_the_arrangement(folder: Path) -> None:
    task = task_for(folder, "relations")
    task.model.eval()
    seen = viewed_scenes(task.validation, "found", task.mean_size)
    with torch.no_grad():
        estimates = seen.estimates(task._said, task.shape_config)
        output = task.network(estimates)
        batch = arrangement_batch(estimates, output, task.network.calibration)
        scenes = seen.refined(task.network, task._said, task.shape_config)
        held = [replace(scene, relations=held_relations(scene)) for scene in scenes]
        expected = collate_scenes(held)
        settings = PHOTO.model_copy(update={"steps": 2, "safe": False})
        found, wanted = optimise_boxes(batch, settings), optimise_boxes(expected, settings)
    assert bool(expected.built_in.any())
    assert torch.equal(batch.built_in, expected.built_in)
    assert torch.equal(batch.nested, expected.nested)
    for name in ("touching", "farther_than", "inside_room", "relative_yaw_wall", "yaw_score"):
        assert torch.allclose(getattr(batch, name), getattr(expected, name), atol=1e-5), name
    assert torch.allclose(found.centre, wanted.centre, atol=1e-4)
    assert torch.allclose(found.size, wanted.size, atol=1e-4)


def test_validation_has_all_rows(folder: Path) -> None:
    task = task_for(folder, "relations")
    task.model.eval()
    with torch.no_grad():
        scores = task.validate(task.model, 1)
        pictures = task.pictures(task.model)
    for name in (
        "ap_15", "initial_ap_15", "found_arranged_ap_50", "released_ap_25", "touching_wall_f1",
        "found_initial_relative_yaw_wall_error_deg", "arranged_paper_colliding_pairs",
    ):  # fmt: skip
        assert name in scores
    assert 0.0 <= scores["selection"] <= 1.0
    assert pictures
    assert task.config()["width"] == 16
    assert task.parts() == {}


def test_rule_and_arrangement_keep_the_scene(folder: Path) -> None:
    task = task_for(folder, "pose")
    seen = viewed_scenes(task.validation, "found", task.mean_size)
    scenes = with_rule(seen.initial(task._said, task.shape_config))
    moved = arranged(scenes, "default")
    for before, after in zip(scenes, moved, strict=True):
        assert before.relations is after.relations
        assert torch.equal(before.objects.category, after.objects.category)
        assert not torch.equal(before.objects.boxes.centre, after.objects.boxes.centre)


@pytest.mark.parametrize("edition", ["compact", "paper"])
@pytest.mark.parametrize("step", ["pose", "relations", "joint"])
def test_recipes_are_sound(edition: str, step: str) -> None:
    recipe = read_train_recipe(ROOT / "configs" / edition / f"context-{step}.yaml")
    assert (recipe.stage, recipe.edition) == ("context", edition)
    assert recipe.stage_options(ContextOptions).step == step
