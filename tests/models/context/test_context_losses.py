"""Losses, probabilities and their calibration."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from panoscene.geometry import OrientedBoxes
from panoscene.models.context import (
    JOINT_WEIGHTS,
    RELATION_WEIGHT,
    RELATIONS,
    Calibration,
    ContextOutput,
    ContextTargets,
    RelationBatch,
    boxes_from_output,
    build_context,
    context_losses,
    fit_calibration,
    joint_losses,
    relation_masks,
    relation_probabilities,
    relations_of,
)
from panoscene.models.pose import LOSS_WEIGHTS, PoseOutput

from .conftest import TINY, furnished, padded

YAWS = ("relative_yaw", "relative_yaw_wall")


def knowing(target: ContextTargets, sure: float = 20.0) -> ContextOutput:
    """The output of somebody who knows."""
    code = target.code

    def bins(index: Tensor) -> Tensor:
        return sure * torch.nn.functional.one_hot(index, 6).float()

    def each(value: Tensor) -> Tensor:
        return value.unsqueeze(-1).expand(*value.shape, 6)

    relations = {name: getattr(target.relations, name) for name in RELATIONS}
    said = {k: sure * (v if k in YAWS else 2 * v - 1) for k, v in relations.items()}
    output = PoseOutput(
        delta=code.delta,
        distance_logit=bins(code.distance_bin),
        distance_residual=each(code.distance_residual),
        yaw_logit=bins(code.yaw_bin),
        yaw_residual=each(code.yaw_residual),
        size_residual=code.size_residual,
    )
    walls = torch.ones(relations["touching_wall"].shape[::2], dtype=torch.bool)
    return ContextOutput(output, RelationBatch(**said), torch.ones_like(target.matched), walls)


def test_the_truth_costs_nothing() -> None:
    estimates, target = furnished()
    output = knowing(target)
    losses = context_losses(output, target) | joint_losses(output, target, estimates)
    assert losses.keys() == {*LOSS_WEIGHTS, *RELATIONS, *JOINT_WEIGHTS}
    for name, value in losses.items():
        assert float(value) < 1e-4 if name != "outside" else float(value) < 0.05, name


def test_losses_by_hand() -> None:
    _, target = furnished()
    output = knowing(target)
    assert output.relations is not None
    zero = RelationBatch(**{n: torch.zeros_like(getattr(output.relations, n)) for n in RELATIONS})
    losses = context_losses(replace(output, relations=zero), target)
    for name in RELATIONS:
        expected = RELATION_WEIGHT * torch.tensor(8.0 if name in YAWS else 2.0).log()
        assert torch.allclose(losses[name], expected)


def test_rare_answers_weigh_as_much_as_frequent_ones() -> None:
    _, target = furnished()
    output = knowing(target)
    assert output.relations is not None
    truth = target.relations.touching
    yes, no = truth.sum(), relation_masks(output.valid, output.wall_valid)["touching"].sum()
    no = no - yes
    assert 0 < yes < no
    logit = torch.where(truth > 0, -1.0, -1.0)
    wrong = replace(output, relations=replace(output.relations, touching=logit))
    soft = torch.nn.functional.softplus
    costs = soft(torch.tensor(1.0)), soft(torch.tensor(-1.0))
    ratio = float((no / yes).clamp(max=20.0))
    expected = (ratio * yes * costs[0] + no * costs[1]) / (ratio * yes + no)
    found = context_losses(wrong, target)["touching"] / RELATION_WEIGHT
    assert torch.allclose(found, expected)
    plain = context_losses(wrong, target, balanced=False)["touching"] / RELATION_WEIGHT
    assert torch.allclose(plain, (yes * costs[0] + no * costs[1]) / (yes + no))


def test_only_matched_objects_and_true_pairs_count() -> None:
    estimates, target = furnished()
    output = knowing(target)
    assert output.relations is not None
    said = {name: getattr(output.relations, name).clone() for name in RELATIONS}
    matched = target.matched.clone()
    matched[:, 0] = False
    for name, value in said.items():
        value[:, 0] = 55.0
        if name in ("touching", "farther_than", "relative_yaw"):
            value[:, :, 0] = 55.0
            value.diagonal(dim1=1, dim2=2).fill_(-77.0)
    worse = replace(output, relations=RelationBatch(**said))
    losses = context_losses(worse, replace(target, matched=matched))
    assert max(float(value) for value in losses.values()) < 1e-4
    nothing = replace(target, matched=torch.zeros_like(matched))
    empty = context_losses(worse, nothing) | joint_losses(worse, nothing, estimates)
    empty.pop("outside")
    assert all(float(value) == 0 for value in empty.values())


def test_joint_losses_by_hand() -> None:
    estimates, target = furnished()
    output = knowing(target)
    size = output.output.size_residual.clone()
    size[..., 0] += 0.2 / estimates.mean_size[..., 0]
    wide = replace(output, output=replace(output.output, size_residual=size))
    found = joint_losses(wide, target, estimates)
    # every corner moves by 10 cm, along one direction of the floor: two coordinates of three
    assert torch.allclose(found["corner"], torch.tensor(50 * 0.5 * 0.01 / 3), rtol=1e-3)
    assert float(found["reprojection"]) > 0
    low = replace(estimates, ceiling=torch.tensor([0.5]))
    assert float(joint_losses(output, target, low)["outside"]) > 0.1


def test_joint_losses_have_finite_gradients() -> None:
    estimates, target = furnished(noise=0.3)
    leaf = estimates.output.delta.clone().requires_grad_()
    output = knowing(target)
    output = replace(output, output=replace(estimates.output, delta=leaf))
    torch.stack(list(joint_losses(output, target, estimates).values())).sum().backward()
    assert leaf.grad is not None
    assert bool(leaf.grad.isfinite().all())
    assert float(leaf.grad.abs().max()) > 0


def test_probabilities_are_masked_and_keep_what_relations_are() -> None:
    _, target = furnished()
    output = knowing(target, sure=0.7)
    assert output.relations is not None
    valid = output.valid.clone()
    valid[:, -1] = False
    line = Calibration(torch.linspace(0.5, 2, 8), torch.tensor([1, 1, 1, 1, 1, 0, 0, 0]).float())
    found = relation_probabilities(output.relations, valid, output.wall_valid, line)
    for name, mask in relation_masks(valid, output.wall_valid).items():
        value = getattr(found, name)
        assert float(value[~mask].abs().sum()) == 0
        assert bool(((value >= 0) & (value <= 1)).all())
    pair = relation_masks(valid, output.wall_valid)["touching"]
    assert torch.allclose(found.relative_yaw.sum(-1), pair.float())
    assert torch.allclose(found.touching, found.touching.mT)


def test_calibration_makes_probabilities_mean_what_they_say() -> None:
    generator = torch.Generator().manual_seed(0)
    _, target = furnished()
    scenes, n, m = 200, 6, 4
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(RELATIONS, (scenes, n))
    shapes |= dict.fromkeys(("touching", "farther_than"), (scenes, n, n))
    shapes |= {"touching_wall": (scenes, n, m)}
    shapes |= {"relative_yaw": (scenes, n, n, 8), "relative_yaw_wall": (scenes, n, m, 8)}
    truth, said = {}, {}
    for name, shape in shapes.items():
        logit = 2 * torch.randn(shape, generator=generator) - 1
        if name in YAWS:
            drawn = torch.multinomial(logit.softmax(-1).reshape(-1, 8), 1, generator=generator)
            truth[name] = torch.nn.functional.one_hot(drawn[:, 0], 8).view(shape).float()
            said[name] = 3 * logit
        else:
            shift = 0 if name == "farther_than" else 3
            logit = logit + 1 if name == "farther_than" else logit
            drawn = torch.rand(shape, generator=generator) < logit.sigmoid()
            truth[name], said[name] = drawn.float(), 2 * logit + shift
    every = torch.ones(scenes, n, dtype=torch.bool)
    output = ContextOutput(
        knowing(target).output, RelationBatch(**said), every, torch.ones(scenes, m) > 0
    )
    judged = [(output, ContextTargets(target.code, every, RelationBatch(**truth)))]
    line = fit_calibration(judged)
    for number, name in enumerate(RELATIONS):
        assert float(line.scale[number]) == pytest.approx(1 / 3 if name in YAWS else 0.5, rel=0.2)
        if name not in (*YAWS, "farther_than"):
            assert float(line.shift[number]) == pytest.approx(-1.5, rel=0.2)
    assert bool((line.shift[-3:] == 0).all())


def test_calibration_of_nothing_leaves_the_logits_alone() -> None:
    line = fit_calibration([])
    assert torch.equal(line.scale, torch.ones(8))
    assert torch.equal(line.shift, torch.zeros(8))
    _, target = furnished()
    unmatched = replace(target, matched=torch.zeros_like(target.matched))
    assert torch.equal(fit_calibration([(knowing(target), unmatched)]).scale, torch.ones(8))
    with pytest.raises(ValueError, match="output without relations"):
        fit_calibration([(replace(knowing(target), relations=None), target)])


@pytest.mark.train
def test_one_scene_is_learnt_by_heart() -> None:
    estimates, target = furnished()
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        network = build_context(TINY)
    optimiser = torch.optim.Adam(network.parameters(), lr=1.5e-2)
    totals: list[float] = []
    for _ in range(40):
        losses = context_losses(network(estimates), target)
        total = torch.stack(list(losses.values())).sum()
        optimiser.zero_grad()
        total.backward()
        optimiser.step()
        totals.append(float(total.detach()))
    assert totals[-1] < 0.05 * totals[0]
    more = padded(estimates, 2, 1)
    n = target.matched.shape[1]
    output = network.eval()(more)
    truth = boxes_from_output(knowing(target).output, estimates)
    refined = boxes_from_output(output.output, more)[:, :n]
    assert off(refined, truth) < 0.6 * off(estimates.boxes(), truth)
    found = relations_of(output, 0, network.calibration)
    for name in RELATIONS:
        said, wanted = getattr(found, name), getattr(target.relations, name)[0]
        agree = said.argmax(-1) == wanted.argmax(-1) if name in YAWS else (said > 0.5) == wanted
        assert float(agree.float().mean()) > 0.97, name


def off(boxes: OrientedBoxes, truth: OrientedBoxes) -> float:
    return float((boxes.centre - truth.centre).detach().norm(dim=-1).mean())
