"""Relations as an imperfect network would score them."""

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.scene import Relations

_CONCENTRATION = 6.0
"""a + b of the beta distributions of doubt; the higher, the less the doubts differ."""


def corrupt_relations(
    relations: Relations,
    rng: np.random.Generator,
    *,
    flip: float = 0.1,
    false_alarm: float | None = None,
    soften: float = 0.1,
) -> Relations:
    """Return relation scores with wrong answers and soft confidences.

    Binary relations: the answer (score above 0.5) is replaced by its opposite with probability
    ``flip``. ``touching`` stays symmetric and ``farther_than`` antisymmetric, score[a, b] =
    1 - score[b, a]; each unordered pair is drawn once. Relative yaws: with probability ``flip``
    the bin moves by one (70 %, either side) or to a random other bin (30 %); the relation from b
    to a keeps the opposite angle, bin (8 - k) mod 8.

    Confidences: a score is 1 - u/2 in favour of the answer, with the doubt u drawn from a beta
    distribution of mean ``2 soften`` for right and ``1 - (1 - 2 soften)^4`` for wrong answers
    (a + b = 6). With the default, right answers are 0.90 sure on average and wrong ones 0.70; with
    ``soften=0`` all are 0 or 1. So the answers themselves never change by softening. Of a relative
    yaw, the chosen bin gets the confidence, its two neighbours 40 % each of the rest, the other
    five share the last 20 %.

    Diagonals stay 0.

    Args:
        relations: the true relations; scores other than 0 and 1 are rounded first.
        rng: source of randomness.
        flip: probability of a wrong answer, in [0, 1].
        false_alarm: probability that contact is claimed where there is none, in ``touching`` and
            ``touching_wall`` only; ``flip`` when omitted. True contacts are rare, so that with 20
            objects a ``flip`` of 0.1 alone invents more contacts than there are.
        soften: mean of 1 - confidence for right answers, in [0, 0.5).

    Raises:
        ValueError: if one of the numbers is out of its range.

    Examples:
        >>> from panoscene.synth import sample_room
        >>> room = sample_room(np.random.default_rng(0), objects=4)
        >>> soft = corrupt_relations(room.relations, np.random.default_rng(1), flip=0.0)
        >>> bool(((soft.on_floor > 0.5) == (room.relations.on_floor > 0.5)).all())
        True
    """
    false_alarm = flip if false_alarm is None else false_alarm
    for name, value in (("flip", flip), ("false_alarm", false_alarm)):
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"{name} must be in [0, 1], found {value}")
    if not 0.0 <= soften < 0.5:
        raise ValueError(f"soften must be in [0, 0.5), found {soften}")
    n = len(relations.on_floor)
    upper = torch.ones(n, n, dtype=torch.bool).triu(1).to(relations.touching.device)
    off_diagonal = (upper | upper.T).to(relations.touching.dtype)

    def binary(score: Float[Tensor, "..."], alarm: float) -> Float[Tensor, "..."]:
        answer = score > 0.5
        wrong = _bernoulli(rng, torch.where(answer, flip, alarm))
        confidence = _confidence(rng, wrong, soften).to(score)
        return torch.where(answer ^ wrong, confidence, 1.0 - confidence)

    def yaw(score: Float[Tensor, "*pairs 8"]) -> Float[Tensor, "*pairs 8"]:
        return _corrupt_bins(score, rng, flip, soften)

    touching = binary(relations.touching, false_alarm)
    farther = binary(relations.farther_than, flip)
    relative_yaw = yaw(relations.relative_yaw)
    opposite = relative_yaw[..., (8 - torch.arange(8)) % 8].transpose(0, 1)
    return Relations(
        touching=torch.where(upper, touching, touching.T) * off_diagonal,
        touching_wall=binary(relations.touching_wall, false_alarm),
        on_floor=binary(relations.on_floor, flip),
        under_ceiling=binary(relations.under_ceiling, flip),
        inside_room=binary(relations.inside_room, flip),
        farther_than=torch.where(upper, farther, 1.0 - farther.T) * off_diagonal,
        relative_yaw=torch.where(upper[..., None], relative_yaw, opposite)
        * off_diagonal[..., None],
        relative_yaw_wall=yaw(relations.relative_yaw_wall),
    )


def _bernoulli(rng: np.random.Generator, probability: Float[Tensor, "..."]) -> Bool[Tensor, "..."]:
    draws = torch.from_numpy(rng.random(tuple(probability.shape)))
    return draws.to(probability.device) < probability


def _confidence(
    rng: np.random.Generator, wrong: Bool[Tensor, "..."], soften: float
) -> Float[Tensor, "..."]:
    """Return the score in (0.5, 1] that each answer gets, less for wrong ones on average."""
    if soften == 0.0:
        return torch.ones(wrong.shape)
    right_doubt = 2.0 * soften
    wrong_doubt = 1.0 - (1.0 - right_doubt) ** 4
    mean = np.where(wrong.cpu().numpy(), wrong_doubt, right_doubt)
    doubt = rng.beta(_CONCENTRATION * mean, _CONCENTRATION * (1.0 - mean))
    # just short of one half, so that rounding to float32 keeps the answer
    return torch.from_numpy(np.asarray(1.0 - 0.499999 * doubt))


def _corrupt_bins(
    score: Float[Tensor, "*pairs 8"], rng: np.random.Generator, flip: float, soften: float
) -> Float[Tensor, "*pairs 8"]:
    shape = tuple(score.shape[:-1])
    answer = score.argmax(dim=-1).cpu()
    wrong = rng.random(shape) < flip
    by_one = np.where(rng.random(shape) < 0.5, 1, 7)
    step = np.where(rng.random(shape) < 0.7, by_one, rng.integers(1, 8, shape))
    chosen = (answer + torch.from_numpy(step * wrong)) % 8
    confidence = _confidence(rng, torch.from_numpy(np.asarray(wrong)), soften).double()
    away = (torch.arange(8) - chosen[..., None]) % 8
    share = torch.where((away == 1) | (away == 7), 0.4, 0.04).double()
    rest = (1.0 - confidence)[..., None] * share
    return torch.where(away == 0, confidence[..., None], rest).to(score)
