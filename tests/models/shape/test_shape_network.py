"""Codes, elements, fields: what the shape networks compute."""

import math

import pytest
import torch
from torch import Tensor

from panoscene.models.shape import (
    CONFIGS,
    ISO_LEVEL,
    ShapeConfig,
    ShapeNetwork,
    ShapeTargets,
    analytic_code,
    build_shape,
    elements_from_code,
    fast_field,
    outside_probability,
    shape_losses,
)
from panoscene.models.shape._decoder import ConditionalNorm
from panoscene.models.shape._elements import rotation_from_angles

PAPER, COMPACT = CONFIGS["paper"], CONFIGS["compact"]
TINY = COMPACT.model_copy(update={"features": 24, "hidden": 24, "crop": 64, "nearest": None})


@pytest.fixture(name="network", scope="module")
def fixture_network() -> ShapeNetwork:
    return build_shape(TINY).eval()


def random_code(count: int, config: ShapeConfig, seed: int = 0) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(count, config.code, generator=generator)


def test_sizes_of_the_paper() -> None:
    assert PAPER.width == 42
    assert PAPER.code == 1344
    with torch.device("meta"):
        network = build_shape(PAPER)
        code = network(torch.rand(2, 3, 224, 224), torch.zeros(2, dtype=torch.int64),
                       torch.rand(2, 8))  # fmt: skip
        field = network.field(network.elements(code), torch.rand(2, 5, 3))
    assert code.shape == (2, 1344)
    assert field.shape == (2, 5)
    assert analytic_code(code, PAPER).shape == (2, 320)

    def linear(inputs: int, outputs: int) -> int:
        return (inputs + 1) * outputs

    code_layers = linear(1536 + 57, 1536) + linear(1536, 1536) + linear(1536, 1344)
    encoder = 11_176_512 + linear(512, 1536) + code_layers
    decoder = linear(3, 32) + 2 * linear(32, 32) + 6 * linear(32, 32) + linear(32, 1)
    assert sum(p.numel() for p in network.encoder.parameters()) == encoder
    assert sum(p.numel() for p in network.decoder.parameters()) == decoder


def test_compact_weights_fit_into_eight_megabytes() -> None:
    with torch.device("meta"):
        network = build_shape(COMPACT)
    assert 2 * sum(tensor.numel() for tensor in network.state_dict().values()) < 8e6


def test_an_empty_code_is_outside_everywhere() -> None:
    code = torch.zeros(1, 1344)
    elements = elements_from_code(code, PAPER)
    assert torch.equal(elements.constant, torch.zeros(1, 48))
    assert torch.equal(elements.centre, torch.zeros(1, 48, 3))
    torch.testing.assert_close(
        elements.local_from_shape[0, 0], torch.eye(3) / 0.075, rtol=1e-4, atol=1e-3
    )
    network = build_shape(PAPER).eval()
    field = network.field(elements, torch.rand(1, 7, 3))
    assert torch.equal(field, torch.zeros(1, 7))
    assert bool((outside_probability(field) > 0.99).all())


def test_elements_of_one_code_by_hand() -> None:
    code = torch.zeros(1, 32, 42)
    code[0, 20, :10] = torch.tensor([0.5, 0.4, -0.2, 0.6, 0.0, 9.0, -1.0, 2.0, 0.0, 0.0])
    elements = elements_from_code(code.reshape(1, -1), PAPER)
    assert float(elements.constant[0, 20]) == pytest.approx(-0.5)
    torch.testing.assert_close(elements.centre[0, 20], torch.tensor([0.2, -0.1, 0.3]))
    deviation = torch.tensor([0.075, 0.15 / (1 + math.exp(-9)), 0.15 / (1 + math.exp(1))])
    turn = rotation_from_angles(torch.tensor([math.pi / 4, 0.0, 0.0]))
    inverse = elements.local_from_shape[0, 20].T @ elements.local_from_shape[0, 20]
    expected = turn @ torch.diag(deviation**-2) @ turn.T
    torch.testing.assert_close(inverse, expected, rtol=1e-3, atol=0.1)


def test_rotations_are_rotations() -> None:
    angles = torch.rand(6, 3, generator=torch.Generator().manual_seed(1)) - 0.5
    turn = rotation_from_angles(angles)
    torch.testing.assert_close(turn @ turn.mT, torch.eye(3).expand(6, 3, 3), atol=1e-6, rtol=0)
    torch.testing.assert_close(torch.linalg.det(turn), torch.ones(6))


def test_symmetric_elements_make_symmetric_fields(network: ShapeNetwork) -> None:
    parts = random_code(2, TINY).reshape(2, TINY.elements, TINY.width)
    parts[:, TINY.symmetric :, 0] = 0
    points = torch.rand(2, 9, 3, generator=torch.Generator().manual_seed(2)) - 0.5
    elements = network.elements(parts.flatten(1))
    mirrored = network.field(elements, points * torch.tensor([-1.0, 1.0, 1.0]))
    torch.testing.assert_close(network.field(elements, points), mirrored)
    parts[:, TINY.symmetric :, 0] = 1
    elements = network.elements(parts.flatten(1))
    mirrored = network.field(elements, points * torch.tensor([-1.0, 1.0, 1.0]))
    assert not torch.allclose(network.field(elements, points), mirrored)


def test_the_fast_field_is_the_field(network: ShapeNetwork) -> None:
    code = random_code(3, TINY) * 0.7
    points = torch.rand(3, 200, 3, generator=torch.Generator().manual_seed(3)) * 1.2 - 0.6
    with torch.inference_mode():
        for norm in (network.decoder.norm1, network.decoder.norm2, network.decoder.norm3):
            norm.mean.fill_(0.1)
            norm.variance.fill_(0.7)
        elements = network.elements(code)
        whole = network.field(elements, points)
        fast = fast_field(network, elements)
        found = torch.stack([fast(index, points[index]) for index in range(3)])
    torch.testing.assert_close(found, whole, atol=0.02, rtol=0.02)


def test_training_on_the_nearest_elements_is_close_to_all() -> None:
    network = build_shape(TINY.model_copy(update={"nearest": 12}))
    code = network.encoder.code(torch.zeros(1, 24 + 57 + 8))
    elements = network.elements(code)
    points = torch.rand(1, 50, 3, generator=torch.Generator().manual_seed(4)) - 0.5
    near = network.field(elements, points).detach()
    whole = network.eval().field(elements, points).detach()
    torch.testing.assert_close(near, whole, atol=0.02, rtol=0.1)


def test_norms_follow_slowly_and_use_running_values() -> None:
    norm = ConditionalNorm(2, 3)
    values = torch.full((4, 3), 5.0) + torch.arange(3.0)
    affine = (torch.ones(4, 3), torch.zeros(4, 3))
    torch.testing.assert_close(norm(values, affine), values, rtol=1e-4, atol=0)
    assert float(norm.mean) == pytest.approx(0.005 * 6)
    assert float(norm.variance) == pytest.approx(1 + 0.005 * (2 / 3 - 1))
    norm.eval()
    before = norm.mean.clone()
    norm(values, affine)
    assert torch.equal(norm.mean, before)


def targets(count: int) -> ShapeTargets:
    generator = torch.Generator().manual_seed(5)
    uniform, near = (torch.rand(count, 64, 3, generator=generator) - 0.5 for _ in range(2))
    axis = torch.linspace(-0.7, 0.7, 32)
    grid = torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij")).norm(dim=0) - 0.4
    return ShapeTargets(
        uniform=uniform,
        uniform_outside=(uniform.norm(dim=-1) > 0.4).float(),
        near=near,
        near_outside=(near.norm(dim=-1) > 0.4).float(),
        grid=grid.expand(count, -1, -1, -1),
        stretch=torch.ones(count, 3),
    )


def test_losses_by_hand(network: ShapeNetwork) -> None:
    code = torch.zeros(1, TINY.elements, TINY.width)
    code[0, -1, 1:4] = torch.tensor([0.0, 0.0, 1.2])  # a centre at 0.6: 0.2 outside the ball
    code[0, -2, 1:4] = torch.tensor([0.0, 1.8, 0.0])  # at 0.9: 0.2 outside the box
    losses = shape_losses(network, code.reshape(1, -1), targets(1))
    assert float(losses["in_box"].detach()) == pytest.approx(10 * 0.2**2 / (48 * 3), rel=1e-4)
    assert float(losses["inside"].detach()) == pytest.approx(0.2 * (0.2**2 / 48 + 1e-5), rel=0.02)
    inside = 1 - targets(1).uniform_outside.mean()
    assert float(losses["uniform"].detach()) == pytest.approx(float(inside), rel=0.01)


@pytest.mark.train
def test_a_code_learns_a_ball(network: ShapeNetwork) -> None:
    layer = build_shape(TINY).encoder.code
    code = layer(torch.zeros(1, 24 + 57 + 8)).detach().requires_grad_()
    optimiser = torch.optim.Adam([code], lr=0.03)
    goal = targets(1)
    first = last = 0.0
    for step in range(40):
        losses = shape_losses(network, code, goal)
        loss = torch.stack(list(losses.values())).sum()
        optimiser.zero_grad()
        loss.backward()
        assert code.grad is not None
        assert bool(code.grad.isfinite().all())
        optimiser.step()
        first, last = (
            (float(losses["uniform"].detach()) if step == 0 else first),
            float(losses["uniform"].detach()),
        )
    assert last < 0.6 * first
    centre = network.field(network.elements(code), torch.zeros(1, 1, 3))
    assert float(centre.detach()) < ISO_LEVEL


def test_codes_of_another_length_are_refused() -> None:
    with pytest.raises(ValueError, match="found 10 numbers, expected 1344"):
        elements_from_code(torch.zeros(1, 10), PAPER)
