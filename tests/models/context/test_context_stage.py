"""The context stage: padded estimates in, objects and relations of each scene out."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from panoscene.models import CheckpointError, WeightsHeader, write_weights
from panoscene.models.context import (
    CONFIGS,
    RELATIONS,
    Calibration,
    ContextStage,
    Estimates,
    build_context,
    load_context_stage,
)

from .conftest import TINY, furnished, new_network, padded


def two_rooms() -> Estimates:
    """A room, and the same without its last two objects."""
    estimates = padded(furnished()[0], 1, 2)
    pair = {
        name: torch.cat([value, value])
        for name in Estimates.__dataclass_fields__
        if name != "output" and (value := getattr(estimates, name)) is not None
    }
    output = estimates.output
    both = {name: torch.cat([getattr(output, name)] * 2) for name in output.__dataclass_fields__}
    pair["valid"][1, -3:] = False
    return Estimates(output=replace(output, **both), **pair)


def test_a_scene_has_its_objects_and_walls_only() -> None:
    estimates = two_rooms()
    stage = ContextStage(new_network().float())
    (objects, relations), (fewer, fewer_relations) = stage(estimates)
    n, m = len(objects.category), int(estimates.wall_valid[0].sum())
    assert len(fewer.category) == n - 2
    assert torch.equal(objects.bfov, estimates.bfov[0, :n])
    assert torch.equal(objects.score, estimates.score[0, :n])
    assert len(set(objects.id)) == n
    assert bool((objects.boxes.size > 0).all())
    for score in (objects.distance_score, objects.yaw_score):
        assert bool(((score >= 1 / 6) & (score <= 1)).all())
    assert relations is not None
    assert fewer_relations is not None
    assert relations.relative_yaw_wall.shape == (n, m, 8)
    assert fewer_relations.touching.shape == (n - 2, n - 2)
    assert float(relations.touching.diagonal().abs().max()) == 0
    assert float(relations.relative_yaw.diagonal().abs().max()) == 0
    assert torch.allclose(relations.relative_yaw_wall.sum(-1), torch.ones(n, m))
    off_diagonal = ~torch.eye(n, dtype=torch.bool)
    both = relations.farther_than + relations.farther_than.T
    assert torch.allclose(both[off_diagonal], torch.ones(n * n - n))


def test_probabilities_are_calibrated() -> None:
    network = new_network().float()
    before = ContextStage(network)(two_rooms())[0][1]
    network.calibrate(Calibration(torch.ones(8), torch.full((8,), -9.0)))
    after = ContextStage(network)(two_rooms())[0][1]
    assert before is not None
    assert after is not None
    assert float(before.on_floor.min()) > 0.05 > float(after.on_floor.max())


def test_a_network_without_relation_heads_gives_boxes_only() -> None:
    config = TINY.model_copy(update={"relation_heads": False, "room": "node"})
    (objects, relations), _ = ContextStage(new_network(config).float())(two_rooms())
    assert relations is None
    assert bool(objects.boxes.centre.isfinite().all())


@pytest.mark.parametrize("count", [0, 1])
def test_few_objects(count: int) -> None:
    estimates = two_rooms()
    few = torch.arange(estimates.valid.shape[1]) < count
    estimates = replace(estimates, valid=few.expand(2, -1).contiguous())
    objects, relations = ContextStage(new_network().float())(estimates)[0]
    assert len(objects.category) == count
    assert relations is not None
    assert relations.touching.tolist() == [[0.0]] * count
    for name in RELATIONS:
        assert bool(getattr(relations, name).isfinite().all())


def test_weights_come_back_and_refuse_another_network(tmp_path: Path) -> None:
    path = tmp_path / "context.safetensors"
    network = new_network().float()
    network.calibrate(Calibration(torch.full((8,), 0.7), torch.full((8,), 0.1)))
    header = WeightsHeader(stage="context", edition="compact", config=TINY.model_dump(mode="json"))
    write_weights(path, network, header, half=False)
    stage = load_context_stage("compact", path)
    assert torch.allclose(stage.network.calibration.scale, torch.full((8,), 0.7))
    first, again = (s(two_rooms())[0][0] for s in (ContextStage(network), stage))
    assert torch.allclose(first.boxes.centre, again.boxes.centre, atol=1e-6)
    with pytest.raises(CheckpointError, match="weights of the compact context"):
        load_context_stage("paper", path)
    with pytest.raises(CheckpointError, match="none come with the paper edition"):
        load_context_stage("paper")


def test_weights_of_another_architecture_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "context.safetensors"
    other = TINY.model_copy(update={"object_features": False})
    header = WeightsHeader(stage="context", edition="compact", config=TINY.model_dump(mode="json"))
    write_weights(path, build_context(other), header, half=False)
    with pytest.raises(CheckpointError, match=r"object\.0\.weight of shape"):
        load_context_stage("compact", path)
    wrong_stage = header.model_copy(update={"stage": "pose"})
    write_weights(path, build_context(TINY), wrong_stage, half=False)
    with pytest.raises(CheckpointError, match="compact pose"):
        load_context_stage("compact", path)


def test_editions_are_what_their_names_say() -> None:
    assert CONFIGS["paper"].width == 512
    assert CONFIGS["paper"].steps == 4
    assert not CONFIGS["paper"].norm
    assert CONFIGS["compact"].appearance == 256
