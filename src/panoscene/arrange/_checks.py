"""What a scene must be to have an energy."""

from dataclasses import fields

import torch
from torch import Tensor

from panoscene.geometry import polygon_problem
from panoscene.scene import Layout, Objects, Relations, Scene


def check_scene(scene: Scene, number: int) -> None:
    """Refuse what no energy is defined for.

    Raises:
        ValueError: Naming scene, object, field, what was found and what was expected.
    """
    label = f"scene {number}" + (f" ({scene.name})" if scene.name else "")
    _check_objects(scene.objects, label)
    _check_layout(scene.layout, label)
    height = torch.tensor(scene.panorama.camera_height)
    if not bool(torch.isfinite(height)):
        raise ValueError(
            f"{label}, camera_height: found {float(height)}, expected a finite number of metres"
        )
    if scene.relations is not None:
        count, walls = len(scene.objects.boxes), len(scene.layout.floor_polygon)
        _check_relations(scene.relations, count, walls, label)


def _check_objects(objects: Objects, label: str) -> None:
    boxes = objects.boxes
    numbers = {"centre": boxes.centre, "size": boxes.size, "yaw": boxes.yaw, "bfov": objects.bfov}
    for field, values in numbers.items():
        _refuse(~torch.isfinite(values), values, f"{label}, object", field, "finite numbers")
    _refuse(boxes.size <= 0, boxes.size, f"{label}, object", "size", "all extents above 0")
    for field in ("score", "distance_score", "yaw_score"):
        values = getattr(objects, field)
        _refuse(~((values >= 0) & (values <= 1)), values, f"{label}, object", field, "0 to 1")


def _check_layout(layout: Layout, label: str) -> None:
    problem = polygon_problem(layout.floor_polygon)
    if problem is not None:
        raise ValueError(f"{label}, floor_polygon: found that {problem}, expected a valid outline")
    if not layout.ceiling_height > layout.floor_height:
        raise ValueError(
            f"{label}, ceiling_height: found {layout.ceiling_height}, expected above the floor at "
            f"{layout.floor_height}"
        )


def _check_relations(relations: Relations, count: int, walls: int, label: str) -> None:
    for field in fields(Relations):
        values = getattr(relations, field.name)
        second = {"wall": walls}.get(field.name.rpartition("_")[2], count)
        expected = (count, second, 8)[: values.ndim]
        if tuple(values.shape) != expected:
            raise ValueError(
                f"{label}, relations.{field.name}: found shape {tuple(values.shape)}, expected "
                f"{expected} for {count} objects and {walls} walls"
            )
        # a probability that was summed up may exceed 1 by rounding
        bad = ~((values >= 0) & (values <= 1 + 1e-5))
        _refuse(bad, values, f"{label}, subject", f"relations.{field.name}", "0 to 1")


def _refuse(bad: Tensor, values: Tensor, what: str, field: str, expected: str) -> None:
    """Raise a ValueError that names the first row with anything bad in it."""
    if bool(bad.any()):
        row = int(bad.nonzero()[0, 0])
        found = values[row][bad[row]] if values.ndim > 1 else values[row]
        raise ValueError(
            f"{what} {row}, {field}: found {found.flatten()[:3].tolist()}, expected {expected}"
        )
