"""Scenes for the relation graph network, as padded batches and as its own records."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from panoscene.geometry import BoxCode
from panoscene.models.context import ContextTargets, Estimates, RelationBatch
from panoscene.models.pose import PoseOutput
from panoscene.models.shape import ShapeConfig, blob_centres
from panoscene.scene import Layout, Relations

from ._context_noise import OutputNoise
from ._pose_samples import CODE, code_of, padded

RELATIONS = tuple(field.name for field in fields(Relations))
"""Names of the relations."""
AMONG_OBJECTS = ("touching", "farther_than", "relative_yaw")
"""Relations between two objects."""
WITH_WALLS = ("touching_wall", "relative_yaw_wall")
"""Relations between an object and a wall."""
_PLAIN = ("bfov", "category", "score", "appearance", "shape_code", "clues", "mean_size", "matched")


@dataclass(frozen=True, slots=True)
class ContextSample:
    """The n objects and m walls of one scene; ``collate_context`` makes a padded batch."""

    bfov: Float[Tensor, "n 4"]
    category: Int64[Tensor, " n"]
    score: Float[Tensor, " n"]
    appearance: Float[Tensor, "n features"]
    shape_code: Float[Tensor, "n codes"]
    clues: Float[Tensor, "n clues"]
    """Of the pose network, in the sample's layout."""
    mean_size: Float[Tensor, "n 3"]
    layout: Layout
    """That the networks are told."""
    camera_height: float
    code: BoxCode
    matched: Bool[Tensor, " n"]
    """Whether code and relations are known."""
    relations: Relations
    """Between the true boxes and the layout that the networks are told; 0 where nothing is
    known."""
    noise: OutputNoise
    """To be added to what the pose network says."""


def collate_context(samples: Sequence[ContextSample]) -> dict[str, Tensor]:
    """Return scenes as one batch, all padded to the most objects and walls.

    Keys are the fields of ``ContextSample``, of its code, relations and noise; of the layout
    ``polygon``, ``ceiling`` and ``wall_valid``. ``valid`` is False for padding.
    """
    n = max(1, *(len(sample.category) for sample in samples))
    m = max(len(sample.layout.floor_polygon) for sample in samples)
    batch = {name: padded([getattr(s, name) for s in samples], n) for name in _PLAIN}
    batch |= {name: padded([getattr(s.code, name) for s in samples], n) for name in CODE}
    for field in fields(OutputNoise):
        parts = [getattr(sample.noise, field.name) for sample in samples]
        batch[f"noise_{field.name}"] = padded(parts, n)
    for name in RELATIONS:
        columns = n if name in AMONG_OBJECTS else m if name in WITH_WALLS else 0
        parts = [getattr(sample.relations, name) for sample in samples]
        batch[name] = _padded_pairs(parts, n, columns) if columns else padded(parts, n)
    count = torch.tensor([len(sample.category) for sample in samples])
    batch["valid"] = torch.arange(n) < count.unsqueeze(-1)
    # nothing is divided by the extents of padding
    padding = ~batch["valid"].unsqueeze(-1)
    batch["bfov"] = batch["bfov"].masked_fill(padding, 0.1)
    batch["mean_size"] = batch["mean_size"].masked_fill(padding, 1.0)
    corners = [sample.layout.floor_polygon for sample in samples]
    batch["polygon"] = torch.stack([torch.cat([p, p[-1:].expand(m - len(p), 2)]) for p in corners])
    walls = torch.tensor([len(p) for p in corners])
    batch["wall_valid"] = torch.arange(m) < walls.unsqueeze(-1)
    batch["ceiling"] = torch.tensor([sample.layout.ceiling_height for sample in samples])
    batch["camera_height"] = torch.tensor([sample.camera_height for sample in samples])
    return batch


def estimates_of(
    batch: Mapping[str, Tensor], output: PoseOutput, shape: ShapeConfig | None = None
) -> Estimates:
    """Return what the relation graph network is given.

    Args:
        batch: From ``collate_context``.
        output: Of the pose network for it.
        shape: Of the network that the codes are from; None where there are no codes.
    """
    size = (output.size_residual.detach() + 1) * batch["mean_size"]
    return Estimates(
        bfov=batch["bfov"],
        category=batch["category"],
        score=batch["score"],
        valid=batch["valid"],
        output=output,
        appearance=batch["appearance"],
        shape_code=batch["shape_code"],
        blob_centre=(
            size.new_zeros(*size.shape[:-1], 0, 3)
            if shape is None
            else blob_centres(batch["shape_code"], size, shape)
        ),
        mean_size=batch["mean_size"],
        camera_height=batch["camera_height"],
        polygon=batch["polygon"],
        wall_valid=batch["wall_valid"],
        ceiling=batch["ceiling"],
    )


def targets_of(batch: Mapping[str, Tensor]) -> ContextTargets:
    """Return what the relation graph network should say.

    Args:
        batch: From ``collate_context``.
    """
    return ContextTargets(
        code=code_of(batch),
        matched=batch["matched"],
        relations=RelationBatch(**{name: batch[name] for name in RELATIONS}),
    )


def _padded_pairs(parts: Sequence[Tensor], rows: int, columns: int) -> Tensor:
    whole = parts[0].new_zeros(len(parts), rows, columns, *parts[0].shape[2:])
    for k, part in enumerate(parts):
        whole[k, : part.shape[0], : part.shape[1]] = part
    return whole
