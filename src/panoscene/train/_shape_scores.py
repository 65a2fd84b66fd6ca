"""How good predicted shapes are, against a similar model and against the box."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from panoscene.data._shape_samples import Picture
from panoscene.data._shape_store import ModelShape
from panoscene.eval import ShapeErrors, shape_errors
from panoscene.eval._shape_errors import missed_shape
from panoscene.models.shape import extract_meshes, thin_boxes
from panoscene.scene import CATEGORIES, Mesh, box_mesh, built_in

from ._shape import ShapeTask

METHODS = ("network", "retrieval", "retrieval without the model", "box")
MEASURES = ("chamfer", "f_score", "normal_consistency", "volume_iou")
_SIZE_NOISE = 0.1

Shown = Sequence[tuple[Picture, ModelShape]]
"""Pictures, and the models they show."""
Means = dict[str, float | int | None]
"""Mean errors, and over how many objects they are."""


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
    are pictures of models that were not, ``seen`` of models that were. Methods: ``network``;
    ``retrieval``, the training model of the category whose box has the most similar proportions;
    ``retrieval without the model``, the same from a library without the model that is shown, where
    it is in there; ``box``. The network and the retrievals are told sizes that are wrong by about
    10 percent, as estimated ones are. Objects that the product gives a slab are left out: thin
    ones, doors and windows.

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
        chosen = _without_slabs(everything)
        slabs = len(everything) - len(chosen)
        if limit is not None and len(chosen) > limit:
            order = torch.randperm(len(chosen), generator=generator)[:limit]
            chosen = [chosen[k] for k in order.sort().values.tolist()]
        if not chosen:
            continue
        found = _errors(task, chosen, points, resolution, generator)
        categories = [shape.category for _, shape in chosen]
        result[kind] = {
            "objects": len(chosen),
            "slabs_left_out": slabs,
            "mean": {method: _mean(errors) for method, errors in found.items()},
            "by_category": _by_category(found, categories),
        }
    return result


def nearest_model(task: ShapeTask, category: str, size: torch.Tensor, but: str = "") -> Mesh | None:
    """Return the canonical mesh of the training model whose proportions are most similar.

    Args:
        task: Whose training models are meant.
        category: It has the same.
        size: Of the box, in metres.
        but: Id of a model that is not taken, nor are others made of the same one.
    """
    left_out = task.bases.get(but)
    names = [
        name
        for name in task.seen
        if task.shapes[name].category == category and task.bases[name] != left_out
    ]
    if not names:
        return None
    sizes = torch.stack([torch.from_numpy(task.shapes[name].extent) for name in names])
    own, others = size.log() - size.log().mean(), sizes.log() - sizes.log().mean(1, keepdim=True)
    return canonical(task.shapes[names[int((own - others).square().sum(1).argmin())]])


def canonical(shape: ModelShape) -> Mesh:
    """Return the surface of a model in the canonical box."""
    vertices = torch.from_numpy(shape.vertices / shape.extent)
    return Mesh(vertices, torch.from_numpy(shape.faces.astype(np.int64)))


def _without_slabs(everything: Shown) -> Shown:
    """Return what the product gives to the network: all but thin objects, doors and windows."""
    if not everything:
        return everything
    thin = thin_boxes(torch.stack([picture.size for picture, _ in everything]))
    category = torch.tensor([CATEGORIES.index(shape.category) for _, shape in everything])
    kept = (~(thin | built_in(category))).nonzero()[:, 0]
    return [everything[k] for k in kept.tolist()]


@torch.inference_mode()
def _errors(
    task: ShapeTask, chosen: Shown, points: int, resolution: int, generator: torch.Generator
) -> dict[str, list[ShapeErrors]]:
    """Return the errors of all objects, by method."""
    noise = (_SIZE_NOISE * torch.randn(len(chosen), 3, generator=generator)).exp()
    told = [
        (replace(picture, size=picture.size * factor), shape)
        for (picture, shape), factor in zip(chosen, noise, strict=True)
    ]
    meshes = extract_meshes(task.model, task.codes(told), resolution=resolution)
    library = set(task.seen)
    in_library = any(shape.id in library for _, shape in chosen)
    methods = [name for name in METHODS if in_library or "without" not in name]
    found: dict[str, list[ShapeErrors]] = {name: [] for name in methods}
    for (picture, shape), mesh in zip(told, meshes, strict=True):
        truth, category, size = canonical(shape), shape.category, picture.size
        predicted = {"network": mesh, "retrieval": nearest_model(task, category, size)}
        if in_library:
            other = nearest_model(task, category, size, but=shape.id)
            predicted["retrieval without the model"] = other
        for method, own in (predicted | {"box": box_mesh()}).items():
            errors = missed_shape(truth)
            if own is not None:
                errors = shape_errors(own, truth, generator=generator, points=points)
            found[method].append(errors)
    return found


def _by_category(
    found: dict[str, list[ShapeErrors]], categories: list[str]
) -> dict[str, dict[str, Means]]:
    return {
        category: {
            method: _mean(
                one for one, name in zip(errors, categories, strict=True) if name == category
            )
            for method, errors in found.items()
        }
        for category in sorted(set(categories))
    }


def _mean(errors: Iterable[ShapeErrors]) -> Means:
    """Return means, None where nothing has a value.

    Shapes that were missed (``missed``) are left out of the Chamfer distance; ``volumes`` is the
    number of true surfaces that enclose a volume, over which the overlap of volumes is.
    """
    chosen = list(errors)
    result: Means = {}
    for name in MEASURES:
        values = [getattr(one, name) for one in chosen]
        kept = [value for value in values if value is not None and np.isfinite(value)]
        result[name] = float(np.mean(kept)) if kept else None
    return result | {
        "objects": len(chosen),
        "missed": sum(not np.isfinite(one.chamfer) for one in chosen),
        "volumes": sum(one.volume_iou is not None for one in chosen),
    }
