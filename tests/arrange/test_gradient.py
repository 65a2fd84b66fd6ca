"""The fused gradient against the automatic gradient of the terms."""

import numpy as np
import pytest
import torch

from panoscene.arrange import PRESETS, TERM_NAMES
from panoscene.arrange._energy import energy_terms
from panoscene.arrange._gradient import energy_gradient
from panoscene.arrange._kernel import make_kernel
from panoscene.arrange._problem import boxes_from_variables, make_problem

from .conftest import random_batch, with_boxes

VARIANTS = {
    **PRESETS,
    "default with the paper's collision": PRESETS["default"].model_copy(
        update={"collision": "sum", "axis_weight": 1.0, "relative_yaw_target": "mean"}
    ),
    "default that forgives": PRESETS["default"].model_copy(
        update={
            "tolerance": 0.08,
            "doubtful_yield": True,
            "firmness": 0.9,
            "nested_stay": True,
        }
    ),
    "released with IoU": PRESETS["released"].model_copy(update={"projection": "iou"}),
}


def displaced(start: torch.Tensor, seed: int) -> torch.Tensor:
    generator = torch.Generator().manual_seed(seed)
    noise = torch.randn(start.shape, generator=generator, dtype=start.dtype)
    return start + 0.05 * noise * start.abs().clamp(min=0.2, max=1)


@pytest.mark.parametrize("variant", VARIANTS)
def test_variables_decode_to_the_start_boxes(variant: str):
    batch = random_batch()
    problem = make_problem(batch, VARIANTS[variant])
    boxes = boxes_from_variables(problem.start, problem)
    torch.testing.assert_close(boxes.centre, batch.boxes.centre, atol=1e-12, rtol=0)
    torch.testing.assert_close(boxes.size, batch.boxes.size, atol=0, rtol=0)
    turn = torch.remainder(boxes.yaw - batch.boxes.yaw + 1, 2 * torch.pi) - 1
    assert turn.abs().max() < 1e-12


@pytest.mark.parametrize("term", TERM_NAMES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_each_term(variant: str, term: str):
    batch = random_batch(seed=5)
    weights = torch.tensor([float(name == term) for name in TERM_NAMES], dtype=torch.float64)
    problem = make_problem(batch, VARIANTS[variant], weights)
    for seed in range(3):
        x = displaced(problem.start, seed).requires_grad_()
        (expected,) = torch.autograd.grad(energy_terms(x, problem).sum(), x)
        found = energy_gradient(x.detach(), make_kernel(problem))
        assert expected.abs().max() > 0, "nothing is compared"
        scale = max(1.0, expected.abs().max().item())
        assert (found - expected).abs().max().item() < 1e-8 * scale
        assert (found * ~batch.valid).abs().max() == 0, "padding must not move"


@pytest.mark.parametrize("variant", VARIANTS)
def test_numpy_and_torch_agree(variant: str):
    problem = make_problem(random_batch(dtype=torch.float32), VARIANTS[variant])
    kernel = make_kernel(problem)
    x = displaced(problem.start, 1)
    with torch.no_grad():
        expected = energy_gradient(x, kernel).numpy()
    found = energy_gradient(x.numpy(), kernel.numpy())
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, expected, atol=1e-4 * max(1, np.abs(expected).max()))


def test_finite_in_degenerate_places():
    batch = random_batch(scenes=1, n=4)
    centre = batch.boxes.centre.clone()
    centre[0, 0] = torch.tensor([0.0, 0.0, 1.6])  # at the camera
    centre[0, 1] = torch.tensor([0.0, 0.0, 0.4])  # straight below it
    centre[0, 2] = centre[0, 3] = torch.tensor([3.0, 1.0, 0.5])  # coincident, on a corner
    batch = with_boxes(batch, centre=centre, yaw=torch.zeros_like(batch.boxes.yaw))
    for settings in PRESETS.values():
        problem = make_problem(batch, settings)
        assert bool(torch.isfinite(energy_gradient(problem.start, make_kernel(problem))).all())
        assert bool(torch.isfinite(energy_terms(problem.start, problem)).all())
