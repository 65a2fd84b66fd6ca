"""Relations as nested dictionaries of names, leaving out zeros, and back to tensors."""

from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from ._errors import Problem, SceneFormatError
from ._numbers import numbers_from_tensor
from ._records import Relations
from ._schema import YAW_BINS_DEG, RelationsModel, Targets
from ._triples import wall_names

_BIN_INDEX = {name: k for k, name in enumerate(YAW_BINS_DEG)}


def relations_to_json(
    relations: Relations, names: tuple[str, ...], walls: int, file: str
) -> dict[str, Any]:
    """Return the relations of named objects and walls as a part of scene.json.

    Raises:
        SceneFormatError: A tensor does not fit the number of objects and walls.
    """
    n = len(names)
    problems: list[Problem] = []
    for name, shape in {
        "touching": (n, n),
        "touching_wall": (n, walls),
        "on_floor": (n,),
        "under_ceiling": (n,),
        "inside_room": (n,),
        "farther_than": (n, n),
        "relative_yaw": (n, n, 8),
        "relative_yaw_wall": (n, walls, 8),
    }.items():
        found = tuple(getattr(relations, name).shape)
        if found != shape:
            expected = f"{shape}: {n} objects, {walls} walls"
            problems.append(Problem(f"relations.{name}", f"shape {found}", expected))
    if problems:
        raise SceneFormatError(file, problems)
    targets = names + wall_names(walls)
    touching = torch.cat((relations.touching, relations.touching_wall), dim=1)
    turns = torch.cat((relations.relative_yaw, relations.relative_yaw_wall), dim=1)
    return {
        "touching": _nested(touching, names, targets),
        "on_floor": _flat(relations.on_floor, names),
        "under_ceiling": _flat(relations.under_ceiling, names),
        "inside_room": _flat(relations.inside_room, names),
        "farther_than": _nested(relations.farther_than, names, names),
        "relative_yaw_deg": _nested_turns(turns, names, targets),
    }


def relations_from_model(
    model: RelationsModel, names: list[str], walls: int, dtype: torch.dtype
) -> Relations:
    """Return the relations that a checked part of scene.json describes."""
    n = len(names)
    objects = {name: k for k, name in enumerate(names)}
    # walls come after the objects, in one row of targets
    targets = objects | {name: n + k for k, name in enumerate(wall_names(walls))}
    touching = _pairwise(model.touching, objects, targets, dtype)
    places: list[int] = []
    values: list[float] = []
    for subject, row in model.relative_yaw_deg.items():
        start = objects[subject] * len(targets)
        for name, bins in row.items():
            place = (start + targets[name]) * 8
            places += [place + _BIN_INDEX[angle] for angle in bins]
            values += bins.values()
    turns = _filled(places, values, n * len(targets) * 8, dtype).reshape(n, n + walls, 8)
    return Relations(
        touching=touching[:, :n].clone(),
        touching_wall=touching[:, n:].clone(),
        on_floor=_unary(model.on_floor, objects, dtype),
        under_ceiling=_unary(model.under_ceiling, objects, dtype),
        inside_room=_unary(model.inside_room, objects, dtype),
        farther_than=_pairwise(model.farther_than, objects, objects, dtype),
        relative_yaw=turns[:, :n].clone(),
        relative_yaw_wall=turns[:, n:].clone(),
    )


def _flat(score: Float[Tensor, " a"], names: tuple[str, ...]) -> dict[str, float]:
    values: list[float] = numbers_from_tensor(score)
    return {name: value for name, value in zip(names, values, strict=True) if value != 0}


def _nested(
    score: Float[Tensor, "a b"], subjects: tuple[str, ...], targets: tuple[str, ...]
) -> dict[str, dict[str, float]]:
    result: dict[str, dict[str, float]] = {}
    chosen = score != 0
    values: list[float] = numbers_from_tensor(score[chosen])
    places: list[list[int]] = numbers_from_tensor(chosen.nonzero())
    for (a, b), value in zip(places, values, strict=True):
        result.setdefault(subjects[a], {})[targets[b]] = value
    return result


def _nested_turns(
    score: Float[Tensor, "a b 8"], subjects: tuple[str, ...], targets: tuple[str, ...]
) -> dict[str, dict[str, dict[str, float]]]:
    result: dict[str, dict[str, dict[str, float]]] = {}
    chosen = score != 0
    values: list[float] = numbers_from_tensor(score[chosen])
    places: list[list[int]] = numbers_from_tensor(chosen.nonzero())
    for (a, b, k), value in zip(places, values, strict=True):
        row = result.setdefault(subjects[a], {})
        row.setdefault(targets[b], {})[YAW_BINS_DEG[k]] = value
    return result


def _unary(scores: Targets, objects: dict[str, int], dtype: torch.dtype) -> Float[Tensor, " n"]:
    places = [objects[name] for name in scores]
    return _filled(places, list(scores.values()), len(objects), dtype)


def _pairwise(
    scores: dict[str, Targets],
    subjects: dict[str, int],
    targets: dict[str, int],
    dtype: torch.dtype,
) -> Float[Tensor, "a b"]:
    places: list[int] = []
    values: list[float] = []
    for subject, row in scores.items():
        start = subjects[subject] * len(targets)
        places += [start + targets[name] for name in row]
        values += row.values()
    flat = _filled(places, values, len(subjects) * len(targets), dtype)
    return flat.reshape(len(subjects), len(targets))


def _filled(
    places: list[int], values: list[float], length: int, dtype: torch.dtype
) -> Float[Tensor, " length"]:
    flat = torch.zeros(length, dtype=dtype)
    flat[torch.tensor(places, dtype=torch.int64)] = torch.tensor(values, dtype=dtype)
    return flat
