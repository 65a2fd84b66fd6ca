"""Random estimates in L-shaped rooms, and what turning, shuffling and padding do to them."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
import torch
from torch import Tensor

from panoscene.geometry import BoxCode, encode_boxes, wrap_angle
from panoscene.models.context import (
    CONFIGS,
    ContextConfig,
    ContextNetwork,
    ContextTargets,
    Estimates,
    RelationBatch,
    build_context,
)
from panoscene.models.pose import PoseOutput
from panoscene.scene import MEAN_SIZE, relations_from_boxes
from panoscene.synth import sample_room

TINY = CONFIGS["compact"].model_copy(
    update={"appearance": 12, "codes": 20, "blobs": 3, "width": 24, "hidden": 16, "dropout": 0.0}
)
OBJECTS = ("bfov", "category", "score", "valid", "appearance", "shape_code", "blob_centre")
WALLS = ("polygon", "wall_valid")


def new_network(config: ContextConfig = TINY, seed: int = 0) -> ContextNetwork:
    """A network in double precision, whose refinement is large enough to be seen."""
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(seed)
        network = build_context(config).double().eval()
        with torch.no_grad():
            for head in network.boxes.children():
                head.get_parameter("3.weight").normal_(std=0.1)
    return network


def random_estimates(
    scenes: int = 2, n: int = 5, seed: int = 0, config: ContextConfig = TINY
) -> Estimates:
    """Estimates of anything in an L-shaped room, in double precision, without padding."""
    generator = torch.Generator().manual_seed(seed)

    def normal(*shape: int) -> Tensor:
        return torch.randn(scenes, n, *shape, generator=generator, dtype=torch.float64)

    low = torch.tensor([-3.14, -0.7, 0.1, 0.1], dtype=torch.float64)
    high = torch.tensor([3.14, 0.4, 1.2, 0.9], dtype=torch.float64)
    share = torch.rand(scenes, n, 4, generator=generator, dtype=torch.float64)
    category = torch.randint(0, 57, (scenes, n), generator=generator)
    polygon = torch.tensor([[-3, -3], [3, -3], [3, 1], [1, 1], [1, 3], [-3, 3]]).double()
    return Estimates(
        bfov=low + share * (high - low),
        category=category,
        score=torch.rand(scenes, n, generator=generator, dtype=torch.float64),
        valid=torch.ones(scenes, n, dtype=torch.bool),
        output=PoseOutput(
            delta=normal(2) * 0.1,
            distance_logit=normal(6),
            distance_residual=normal(6) * 0.2,
            yaw_logit=normal(6),
            yaw_residual=normal(6) * 0.2,
            size_residual=normal(3) * 0.1,
        ),
        appearance=normal(config.appearance),
        shape_code=normal(config.codes),
        blob_centre=normal(config.blobs, 3).clamp(-0.5, 0.5),
        mean_size=MEAN_SIZE.double()[category],
        camera_height=torch.full((scenes,), 1.6, dtype=torch.float64),
        polygon=polygon.expand(scenes, 6, 2).contiguous(),
        wall_valid=torch.ones(scenes, 6, dtype=torch.bool),
        ceiling=torch.full((scenes,), 2.7, dtype=torch.float64),
    )


def turned(estimates: Estimates, angle: float) -> Estimates:
    """The same in a world turned counter-clockwise from above."""
    lon = wrap_angle(estimates.bfov[..., :1] - angle)
    cos, sin = math.cos(angle), math.sin(angle)
    matrix = torch.tensor([[cos, -sin], [sin, cos]], dtype=estimates.polygon.dtype)
    return replace(
        estimates,
        bfov=torch.cat([lon, estimates.bfov[..., 1:]], dim=-1),
        polygon=estimates.polygon @ matrix.T,
    )


def shuffled(estimates: Estimates, order: Tensor) -> Estimates:
    """The same with its objects in another order."""
    output = {f.name: getattr(estimates.output, f.name)[:, order] for f in fields(PoseOutput)}
    changed = {name: getattr(estimates, name)[:, order] for name in (*OBJECTS, "mean_size")}
    return replace(estimates, output=PoseOutput(**output), **changed)


def padded(estimates: Estimates, objects: int, walls: int, junk: float = 0.3) -> Estimates:
    """The same with more objects and walls that are not there; junk is what they hold."""

    def more(value: Tensor) -> Tensor:
        fill = torch.full_like(value[:, :1], junk if value.is_floating_point() else 0)
        return torch.cat([value, fill.expand(-1, objects, *value.shape[2:])], dim=1)

    output = {f.name: more(getattr(estimates.output, f.name)) for f in fields(PoseOutput)}
    changed = {name: more(getattr(estimates, name)) for name in (*OBJECTS, "mean_size")}
    last = estimates.polygon[:, -1:].expand(-1, walls, 2)
    missing = torch.zeros_like(estimates.wall_valid[:, :1]).expand(-1, walls)
    return replace(
        estimates,
        output=PoseOutput(**output),
        polygon=torch.cat([estimates.polygon, last], dim=1),
        wall_valid=torch.cat([estimates.wall_valid, missing], dim=1),
        **changed,
    )


def furnished(seed: int = 3, noise: float = 0.15) -> tuple[Estimates, ContextTargets]:
    """A sampled room: what a pose network might say of it, and the truth."""
    scene = sample_room(np.random.default_rng(seed), objects=10)
    objects, layout = scene.objects, scene.layout
    camera_height = scene.panorama.camera_height
    mean_size = MEAN_SIZE[objects.category]
    code = encode_boxes(objects.boxes, objects.bfov, mean_size, camera_height)
    generator = torch.Generator().manual_seed(seed)
    n = len(objects.category)

    def off(value: Tensor) -> Tensor:
        return value + noise * torch.randn(value.shape, generator=generator)

    def bins(index: Tensor) -> Tensor:
        return 2 * torch.nn.functional.one_hot(index, 6).float()

    relations = relations_from_boxes(objects.boxes, layout, camera_height)
    estimates = Estimates(
        bfov=objects.bfov[None],
        category=objects.category[None],
        score=objects.score[None],
        valid=torch.ones(1, n, dtype=torch.bool),
        output=PoseOutput(
            delta=off(code.delta)[None],
            distance_logit=bins(code.distance_bin)[None],
            distance_residual=off(code.distance_residual[:, None].expand(n, 6))[None],
            yaw_logit=bins(code.yaw_bin)[None],
            yaw_residual=off(code.yaw_residual[:, None].expand(n, 6))[None],
            size_residual=off(code.size_residual)[None],
        ),
        appearance=torch.randn(1, n, TINY.appearance, generator=generator),
        shape_code=torch.zeros(1, n, TINY.codes),
        blob_centre=torch.zeros(1, n, TINY.blobs, 3),
        mean_size=mean_size[None],
        camera_height=torch.tensor([camera_height]),
        polygon=layout.floor_polygon[None],
        wall_valid=torch.ones(1, len(layout.floor_polygon), dtype=torch.bool),
        ceiling=torch.tensor([layout.ceiling_height]),
    )
    target = ContextTargets(
        code=BoxCode(**{f.name: getattr(code, f.name)[None] for f in fields(BoxCode)}),
        matched=torch.ones(1, n, dtype=torch.bool),
        relations=RelationBatch(
            **{f.name: getattr(relations, f.name)[None] for f in fields(RelationBatch)}
        ),
    )
    return estimates, target


@pytest.fixture(scope="module")
def network() -> ContextNetwork:
    """A small network in double precision, in evaluation mode."""
    return new_network()
