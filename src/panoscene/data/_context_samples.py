"""Training samples of the relation graph network: what the first stages see, and the truth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import torch
from jaxtyping import Bool, Float, Int64
from pydantic import BaseModel, ConfigDict
from torch import Tensor

from panoscene.geometry import OrientedBoxes, encode_boxes
from panoscene.models.pose import pose_clues
from panoscene.scene import Layout, Relations, Scene, relations_from_boxes
from panoscene.synth.dataset import PanoramaItem

from ._context_batch import AMONG_OBJECTS, RELATIONS, ContextSample
from ._context_noise import OutputNoise, output_noise
from ._context_records import EncodedObjects, EstimateRecord
from ._draw import Draw
from ._pose_samples import (
    random_turn,
    turned_bfov,
    turned_boxes,
    turned_layout,
)

_SOMEWHERE = (0.0, 2.0, 1.0)


class ContextAugmentation(BaseModel):
    """How a training sample differs from what the first stages saw."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    detections: float = 0.4
    """Share of the samples with detections; the others have true BFoVs, as they are or moved."""
    moved: float = 0.6
    """Share of the latter that are moved as a detector would, where there are such."""
    dropped: float = 0.3
    """Largest share of the objects of a sample that are left out."""
    spurious: int = 3
    """Most objects that a sample takes over from another scene; nothing is known of them."""
    most_objects: int = 28
    """Of a sample; more are left out at random."""
    unsure: float = 0.5
    """Share of the samples with true BFoVs that get scores of a detector."""
    true_layout: float = 0.4
    """Share of the samples with the true layout instead of the estimated one."""
    wall: float = 0.04
    """Deviation of the room's extents, as a share of them: estimates of layouts that the layout
    network was trained with are better than others."""
    shift: float = 0.06
    """Metres: deviation of the room's place."""
    delta: float = 0.015
    """Deviation of what is added to the initial offsets."""
    distance: float = 0.02
    """Likewise the distances, as a share of them."""
    size: float = 0.03
    """Likewise the sizes."""
    yaw_deg: float = 1.5
    """Likewise the yaws."""
    logit: float = 0.2
    """Likewise the logits of the bins."""
    turned: float = 0.02
    """Share of the objects whose initial yaw is turned by half a turn."""
    blind: float = 0.2
    """Share of the objects without appearance and shape."""


@dataclass(frozen=True, slots=True)
class ContextScene:
    """A panorama, what is to be learnt from it, and what the first stages see of it."""

    item: PanoramaItem
    scene: Scene
    record: EstimateRecord


@dataclass(frozen=True, slots=True)
class _Chosen:
    """Objects of a sample; ``mirror`` is what they look like."""

    bfov: Float[Tensor, "n 4"]
    category: Int64[Tensor, " n"]
    score: Float[Tensor, " n"]
    target: Int64[Tensor, " n"]
    appearance: Float[Tensor, "n features"]
    shape_code: Float[Tensor, "n codes"]


def read_context_scenes(
    items: Sequence[PanoramaItem], records: Mapping[str, EstimateRecord]
) -> list[ContextScene]:
    """Return the panoramas that show objects, with their truth and their records.

    Args:
        items: Of a data set.
        records: By name, from ``read_estimate_records``; items without one are left out.

    Raises:
        SceneFormatError: A scene file is missing or damaged.
    """
    scenes = [
        ContextScene(item, item.scene(), records[item.name])
        for item in items
        if item.name in records
    ]
    return [scene for scene in scenes if len(scene.scene.objects.category)]


def context_sample(
    sources: Sequence[ContextScene],
    index: int,
    mean_size: Float[Tensor, "57 3"],
    generator: torch.Generator,
    *,
    augmentation: ContextAugmentation | None = None,
) -> ContextSample:
    """Return a scene as a training sample; the same generator gives the same sample.

    The world is turned about the vertical and mirrored at random; BFoVs, boxes, walls and
    relations follow exactly. Objects are left out, others come from another scene; the layout is
    the true one or the estimate, and is stretched a little.

    Args:
        sources: The scenes of the training.
        index: Which of them.
        mean_size: Metres, of each category: that of the pose network.
        generator: Of all that is random.
        augmentation: How much is changed.
    """
    change = augmentation or ContextAugmentation()
    draw = Draw(generator)
    source = sources[index]
    turned_from_world = random_turn(generator)
    mirrored = int(torch.linalg.det(turned_from_world) < 0)
    chosen = _kept(_view(source, change, draw), mirrored, change, draw)
    chosen = replace(chosen, bfov=turned_bfov(chosen.bfov, turned_from_world))
    strange = draw.whole(0, change.spurious + 1)
    if strange and len(sources) > 1:
        other = sources[(index + draw.whole(1, len(sources))) % len(sources)]
        chosen = _with(chosen, _strangers(_view(other, change, draw), strange, draw))
    layout = _random_layout(source, turned_from_world, change, draw)
    truth = turned_boxes(source.scene.objects.boxes, turned_from_world)
    seen = torch.rand(len(chosen.category), generator=generator) >= change.blind
    noise = output_noise(
        len(chosen.category), generator, delta=change.delta, distance=change.distance,
        size=change.size, yaw_deg=change.yaw_deg, logit=change.logit, turned=change.turned,
    )  # fmt: skip
    height = source.scene.panorama.camera_height
    return _sample(chosen, truth, layout, height, mean_size=mean_size, noise=noise, seen=seen)


def plain_context_sample(
    source: ContextScene,
    view: EncodedObjects,
    layout: Layout,
    mean_size: Float[Tensor, "57 3"],
) -> ContextSample:
    """Return a scene as it is, for validation.

    Args:
        source: The scene.
        view: Which of its objects, such as ``source.record.found``.
        layout: That the networks are told.
        mean_size: Metres, of each category: that of the pose network.
    """
    chosen = _Chosen(
        view.bfov, view.category, view.score, view.target, view.appearance[0], view.shape_code[0]
    )
    height = source.scene.panorama.camera_height
    noise = OutputNoise.none(len(view.category))
    truth = source.scene.objects.boxes
    return _sample(chosen, truth, layout, height, mean_size=mean_size, noise=noise)


def _sample(
    chosen: _Chosen,
    truth: OrientedBoxes,
    layout: Layout,
    camera_height: float,
    *,
    mean_size: Float[Tensor, "57 3"],
    noise: OutputNoise,
    seen: Bool[Tensor, " n"] | None = None,
) -> ContextSample:
    """Return objects with their targets; ``seen`` is False where crops are not looked at."""
    matched = chosen.target >= 0
    size = mean_size[chosen.category]
    known = chosen.target[matched]
    boxes = _boxes_or_any(truth, chosen.target)
    shown = torch.ones_like(matched) if seen is None else seen
    return ContextSample(
        bfov=chosen.bfov,
        category=chosen.category,
        score=chosen.score,
        appearance=chosen.appearance * shown.unsqueeze(-1),
        shape_code=chosen.shape_code * shown.unsqueeze(-1),
        clues=pose_clues(chosen.bfov, size, camera_height, layout),
        mean_size=size,
        layout=layout,
        camera_height=camera_height,
        code=encode_boxes(boxes, chosen.bfov, size, camera_height),
        matched=matched,
        relations=_scattered(
            relations_from_boxes(truth[known], layout, camera_height, inside="any_corner"), matched
        ),
        noise=noise,
    )


def _view(source: ContextScene, change: ContextAugmentation, draw: Draw) -> EncodedObjects:
    """Return detections, true BFoVs, or moved ones with scores as detections have them."""
    record = source.record
    found, moved = draw.chance(change.detections), draw.chance(change.moved)
    unsure = draw.chance(change.unsure)
    if found and bool((record.found.target >= 0).any()):
        return record.found
    view = record.true
    if moved and record.moved:
        view = record.moved[draw.whole(0, len(record.moved))]
    if not unsure:
        return view
    score = draw.uniforms(len(view.score), 0.2, 1.0)
    return replace(view, score=score)


def _kept(view: EncodedObjects, mirrored: int, change: ContextAugmentation, draw: Draw) -> _Chosen:
    """Return some of the objects in a random order, at least one that is known."""
    count = len(view.category)
    share = draw.uniform(0.0, change.dropped)
    order = torch.randperm(count, generator=draw.generator)
    stays = torch.rand(count, generator=draw.generator) >= share
    stays[(view.target[order] >= 0).int().argmax()] = True
    index = order[stays][: change.most_objects]
    return _picked(view, index, mirrored)


def _strangers(view: EncodedObjects, count: int, draw: Draw) -> _Chosen:
    """Return a few objects of another scene, each in some direction; nothing is known of them."""
    index = torch.randperm(len(view.category), generator=draw.generator)[:count]
    chosen = _picked(view, index, draw.whole(0, 2))
    lon = draw.uniforms(len(index), -torch.pi, torch.pi)
    return replace(
        chosen,
        bfov=torch.cat([lon.unsqueeze(-1), chosen.bfov[:, 1:]], dim=-1),
        score=chosen.score * draw.uniforms(len(index), 0.4, 1.0),
        target=torch.full_like(index, -1),
    )


def _picked(view: EncodedObjects, index: Int64[Tensor, " k"], mirrored: int) -> _Chosen:
    return _Chosen(
        view.bfov[index],
        view.category[index],
        view.score[index],
        view.target[index],
        view.appearance[mirrored, index],
        view.shape_code[mirrored, index],
    )


def _with(first: _Chosen, second: _Chosen) -> _Chosen:
    return _Chosen(
        *(
            torch.cat([getattr(first, field.name), getattr(second, field.name)])
            for field in fields(_Chosen)
        )
    )


def _random_layout(
    source: ContextScene, matrix: Float[Tensor, "3 3"], change: ContextAugmentation, draw: Draw
) -> Layout:
    """Return the true or the estimated room, a little stretched and moved, then turned."""
    true, estimated = draw.chance(change.true_layout), source.record.layout
    random = torch.randn(5, generator=draw.generator)
    scale, shift = 1 + random[:3] * change.wall, random[3:] * change.shift
    layout = source.scene.layout if true or estimated is None else estimated
    return turned_layout(layout, matrix, scale, shift)


def _boxes_or_any(truth: OrientedBoxes, target: Int64[Tensor, " n"]) -> OrientedBoxes:
    """Return the true boxes of a target index; of those without one, any box."""
    known = target >= 0
    boxes = truth[target.clamp(min=0)] if len(truth) else _any_boxes(len(target), truth)
    return OrientedBoxes(
        torch.where(known.unsqueeze(-1), boxes.centre, boxes.centre.new_tensor(_SOMEWHERE)),
        torch.where(known.unsqueeze(-1), boxes.size, 1.0),
        torch.where(known, boxes.yaw, 0.0),
    )


def _any_boxes(count: int, like: OrientedBoxes) -> OrientedBoxes:
    one = like.centre.new_ones(count, 3)
    return OrientedBoxes(one, one, one[:, 0])


def _scattered(relations: Relations, matched: Bool[Tensor, " n"]) -> Relations:
    """Return relations of the matched objects as those of all, 0 where nothing is known."""
    place, count = matched.nonzero().squeeze(1), len(matched)

    def spread(name: str) -> Tensor:
        value = getattr(relations, name)
        rest = value.shape[2:] if name in AMONG_OBJECTS else value.shape[1:]
        rows = (count, count, *rest) if name in AMONG_OBJECTS else (count, *rest)
        whole = value.new_zeros(rows)
        at = (place[:, None], place[None, :]) if name in AMONG_OBJECTS else (place,)
        whole[at] = value
        return whole

    return Relations(**{name: spread(name) for name in RELATIONS})
