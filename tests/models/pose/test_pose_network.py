"""The pose network: shapes, sizes, attention, losses."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry import OrientedBoxes, encode_boxes
from panoscene.models.pose import (
    CLUES,
    CONFIGS,
    LOSS_WEIGHTS,
    PoseConfig,
    PoseNetwork,
    PoseOutput,
    RelationalAttention,
    build_pose,
    pair_embedding,
    pose_losses,
)

TINY = CONFIGS["compact"].model_copy(update={"crop_px": 64, "features": 32, "dropout": 0.0})


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def random_bfov(*shape: int, seed: int = 0) -> torch.Tensor:
    low = torch.tensor([-3.1, -1.0, 0.1, 0.1])
    high = torch.tensor([3.1, 1.0, 1.5, 1.2])
    return low + torch.rand(*shape, 4, generator=generator(seed)) * (high - low)


@pytest.fixture(scope="module")
def tiny() -> PoseNetwork:
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        return build_pose(TINY).eval()


def run(
    network: PoseNetwork, n: int, valid: torch.Tensor, side: int = 64, seed: int = 0
) -> PoseOutput:
    scenes = len(valid)
    crops = torch.rand(int(valid.sum()), 3, side, side, generator=generator(seed))
    category = torch.arange(n).expand(scenes, n)
    clues = torch.rand(scenes, n, CLUES, generator=generator(seed + 1))
    with torch.no_grad():
        return network(crops, random_bfov(scenes, n, seed=seed), category, valid, clues=clues)


def test_paper_edition_has_the_sizes_of_the_paper() -> None:
    with torch.device("meta"):
        network = build_pose(CONFIGS["paper"])
        crops = torch.rand(3, 3, 256, 256)
        valid = torch.ones(1, 3, dtype=torch.bool)
        assert network.encoded(crops).shape == (3, 2048)
        related = network.attention(torch.rand(1, 3, 2048), torch.rand(1, 3, 4), valid)
    assert related.shape == (1, 3, 2048)
    assert network.size[0].in_features == 2048 + 57
    # ResNet-34 without its classifier; keys, queries, 64 -> 16, two scalars; four heads
    assert sum(p.numel() for p in network.backbone.parameters()) == 21_284_672
    attention = 2 * (2048 * 1024 + 1024) + 64 * 16 + 16 + 2
    assert sum(p.numel() for p in network.attention.parameters()) == attention
    heads = sum((2105 * 128 + 128) + (128 * out + out) for out in (3, 12, 12, 2))
    whole = 21_284_672 + attention + heads
    assert sum(p.numel() for p in network.parameters()) == whole


def test_compact_edition_fits_into_nine_megabytes() -> None:
    with torch.device("meta"):
        network = build_pose(CONFIGS["compact"])
    numbers = sum(tensor.numel() for tensor in network.state_dict().values())
    assert 2 * numbers < 9e6


def test_output_shapes_with_padding_and_of_nothing(tiny: PoseNetwork) -> None:
    valid = torch.tensor([[True, True, False], [True, False, False]])
    output = run(tiny, 3, valid)
    assert output.delta.shape == (2, 3, 2)
    assert output.size_residual.shape == (2, 3, 3)
    for name in ("distance_logit", "distance_residual", "yaw_logit", "yaw_residual"):
        assert getattr(output, name).shape == (2, 3, 6)
    assert bool(output.delta.isfinite().all())
    nothing = run(tiny, 0, torch.zeros(1, 0, dtype=torch.bool))
    assert nothing.size_residual.shape == (1, 0, 3)


def test_padding_changes_nothing(tiny: PoseNetwork) -> None:
    alone, padded = (run_one(tiny, padding) for padding in (0, 3))
    assert torch.allclose(alone.delta, padded.delta[:, :4], atol=1e-5)
    assert torch.allclose(alone.distance_logit, padded.distance_logit[:, :4], atol=1e-4)


def run_one(network: PoseNetwork, padding: int) -> PoseOutput:
    crops = torch.rand(4, 3, 64, 64, generator=generator())
    bfov, clues = random_bfov(1, 4), torch.rand(1, 4, CLUES, generator=generator(1))
    category, valid = torch.arange(4)[None], torch.ones(1, 4, dtype=torch.bool)
    if padding:
        bfov = torch.cat([bfov, torch.full((1, padding, 4), 0.1)], dim=1)
        clues = torch.cat([clues, torch.zeros(1, padding, CLUES)], dim=1)
        category = torch.cat([category, category.new_zeros(1, padding)], dim=1)
        valid = torch.cat([valid, valid.new_zeros(1, padding)], dim=1)
    with torch.no_grad():
        return network(crops, bfov, category, valid, clues=clues)


def test_objects_without_crops_are_judged_by_the_rest(tiny: PoseNetwork) -> None:
    valid = torch.ones(1, 3, dtype=torch.bool)
    pictured = torch.tensor([[True, False, True]])
    clues, category = torch.rand(1, 3, CLUES, generator=generator()), torch.arange(3)[None]
    with torch.no_grad():
        output = tiny(
            torch.rand(2, 3, 64, 64, generator=generator()), random_bfov(1, 3), category, valid,
            clues=clues, pictured=pictured,
        )  # fmt: skip
    assert bool(output.delta.isfinite().all())


def test_network_refuses_wrong_numbers_of_crops_and_no_clues(tiny: PoseNetwork) -> None:
    bfov, category = random_bfov(1, 2), torch.zeros(1, 2, dtype=torch.int64)
    valid = torch.ones(1, 2, dtype=torch.bool)
    with pytest.raises(ValueError, match="crops: found 1, expected 2"):
        tiny(torch.rand(1, 3, 64, 64), bfov, category, valid, clues=torch.zeros(1, 2, CLUES))
    with pytest.raises(ValueError, match="clues: found none"):
        tiny(torch.rand(2, 3, 64, 64), bfov, category, valid)


@pytest.mark.parametrize(
    ("changes", "words"), [({"pool": 9}, "pool: found 9"), ({"crop_px": 32, "pool": 2}, "pool")]
)
def test_build_refuses_windows_larger_than_the_map(changes: dict[str, int], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        build_pose(TINY.model_copy(update=changes))


def test_config_refuses_groups_that_do_not_divide_features() -> None:
    with pytest.raises(ValueError, match="expected a multiple of 16"):
        PoseConfig(
            backbone="resnet18", crop_px=64, pool=1, features=40, groups=16, key_channels=8,
            dropout=0.0, clues=False,
        )  # fmt: skip


@settings(max_examples=15, deadline=None)
@given(turn=st.floats(-10, 10), seed=st.integers(0, 99))
def test_pair_embedding_knows_no_seam(turn: float, seed: int) -> None:
    bfov = random_bfov(5, seed=seed).double()
    turned = bfov.clone()
    turned[:, 0] = (turned[:, 0] + turn + torch.pi) % (2 * torch.pi) - torch.pi
    assert torch.allclose(pair_embedding(bfov), pair_embedding(turned), atol=1e-6)


def test_pair_embedding_by_hand() -> None:
    bfov = torch.tensor([[0.0, 0.0, 1.0, 1.0], [0.5, 0.2, 2.0, 0.5]])
    pair = pair_embedding(bfov)[1, 0].reshape(4, 8, 2)  # of the second, as the first sees it
    wanted = torch.tensor([0.5, 0.2, torch.tensor(2.0).log(), torch.tensor(0.5).log()])
    assert torch.allclose(pair[:, 0, 0], wanted.sin(), atol=1e-6)
    assert torch.allclose(pair[:, 1, 1], (wanted * 10000 ** (-1 / 8)).cos(), atol=1e-6)


def test_attention_is_that_of_a_loop_over_groups() -> None:
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(1)
        layer = RelationalAttention(8, 2, 4)
    feature = torch.rand(1, 3, 8, generator=generator())
    bfov = random_bfov(1, 3)
    valid = torch.tensor([[True, True, False]])
    with torch.no_grad():
        found = layer(feature, bfov, valid)[0]
        geometric = layer.geometry(pair_embedding(bfov[0])).clamp(min=1e-6).log()
        key, query = layer.key(feature[0]), layer.query(feature[0])
        for group in range(2):
            part = slice(4 * group, 4 * group + 4)
            for target in range(2):
                logit = [
                    geometric[target, source, group] + (query[target, part] @ key[source, part]) / 2
                    for source in range(2)
                ]
                weight = torch.stack(logit).softmax(0)
                wanted = feature[0, target, part] + weight @ feature[0, :2, part]
                assert torch.allclose(found[target, part], wanted, atol=1e-5)


def test_losses_of_the_truth_are_nothing_but_cross_entropy() -> None:
    boxes = OrientedBoxes(
        torch.tensor([[1.0, 3.0, 0.5], [-2.0, 1.0, 1.0]]),
        torch.ones(2, 3),
        torch.tensor([0.3, 2.0]),
    )
    bfov, size = random_bfov(2), torch.full((2, 3), 0.8)
    code = encode_boxes(boxes, bfov, size, 1.6)
    sure = torch.nn.functional.one_hot
    output = PoseOutput(
        delta=code.delta,
        distance_logit=100.0 * sure(code.distance_bin, 6),
        distance_residual=code.distance_residual[:, None].expand(2, 6),
        yaw_logit=100.0 * sure(code.yaw_bin, 6),
        yaw_residual=code.yaw_residual[:, None].expand(2, 6),
        size_residual=code.size_residual,
    )
    losses = pose_losses(output, code, torch.ones(2, dtype=torch.bool))
    assert set(losses) == set(LOSS_WEIGHTS)
    assert all(float(value) < 1e-6 for value in losses.values())
    # half a unit off in one of two offsets: 10 * (0.5^2 / 2) / 2 over two objects, smooth L1
    worse = PoseOutput(
        **{k: getattr(output, k) for k in PoseOutput.__slots__}
        | {"distance_residual": output.distance_residual + torch.tensor([[0.5], [0.0]])}
    )
    both = pose_losses(worse, code, torch.ones(2, dtype=torch.bool))
    assert float(both["distance_residual"]) == pytest.approx(10 * 0.125 / 2, rel=1e-4)
    sharp = pose_losses(worse, code, torch.ones(2, dtype=torch.bool), beta=0.1)
    assert float(sharp["distance_residual"]) == pytest.approx(10 * 0.45 / 2, rel=1e-4)
    assert float(pose_losses(worse, code, torch.zeros(2, dtype=torch.bool))["size"]) == 0.0
    unmatched = pose_losses(worse, code, torch.tensor([False, True]))
    assert float(unmatched["distance_residual"]) < 1e-6
