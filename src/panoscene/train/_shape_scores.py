"""How good predicted shapes are, against a similar model and against the box."""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from panoscene.data._shape_samples import Picture
from panoscene.data._shape_store import ModelShape
from panoscene.eval import ShapeErrors, shape_errors
from panoscene.models.shape import extract_meshes
from panoscene.scene import Mesh, box_mesh

from ._shape import ShapeTask

METHODS = ("network", "retrieval", "box")
_SIZE_NOISE = 0.1
_NAMES = ("chamfer", "f_score", "normal_consistency", "volume_iou")


def shape_scores(
    task: ShapeTask,
    *,
    limit: int | None = None,
    points: int = 2000,
    resolution: int = 64,
    seed: int = 0,
) -> dict[str, Any]:
    """Return mean errors in canonical space, by kind of object and method, and by category.

    Kinds: ``crops`` are objects of validation panoramas, whose models were trained on; ``unseen``
    are pictures of models that were not. Methods: ``network``; ``retrieval``, the training model
    of the category whose box has the most similar proportions; ``box``. The network and the
    retrieval are told sizes that are wrong by about 10 percent, as estimated ones are.

    Args:
        task: With the network to measure.
        limit: At most so many objects of each kind.
        points: Samples of each surface.
        resolution: Of the predicted meshes.
        seed: Of all samples.
    """
    generator = torch.Generator().manual_seed(seed)
    result: dict[str, Any] = {}
    for kind, everything in task.validation().items():
        chosen = everything
        if limit is not None and len(everything) > limit:
            order = torch.randperm(len(everything), generator=generator)[:limit]
            chosen = [everything[k] for k in order.sort().values.tolist()]
        if kind == "seen" or not chosen:
            continue
        found = _errors(task, chosen, points, resolution, generator)
        categories = [shape.category for _, shape in chosen]
        result[kind] = {
            "objects": len(chosen),
            "mean": {method: _mean(found[method]) for method in METHODS},
            "by_category": _by_category(found, categories),
        }
    return result


def nearest_model(task: ShapeTask, category: str, size: torch.Tensor, but: str = "") -> Mesh | None:
    """Return the canonical mesh of the training model whose proportions are most similar.

    Args:
        task: Whose training models are meant.
        category: It has the same.
        size: Of the box, in metres.
        but: Id of a model that is not taken.
    """
    names = [n for n in task.seen if task.shapes[n].category == category and n != but]
    if not names:
        return None
    sizes = torch.stack([torch.from_numpy(task.shapes[name].extent) for name in names])
    own, others = size.log() - size.log().mean(), sizes.log() - sizes.log().mean(1, keepdim=True)
    return canonical(task.shapes[names[int((own - others).square().sum(1).argmin())]])


def canonical(shape: ModelShape) -> Mesh:
    """Return the surface of a model in the canonical box."""
    vertices = torch.from_numpy(shape.vertices / shape.extent)
    return Mesh(vertices, torch.from_numpy(shape.faces.astype(np.int64)))


@torch.inference_mode()
def _errors(
    task: ShapeTask,
    chosen: Sequence[tuple[Picture, ModelShape]],
    points: int,
    resolution: int,
    generator: torch.Generator,
) -> dict[str, list[ShapeErrors]]:
    noise = (_SIZE_NOISE * torch.randn(len(chosen), 3, generator=generator)).exp()
    told = [
        (replace(picture, size=picture.size * factor), shape)
        for (picture, shape), factor in zip(chosen, noise, strict=True)
    ]
    meshes = extract_meshes(task.model, task.codes(told), resolution=resolution)
    found: dict[str, list[ShapeErrors]] = defaultdict(list)
    for (picture, shape), mesh in zip(told, meshes, strict=True):
        truth = canonical(shape)
        similar = nearest_model(task, shape.category, picture.size)
        for method, own in zip(METHODS, (mesh, similar, box_mesh()), strict=True):
            errors = ShapeErrors(math.inf, math.inf, 0.0, 0.0, 0.0)
            if own is not None:
                errors = shape_errors(own, truth, generator=generator, points=points)
            found[method].append(errors)
    return found


def _by_category(
    found: dict[str, list[ShapeErrors]], categories: list[str]
) -> dict[str, dict[str, dict[str, float | None]]]:
    result: dict[str, dict[str, dict[str, float | None]]] = {}
    for category in sorted(set(categories)):
        mine = [k for k, name in enumerate(categories) if name == category]
        result[category] = {
            method: _mean(found[method][k] for k in mine) | {"objects": len(mine)}
            for method in METHODS
        }
    return result


def _mean(errors: Iterable[ShapeErrors]) -> dict[str, float | None]:
    """Return means, None where nothing has a value.

    Shapes that were missed are left out of the Chamfer distance, and surfaces that do not close
    out of the overlap of volumes.
    """
    chosen = list(errors)
    result: dict[str, float | None] = {}
    for name in _NAMES:
        values = [getattr(one, name) for one in chosen]
        kept = [value for value in values if value is not None and np.isfinite(value)]
        result[name] = float(np.mean(kept)) if kept else None
    return result
