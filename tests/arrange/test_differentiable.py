"""Gradients through the whole optimisation: the claim of the paper that its release lost."""

import dataclasses

import pytest
import torch

from panoscene.arrange import (
    PRESETS,
    TERM_NAMES,
    ArrangementBatch,
    ArrangementSettings,
    collate_scenes,
    optimise_boxes,
)
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Objects, scene_from_boxes

from .conftest import random_batch, with_boxes


def short(name: str, steps: int = 8) -> ArrangementSettings:
    return PRESETS[name].model_copy(update={"steps": steps})


@pytest.mark.parametrize("preset", ["released", "default"])
def test_boxes_carry_gradients_to_everything(preset: str):
    batch = random_batch(seed=2)
    start = batch.boxes.centre.clone().requires_grad_()
    on_floor = batch.on_floor.clone().requires_grad_()
    touching = batch.touching.clone().requires_grad_()
    yaw = batch.relative_yaw.clone().requires_grad_()
    settings = short(preset)
    weights = settings.weights.tensor(torch.float64).requires_grad_()
    batch = dataclasses.replace(
        with_boxes(batch, centre=start), on_floor=on_floor, touching=touching, relative_yaw=yaw
    )
    boxes = optimise_boxes(batch, settings, weights)
    (boxes.centre[batch.valid].sum() + boxes.yaw[batch.valid].sum()).backward()
    for name, value in {
        "start": start,
        "on_floor": on_floor,
        "touching": touching,
        "yaw": yaw,
        "weights": weights,
    }.items():
        assert value.grad is not None, name
        assert bool(torch.isfinite(value.grad).all()), name
        assert value.grad.norm() > 1e-8, name


@pytest.mark.parametrize("preset", ["released", "default"])
@pytest.mark.usefixtures("unchecked")
def test_gradient_is_that_of_finite_differences(preset: str):
    batch = random_batch(scenes=1, n=3, seed=8)
    settings = short(preset, steps=5)

    def outcome(on_floor: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
        boxes = optimise_boxes(dataclasses.replace(batch, on_floor=on_floor), settings, weights)
        return (boxes.centre.sum() + boxes.size.square().sum())[None]

    on_floor = torch.tensor([[0.7, 0.8, 0.9]], dtype=torch.float64, requires_grad=True)
    weights = settings.weights.tensor(torch.float64).requires_grad_()
    assert torch.autograd.gradcheck(outcome, (on_floor, weights), eps=1e-7, atol=1e-4, rtol=1e-2)


def floating_table() -> ArrangementBatch:
    """One table 0.4 m above the floor that it stands on in truth."""
    one = torch.ones(1)
    boxes = OrientedBoxes(torch.tensor([[1.0, 1.0, 0.8]]), torch.tensor([[1.0, 0.6, 0.8]]), 0 * one)
    objects = Objects(
        boxes=boxes,
        category=torch.tensor([46]),
        score=one,
        bfov=torch.ones(1, 4),
        distance_score=one,
        yaw_score=one,
    )
    room = Layout(torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]))
    return collate_scenes([scene_from_boxes(objects, room)])


@pytest.mark.usefixtures("unchecked")
def test_a_relation_score_is_trained_through_the_optimiser():
    """Only the optimised box is supervised; the score learns that it stands on the floor."""
    batch = floating_table()
    settings = short("default", steps=15)
    logit = torch.tensor([[0.4]], requires_grad=True)
    optimiser = torch.optim.Adam([logit], lr=0.1)
    losses = []
    for _ in range(25):
        scored = dataclasses.replace(batch, on_floor=torch.sigmoid(logit))
        boxes = optimise_boxes(scored, settings)
        bottom = boxes.centre[0, 0, 2] - boxes.size[0, 0, 2] / 2
        loss = bottom.square()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert torch.sigmoid(logit).item() > 0.8
    assert losses[-1] < 0.5 * losses[0]


def test_weights_in_the_order_of_the_names():
    weights = PRESETS["released"].weights
    assert weights.tensor()[TERM_NAMES.index("reprojection")].item() == weights.reprojection
