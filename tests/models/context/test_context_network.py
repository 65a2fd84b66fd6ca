"""The relation graph network: what must not matter to it, and what must."""

import math
from dataclasses import fields, replace

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from panoscene.models.context import (
    CONFIGS,
    ContextConfig,
    ContextNetwork,
    ContextOutput,
    Estimates,
    RelationBatch,
    boxes_from_output,
    build_context,
    relation_masks,
)
from panoscene.models.pose import PoseOutput
from panoscene.scene import relative_yaw_angle

from .conftest import TINY, new_network, padded, random_estimates, shuffled, turned

VARIANTS = {
    "full": TINY,
    "no Fr": TINY.model_copy(update={"relation_features": False}),
    "no Fo": TINY.model_copy(update={"object_features": False}),
    "no heads": TINY.model_copy(update={"relation_heads": False}),
    "Im3D": TINY.model_copy(update={"relation_heads": False, "room": "node"}),
    "no shapes": TINY.model_copy(update={"codes": 0, "blobs": 0}),
    "paper": TINY.model_copy(update={"norm": False, "deviation": 0.01}),
}


def numbers(output: ContextOutput) -> dict[str, Tensor]:
    """Everything that an output says."""
    found = {f.name: getattr(output.output, f.name).detach() for f in fields(PoseOutput)}
    if output.relations is not None:
        said = output.relations
        found |= {f.name: getattr(said, f.name).detach() for f in fields(RelationBatch)}
    return found


def assert_alike(first: dict[str, Tensor], second: dict[str, Tensor], within: float) -> None:
    assert first.keys() == second.keys()
    for name, value in first.items():
        off = float((value - second[name]).abs().max())
        assert off < within, f"{name} is off by {off}"


@pytest.mark.parametrize("name", VARIANTS)
def test_shapes_and_what_is_left_out(name: str) -> None:
    config = VARIANTS[name]
    output = new_network(config)(random_estimates())
    assert output.output.size_residual.shape == (2, 5, 3)
    assert (output.relations is None) == (not config.relation_heads)
    if output.relations is not None:
        assert output.relations.relative_yaw_wall.shape == (2, 5, 6, 8)


@pytest.mark.parametrize("name", VARIANTS)
def test_turning_the_world_changes_nothing(name: str) -> None:
    network, estimates = new_network(VARIANTS[name]), random_estimates()
    before = numbers(network(estimates))
    for angle in (0.7, math.pi, -2.9):
        assert_alike(before, numbers(network(turned(estimates, angle))), 1e-9)


@pytest.mark.parametrize("name", VARIANTS)
def test_padding_changes_nothing(name: str) -> None:
    network, estimates = new_network(VARIANTS[name]), random_estimates()
    before = numbers(network(estimates))
    for junk in (0.3, 1.0, -7.0):
        after = numbers(network(padded(estimates, objects=3, walls=2, junk=junk)))
        cut = {
            k: v[:, :5, :6] if "wall" in k else v[:, :5, :5] if k in PAIRS else v[:, :5]
            for k, v in after.items()
        }
        assert_alike(before, cut, 1e-9)


PAIRS = ("touching", "farther_than", "relative_yaw")


@given(order=st.permutations(range(5)))
@settings(max_examples=8, deadline=None)
def test_the_order_of_objects_does_not_matter(network: ContextNetwork, order: list[int]) -> None:
    estimates, index = random_estimates(), torch.tensor(order)
    before = numbers(network(estimates))
    after = numbers(network(shuffled(estimates, index)))
    moved = {k: v[:, index][:, :, index] if k in PAIRS else v[:, index] for k, v in before.items()}
    assert_alike(moved, after, 1e-9)


def test_scenes_of_a_batch_know_nothing_of_each_other(network: ContextNetwork) -> None:
    both = numbers(network(random_estimates(scenes=2)))
    other = replace(random_estimates(scenes=2), score=random_estimates().score * 1.0)
    other.score[1] = 0.123
    other.output.delta[1] += 1.0
    changed = numbers(network(other))
    assert_alike({k: v[:1] for k, v in both.items()}, {k: v[:1] for k, v in changed.items()}, 1e-12)
    assert float((both["size_residual"][1] - changed["size_residual"][1]).abs().max()) > 1e-6


def test_relations_agree_in_both_directions(network: ContextNetwork) -> None:
    found = network(random_estimates()).relations
    assert found is not None
    assert torch.allclose(found.touching, found.touching.mT)
    assert torch.allclose(found.farther_than, -found.farther_than.mT)
    assert bool((found.touching.diagonal(dim1=1, dim2=2) == 0).all())
    reverse = [(8 - k) % 8 for k in range(8)]
    assert torch.allclose(found.relative_yaw, found.relative_yaw.transpose(1, 2)[..., reverse])
    angle = relative_yaw_angle(found.relative_yaw)
    off = torch.remainder(angle + angle.mT + 1e-6, 2 * math.pi)
    unsure = found.relative_yaw.topk(2, dim=-1).values.diff(dim=-1).abs().squeeze(-1) < 1e-9
    assert float(off[~unsure].max()) < 1e-4


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.parametrize("name", ["full", "Im3D"])
def test_few_objects(name: str, count: int) -> None:
    network = new_network(VARIANTS[name])
    output = network(random_estimates(n=count))
    assert output.output.delta.shape == (2, count, 2)
    for value in numbers(output).values():
        assert bool(value.isfinite().all())


def test_a_room_that_nobody_knows(network: ContextNetwork) -> None:
    estimates = random_estimates()
    absent = replace(
        estimates, polygon=estimates.polygon[:, :0], wall_valid=estimates.wall_valid[:, :0]
    )
    hidden = replace(estimates, wall_valid=torch.zeros_like(estimates.wall_valid))
    first, second = numbers(network(absent)), numbers(network(hidden))
    assert_alike(
        {k: v for k, v in first.items() if "wall" not in k},
        {k: v for k, v in second.items() if "wall" not in k},
        1e-9,
    )


def with_gradient(estimates: Estimates) -> tuple[Estimates, dict[str, Tensor]]:
    leaves = {
        f.name: getattr(estimates.output, f.name).clone().requires_grad_()
        for f in fields(PoseOutput)
    }
    return replace(estimates, output=PoseOutput(**leaves)), leaves


@pytest.mark.parametrize("name", ["full", "paper"])
def test_gradients_are_finite_and_reach_the_initial_estimates(name: str) -> None:
    network = new_network(VARIANTS[name])
    estimates, leaves = with_gradient(padded(random_estimates(), 2, 1, junk=0.0))
    output = network(estimates)
    assert output.relations is not None
    mask = relation_masks(output.valid, output.wall_valid)
    said = [getattr(output.relations, f.name)[mask[f.name]] for f in fields(RelationBatch)]
    torch.cat([value.flatten() for value in said]).square().sum().backward()
    for leaf_name, leaf in leaves.items():
        assert leaf.grad is not None
        assert bool(leaf.grad.isfinite().all()), leaf_name
        assert bool((leaf.grad[:, :5].abs().sum(dim=-1) > 0).all()), leaf_name
        assert float(leaf.grad[:, 5:].abs().max()) == 0, leaf_name
    for parameter_name, parameter in network.named_parameters():
        if not parameter_name.startswith("boxes"):
            assert parameter.grad is not None, parameter_name
            assert bool(parameter.grad.isfinite().all()), parameter_name


def test_gradients_are_finite_at_the_camera_and_of_flat_boxes(network: ContextNetwork) -> None:
    estimates, leaves = with_gradient(random_estimates())
    with torch.no_grad():
        leaves["distance_logit"][:, 0, 0] = 9.0
        leaves["distance_residual"][:, 0] = -3.0
        leaves["size_residual"][:, 1] = -4.0
        leaves["delta"][:, 2] = 0.0
    above = estimates.bfov.clone()
    above[:, 2, 1] = math.pi / 2
    estimates = replace(estimates, bfov=above)
    output = network(estimates)
    boxes = boxes_from_output(output.output, estimates)
    assert output.relations is not None
    (output.relations.touching_wall.sum() + boxes.centre.sum() + boxes.size.sum()).backward()
    for name, leaf in leaves.items():
        assert leaf.grad is not None
        assert bool(leaf.grad.isfinite().all()), name


def test_the_refinement_starts_small_and_is_added() -> None:
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        network = build_context(TINY).double().eval()
    estimates = random_estimates()
    refined = network(estimates).output
    for field in fields(PoseOutput):
        initial = getattr(estimates.output, field.name)
        assert torch.allclose(getattr(refined, field.name), initial, atol=0.05)
    logit = estimates.output.distance_logit + 3.0
    # logits that are all higher mean the same to the network, and come back higher
    moved = replace(estimates, output=replace(estimates.output, distance_logit=logit))
    assert torch.allclose(network(moved).output.distance_logit, refined.distance_logit + 3.0)


@pytest.mark.parametrize(
    ("switch", "names"),
    [("relation_features", ("relation.0.weight",)), ("object_features", ("object.0.weight",))],
)
def test_switches_take_inputs_away(switch: str, names: tuple[str, ...]) -> None:
    whole, less = new_network(TINY), new_network(TINY.model_copy(update={switch: False}))
    changed = {
        name
        for name, value in whole.state_dict().items()
        if value.shape != less.state_dict()[name].shape
    }
    assert changed == set(names)


def test_without_distances_to_the_room_objects_only_hear_of_it_from_walls() -> None:
    config = VARIANTS["Im3D"].model_copy(update={"object_features": False})
    network, estimates = new_network(config), random_estimates()
    hidden = replace(estimates, wall_valid=torch.zeros_like(estimates.wall_valid))
    hidden_and_higher = replace(hidden, ceiling=estimates.ceiling + 1)
    assert_alike(numbers(network(hidden)), numbers(network(hidden_and_higher)), 1e-12)
    higher = numbers(network(replace(estimates, ceiling=estimates.ceiling + 1)))
    off = (higher["delta"] - numbers(network(estimates))["delta"]).abs().max()
    assert float(off) > 1e-9


def test_sizes_of_the_two_editions() -> None:
    paper, compact = (build_context(CONFIGS[edition]) for edition in ("paper", "compact"))
    assert sum(p.numel() for p in paper.parameters()) == pytest.approx(5.1e6, rel=0.01)
    assert sum(p.numel() for p in compact.parameters()) < 0.5e6


def test_errors_say_what_does_not_fit(network: ContextNetwork) -> None:
    with pytest.raises(ValueError, match="appearance: found 13 numbers, expected 12"):
        network(random_estimates(config=TINY.model_copy(update={"appearance": 13})))
    with pytest.raises(ValueError, match="relation_heads: found True with a single node"):
        ContextConfig.model_validate(TINY.model_dump() | {"room": "node"})
