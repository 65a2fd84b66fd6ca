"""Training of the shape network."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from panoscene.models import CheckpointError, WeightsHeader, content_hash, write_weights
from panoscene.models.shape import CONFIGS
from panoscene.synth.assets import CadModel, Material, add_models
from panoscene.train import TrainError, TrainRecipe, read_train_recipe
from panoscene.train._shape import ShapeOptions, ShapeTask, shape_task
from panoscene.train._shape_scores import (
    METHODS,
    _without_slabs,
    canonical,
    nearest_model,
    shape_scores,
)
from panoscene.train._shape_tables import shape_tables

for package in ("skimage", "fast_simplification"):
    pytest.importorskip(package, reason="an optional package")

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples" / "synth"
TINY = CONFIGS["compact"].model_copy(update={"crop": 32, "features": 32, "hidden": 32})


def body(name: str, category: str, *boxes: tuple[tuple[float, ...], tuple[float, ...]]) -> CadModel:
    """Return a model made of boxes, each given by size and centre."""
    parts = []
    for size, place in boxes:
        part = trimesh.creation.box(size)
        part.apply_translation(place)
        parts.append(part)
    mesh = trimesh.util.concatenate(parts)
    assert isinstance(mesh, trimesh.Trimesh)
    vertices = mesh.vertices - (mesh.vertices.min(0) + mesh.vertices.max(0)) / 2
    size = np.ptp(vertices, axis=0).tolist()
    return CadModel(
        id=f"test/{name}",
        base=f"test/{name}",
        category=category,
        vertices=vertices.astype(np.float32),
        normals=np.zeros((len(vertices), 3), np.float32),
        uv=np.zeros((len(vertices), 2), np.float32),
        faces=np.asarray(mesh.faces, np.int32),
        face_material=np.zeros(len(mesh.faces), np.int16),
        materials=(Material("grey"),),
        size=(size[0], size[1], size[2]),
    )


@pytest.fixture(name="folder", scope="module")
def fixture_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shapes")
    seat = ((0.5, 0.5, 0.3), (0.0, 0.0, 0.0))
    back = ((0.5, 0.1, 0.6), (0.0, -0.2, 0.45))
    top = ((1.2, 0.7, 0.1), (0.0, 0.0, 0.7))
    foot = ((0.3, 0.3, 0.7), (0.0, 0.0, 0.35))
    models = [
        body("chair", "chair", seat, back),
        body("table", "table", top, foot),
        body("thin", "carpet", ((2.0, 1.0, 0.01), (0.0, 0.0, 0.0))),
    ]
    add_models(folder / "assets", models)
    return folder


def recipe_with(options: dict[str, Any]) -> TrainRecipe:
    return TrainRecipe(
        stage="shape", edition="compact", steps=1, batch_size=2, learning_rate=1e-3,
        data=SAMPLES, options=options,
    )  # fmt: skip


@pytest.fixture(name="task")
def fixture_task(folder: Path, monkeypatch: pytest.MonkeyPatch) -> ShapeTask:
    monkeypatch.setattr("panoscene.train._shape.CONFIGS", {"compact": TINY})
    options = {
        "folder": str(folder / "data"),
        "assets": str(folder / "assets"),
        "points": 64,
        "renders": 2,
        "frozen_views": 2,
        "near_weight": 0.3,
    }
    recipe = recipe_with(options)
    with torch.random.fork_rng():
        torch.manual_seed(0)  # noqa: TID251 (the network starts from it)
        task = shape_task(recipe)
    assert isinstance(task, ShapeTask)
    return task


def test_data_is_prepared_and_thin_models_are_left_out(task: ShapeTask) -> None:
    assert sorted(task.shapes) == ["test/chair", "test/table"]
    assert (task.options.folder / "crops-train.npz").is_file()
    assert task.sample_count() == 2 * len(task.seen)
    one = task.sample(0, torch.Generator().manual_seed(1))
    again = task.sample(0, torch.Generator().manual_seed(1))
    assert torch.equal(one.crop, again.crop)
    assert torch.equal(one.near, again.near)
    assert task.rate("encoder.backbone.network.conv_stem.weight") == 0
    assert task.rate("encoder.code.0.weight") == 1


def test_the_first_models_are_of_all_categories(
    task: ShapeTask, monkeypatch: pytest.MonkeyPatch
) -> None:
    order = tuple(reversed(task.seen))
    monkeypatch.setattr("panoscene.train._shape.shaped_models", lambda assets: ("other", *order))
    options = task.options.model_dump(mode="json") | {"models": len(order) - 1}
    recipe = recipe_with(options)
    fewer = shape_task(recipe)
    assert isinstance(fewer, ShapeTask)
    assert len(order) > 1
    assert fewer.seen == list(order[:-1])


def test_the_number_of_views_may_change_in_a_folder(task: ShapeTask) -> None:
    options = task.options.model_dump(mode="json") | {"frozen_views": 1}
    recipe = recipe_with(options)
    other = shape_task(recipe)
    assert isinstance(other, ShapeTask)
    assert other.views is not None
    assert task.views is not None
    assert (other.views.features.shape[1], task.views.features.shape[1]) == (1, 2)


@pytest.mark.train
@pytest.mark.parametrize("frozen_views", [2, 0])
def test_overfits_two_models(task: ShapeTask, frozen_views: int) -> None:
    options = task.options.model_dump(mode="json") | {"frozen_views": frozen_views}
    recipe = recipe_with(options)
    with torch.random.fork_rng():
        torch.manual_seed(0)  # noqa: TID251 (the network starts from it)
        made = shape_task(recipe)
    assert isinstance(made, ShapeTask)
    task = made
    start = {name: value.clone() for name, value in task.model.state_dict().items()}
    before = task.validate(task.model.eval(), None)
    with torch.random.fork_rng():
        torch.manual_seed(0)  # noqa: TID251 (the network starts from it)
        learnt = {n: p for n, p in task.model.named_parameters() if task.rate(n) > 0}
        groups = [
            {"params": [p], "lr": 5e-4 if n.startswith("encoder.backbone.") else 5e-3}
            for n, p in learnt.items()
        ]
        optimiser = torch.optim.AdamW(groups)
        task.model.train()
        for step in range(50):
            generator = torch.Generator().manual_seed(step)
            batch = task.collate([task.sample(k, generator) for k in range(task.sample_count())])
            loss = torch.stack(list(task.losses(task.model, batch).values())).sum()
            optimiser.zero_grad()
            loss.backward()
            gradients = [p.grad for p in learnt.values() if p.grad is not None]
            assert all(bool(gradient.isfinite().all()) for gradient in gradients)
            optimiser.step()
    task.model.eval()
    after = task.validate(task.model, None)
    name = "seen_iou" if "seen_iou" in after else "unseen_iou"
    assert after[name] > max(before[name], after[name.replace("iou", "box_iou")]) + 0.15
    stem = "encoder.backbone.network.conv_stem.weight"
    assert torch.equal(task.model.state_dict()[stem], start[stem]) == bool(frozen_views)
    assert set(task.pictures(task.model)) <= {"crops", "unseen", "seen"}


def test_the_truth_scores_one(task: ShapeTask) -> None:
    from panoscene.eval import shape_errors  # noqa: PLC0415

    truth = canonical(task.shapes["test/chair"])
    found = shape_errors(truth, truth, generator=torch.Generator().manual_seed(0), points=500)
    assert found.f_score == pytest.approx(1.0)
    assert found.volume_iou == pytest.approx(1.0)


def test_scores_name_methods_and_categories(task: ShapeTask) -> None:
    task.seen, task.unseen = ["test/table"], ["test/chair"]
    task.model.eval()
    scores = shape_scores(task, points=200, resolution=32)
    unseen, seen = scores["unseen"], scores["seen"]
    assert unseen["objects"] == seen["objects"] == 1
    assert tuple(seen["mean"]) == METHODS
    assert tuple(unseen["mean"]) == ("network", "retrieval", "box")
    assert list(unseen["by_category"]) == ["chair"]
    # the library has no chair: a shape that is missed has no distance, and shares no volume
    nothing = unseen["mean"]["retrieval"]
    assert (nothing["missed"], nothing["chamfer"], nothing["volume_iou"]) == (1, None, 0.0)
    assert seen["mean"]["retrieval"]["volume_iou"] == pytest.approx(1.0)
    assert seen["mean"]["retrieval without the model"]["missed"] == 1
    box = seen["mean"]["box"]
    assert (box["missed"], box["volumes"], box["objects"]) == (0, 1, 1)
    assert 0 < box["volume_iou"] < 1


def test_retrieval_may_leave_out_a_model(task: ShapeTask) -> None:
    assert nearest_model(task, "sofa", torch.ones(3)) is None
    task.seen = ["test/chair", "test/table"]
    assert nearest_model(task, "chair", torch.ones(3)) is not None
    assert nearest_model(task, "chair", torch.ones(3), but="test/table") is not None
    assert nearest_model(task, "chair", torch.ones(3), but="test/chair") is None


def test_what_gets_a_slab_is_not_scored(task: ShapeTask) -> None:
    picture, shape = task.validation()["seen" if task.seen else "unseen"][0]
    flat = replace(picture, size=torch.tensor([2.0, 1.0, 0.02]))
    door = replace(shape, category="door")
    kept = _without_slabs([(flat, shape), (picture, shape), (picture, door)])
    assert [(one is picture, other is shape) for one, other in kept] == [(True, True)]
    assert not _without_slabs([])


def test_tables_tell_over_how_many_objects_means_are() -> None:
    network = {"chamfer": 4.0, "f_score": 0.5, "normal_consistency": 0.75, "volume_iou": 0.5}
    counts = {"objects": 3, "missed": 1, "volumes": 2}
    box = network | {"chamfer": 5.0, "f_score": 0.75, "missed": 0, "volume_iou": None}
    means = {"network": network | counts, "box": counts | box}
    means["retrieval"] = means["box"] | {"missed": 3, "chamfer": None}
    kind = {"objects": 3, "slabs_left_out": 7, "mean": means, "by_category": {"chair": means}}
    metrics = {f"{name}_iou": 0.25 for name in ("crops", "unseen", "seen")}
    metrics |= {f"{name}_box_iou": 0.125 for name in ("crops", "unseen", "seen")}
    measured = {"scores": {"unseen": kind}, "metrics": metrics, "models": 9, "points": 1000}
    tables = shape_tables(measured)
    row = "| unseen | 3 | network | 4.00 (of 2) | 0.500 | 0.750 | 0.500 (of 2) |"
    assert row in tables["shape-meshes"]
    assert "| unseen | box | Chamfer | F-score, normals |" in tables["shape-better"]
    row = "| chair | unseen | 3 | 4.0 / - / 5.0 | 0.50 / 0.75 / 0.75 | 0.75 / 0.75 / 0.75 |"
    assert row in tables["shape-categories"]
    assert "1,000 points" in tables["shape-how"]
    assert "7 `unseen`" in tables["shape-how"]


@pytest.mark.parametrize("edition", ["compact", "paper"])
def test_recipes_fit_their_options(edition: str) -> None:
    recipe = read_train_recipe(ROOT / "configs" / edition / "shape.yaml")
    assert (recipe.stage, recipe.edition) == ("shape", edition)
    assert recipe.stage_options(ShapeOptions).near_weight > 0


def test_a_recipe_without_data_is_refused(tmp_path: Path) -> None:
    recipe = TrainRecipe(
        stage="shape", edition="compact", steps=1, batch_size=1, learning_rate=1.0,
        options={"folder": str(tmp_path)},
    )  # fmt: skip
    with pytest.raises(TrainError, match="data: found none"):
        shape_task(recipe)


def test_it_starts_from_the_weights_of_a_file(
    task: ShapeTask, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("panoscene.train._shape.CONFIGS", {"compact": TINY})
    file = tmp_path / "start.safetensors"
    header = WeightsHeader(stage="shape", edition="compact")
    with torch.no_grad():
        for parameter in task.model.parameters():
            parameter.mul_(0.5)
    write_weights(file, task.model, header, half=False)
    options = {"folder": str(folder / "data"), "assets": str(folder / "assets"), "frozen_views": 1}
    recipe = TrainRecipe(
        stage="shape", edition="compact", steps=1, batch_size=1, learning_rate=1.0,
        data=SAMPLES, start=file, imagenet=True, options=options,
    )  # fmt: skip
    known = set((folder / "data").glob("seen-*"))
    started = shape_task(recipe)
    assert content_hash(started.model.state_dict()) == content_hash(task.model.state_dict())
    # what another backbone saw is not taken for what this one sees
    assert len(set((folder / "data").glob("seen-*")) - known) == 1
    write_weights(file, task.model, header.model_copy(update={"stage": "pose"}))
    with pytest.raises(CheckpointError, match="weights of the compact pose"):
        shape_task(recipe)


def test_crops_of_the_first_panoramas_have_a_file_of_their_own(
    task: ShapeTask, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("panoscene.train._shape.CONFIGS", {"compact": TINY})
    options = {"folder": str(task.options.folder), "assets": str(folder / "assets")}
    recipe = TrainRecipe(
        stage="shape", edition="compact", steps=1, batch_size=1, learning_rate=1.0,
        data=SAMPLES, panoramas=1, options=options | {"prepare": False},
    )  # fmt: skip
    with pytest.raises(TrainError, match=r"crops-train-1\.npz: found no such file"):
        shape_task(recipe)
    fewer = shape_task(recipe.model_copy(update={"options": options}))
    assert isinstance(fewer, ShapeTask)
    assert fewer.crops is not None
    assert task.crops is not None
    count = len(fewer.crops.image)
    assert 0 < count < len(task.crops.image)
    assert np.array_equal(fewer.crops.image, task.crops.image[:count])
