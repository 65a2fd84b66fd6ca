import dataclasses

import numpy as np
import pytest
import torch

from panoscene.scene import Relations, relative_yaw_angle
from panoscene.synth import corrupt_relations, sample_room

BINARY = ("touching", "touching_wall", "on_floor", "under_ceiling", "inside_room", "farther_than")


@pytest.fixture(scope="module")
def truth() -> Relations:
    relations = sample_room(np.random.default_rng(0), objects=60, corners=8).relations
    assert relations is not None
    return relations


def other_pairs(n: int) -> torch.Tensor:
    return ~torch.eye(n, dtype=torch.bool)


def test_nothing_corrupted_is_the_truth(truth: Relations) -> None:
    same = corrupt_relations(truth, np.random.default_rng(0), flip=0.0, soften=0.0)
    for field in dataclasses.fields(truth):
        assert torch.equal(getattr(same, field.name), getattr(truth, field.name)), field.name


def test_same_seed_gives_the_same_scores(truth: Relations) -> None:
    first, again, other = (corrupt_relations(truth, np.random.default_rng(s)) for s in (1, 1, 2))
    for field in dataclasses.fields(truth):
        assert torch.equal(getattr(first, field.name), getattr(again, field.name))
        assert not torch.equal(getattr(first, field.name), getattr(other, field.name))


@pytest.mark.parametrize("soften", [0.0, 0.1, 0.4])
@pytest.mark.parametrize("flip", [0.0, 0.1, 0.5, 1.0])
def test_scores_are_probabilities_with_their_symmetries(
    truth: Relations, flip: float, soften: float
) -> None:
    scores = corrupt_relations(truth, np.random.default_rng(2), flip=flip, soften=soften)
    n = len(truth.on_floor)
    for field in dataclasses.fields(truth):
        value = getattr(scores, field.name)
        assert value.shape == getattr(truth, field.name).shape
        assert value.dtype == torch.float32
        assert bool(((value >= 0.0) & (value <= 1.0)).all())
    pairs = other_pairs(n)
    assert torch.equal(scores.touching, scores.touching.T)
    both = scores.farther_than + scores.farther_than.T
    assert torch.allclose(both[pairs], torch.ones(n * (n - 1)))
    opposite = scores.relative_yaw[..., [0, 7, 6, 5, 4, 3, 2, 1]].transpose(0, 1)
    assert torch.equal(scores.relative_yaw, opposite)
    for value in (scores.touching, scores.farther_than, scores.relative_yaw.sum(-1)):
        assert bool((value.diagonal() == 0.0).all())
    assert torch.allclose(scores.relative_yaw.sum(-1)[pairs], torch.ones(n * (n - 1)))
    assert torch.allclose(
        scores.relative_yaw_wall.sum(-1), torch.ones(truth.relative_yaw_wall.shape[:2])
    )


def test_share_of_wrong_answers_is_flip(truth: Relations) -> None:
    scores = corrupt_relations(truth, np.random.default_rng(3), flip=0.2)
    pairs = other_pairs(len(truth.on_floor))
    for name in ("touching", "farther_than"):
        wrong = (getattr(scores, name) > 0.5) != (getattr(truth, name) > 0.5)
        assert float(wrong[pairs].float().mean()) == pytest.approx(0.2, abs=0.05)
    wrong = scores.relative_yaw.argmax(-1) != truth.relative_yaw.argmax(-1)
    assert float(wrong[pairs].float().mean()) == pytest.approx(0.2, abs=0.05)
    wrong = scores.relative_yaw_wall.argmax(-1) != truth.relative_yaw_wall.argmax(-1)
    assert float(wrong.float().mean()) == pytest.approx(0.2, abs=0.06)


def test_all_flipped_is_the_opposite(truth: Relations) -> None:
    scores = corrupt_relations(truth, np.random.default_rng(3), flip=1.0)
    pairs = other_pairs(len(truth.on_floor))
    for name in BINARY:
        wrong = (getattr(scores, name) > 0.5) != (getattr(truth, name) > 0.5)
        assert bool((wrong[pairs] if wrong.shape == pairs.shape else wrong).all()), name
    assert bool((scores.relative_yaw_wall.argmax(-1) != truth.relative_yaw_wall.argmax(-1)).all())


def test_wrong_yaw_bins_are_mostly_neighbours(truth: Relations) -> None:
    scores = corrupt_relations(truth, np.random.default_rng(4), flip=1.0)
    step = scores.relative_yaw_wall.argmax(-1) - truth.relative_yaw_wall.argmax(-1)
    by_one = (step % 8 == 1) | (step % 8 == 7)
    # 70 %, and 2 of 7 of the random ones
    assert float(by_one.float().mean()) == pytest.approx(0.7 + 0.3 * 2 / 7, abs=0.06)


def test_relative_yaw_angles_stay_opposite(truth: Relations) -> None:
    scores = corrupt_relations(truth, np.random.default_rng(4), flip=0.3)
    angle = relative_yaw_angle(scores.relative_yaw)[other_pairs(len(truth.on_floor))]
    back = relative_yaw_angle(scores.relative_yaw.transpose(0, 1))
    back = back[other_pairs(len(truth.on_floor))]
    assert torch.allclose((angle + back).sin(), torch.zeros_like(angle), atol=1e-5)
    assert torch.allclose((angle + back).cos(), torch.ones_like(angle), atol=1e-5)


def test_wrong_answers_are_less_sure(truth: Relations) -> None:
    scores = corrupt_relations(truth, np.random.default_rng(5), flip=0.3)
    pairs = other_pairs(len(truth.on_floor))
    answer = scores.touching[pairs]
    wrong = (answer > 0.5) != (truth.touching[pairs] > 0.5)
    sure = torch.maximum(answer, 1.0 - answer)
    assert float(sure[~wrong].mean()) == pytest.approx(0.90, abs=0.02)
    assert float(sure[wrong].mean()) == pytest.approx(0.705, abs=0.02)
    assert float(sure[wrong].max()) > float(sure[~wrong].mean())
    top = scores.relative_yaw_wall.amax(-1)
    moved = scores.relative_yaw_wall.argmax(-1) != truth.relative_yaw_wall.argmax(-1)
    assert top[moved].mean() < top[~moved].mean() - 0.1
    assert bool((top >= 0.5).all())


def test_false_alarms_can_be_rarer_than_misses(truth: Relations) -> None:
    scores = corrupt_relations(truth, np.random.default_rng(6), flip=0.5, false_alarm=0.0)
    for name in ("touching", "touching_wall"):
        claimed, true = getattr(scores, name) > 0.5, getattr(truth, name) > 0.5
        assert not bool((claimed & ~true).any())
        assert 0.3 < float(claimed[true].float().mean()) < 0.7


def test_float64_and_empty_relations(truth: Relations) -> None:
    empty = sample_room(np.random.default_rng(0), objects=0).relations
    assert empty is not None
    assert corrupt_relations(empty, np.random.default_rng(0)).touching.shape == (0, 0)
    double = Relations(
        **{f.name: getattr(truth, f.name).double() for f in dataclasses.fields(truth)}
    )
    scores = corrupt_relations(double, np.random.default_rng(0))
    assert scores.relative_yaw.dtype == scores.touching.dtype == torch.float64


@pytest.mark.parametrize(
    "arguments",
    [{"flip": -0.1}, {"flip": 1.1}, {"false_alarm": 2.0}, {"soften": 0.5}, {"soften": -0.1},
     {"flip": float("nan")}],
)  # fmt: skip
def test_bad_requests_are_refused(truth: Relations, arguments: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(arguments))):
        corrupt_relations(truth, np.random.default_rng(0), **arguments)
