"""What is checked of one panorama. Each check returns what is wrong, nothing when all is well."""

from collections.abc import Mapping

import numpy as np
import torch

from panoscene.scene import Relations, relations_from_boxes
from panoscene.synth.assets import CadModel

from ._format import ObjectLabel
from ._label import boxes_record
from ._loaded import Loaded
from ._pixels import pixel_solid_angle
from ._things import Box, moved, tight_box

_MILLIMETRE = 0.001
_RELATIONS = (
    "touching", "touching_wall", "on_floor", "under_ceiling", "inside_room", "farther_than",
    "relative_yaw", "relative_yaw_wall",
)  # fmt: skip


def check_distance(panorama: Loaded) -> list[str]:
    """Compare distances on walls, floor and ceiling with those to the planes of the layout."""
    layout, labels = panorama.scene.layout, panorama.labels
    corners = layout.floor_polygon.double().numpy()
    after = np.roll(corners, -1, axis=0)
    planes: dict[int, tuple[float, float, float, float]] = {}
    for part in labels.structure:
        if part.room != labels.camera.room:
            continue
        if part.kind == "floor":
            planes[part.instance] = (0.0, 0.0, 1.0, layout.floor_height)
        elif part.kind == "ceiling":
            planes[part.instance] = (0.0, 0.0, 1.0, layout.ceiling_height)
        elif part.kind == "wall" and part.index < len(corners):
            along = after[part.index] - corners[part.index]
            normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            offset = float(normal @ corners[part.index])
            planes[part.instance] = (float(normal[0]), float(normal[1]), 0.0, offset)
    table = np.zeros((65536, 4))
    for instance, plane in planes.items():
        table[instance] = plane
    plane = table[panorama.instance]
    chosen = (plane[..., :3] != 0).any(axis=-1)
    if chosen.mean() < 0.01:
        return ["the camera's room covers less than 1 % of the picture"]
    plane, rays = plane[chosen], panorama.directions[chosen]
    slope = (plane[:, :3] * rays).sum(axis=1)
    expected = (plane[:, 3] - plane[:, :3] @ panorama.eye) / np.where(slope == 0, 1e-9, slope)
    error = np.abs(expected - panorama.distance[chosen])
    within = error <= 2 * _MILLIMETRE + 2e-4 * np.abs(expected)
    if within.mean() < 0.99:
        return [
            f"{1 - within.mean():.1%} of the room's pixels are off its planes, by "
            f"{np.median(error[~within]):.3g} m in the median"
        ]
    return []


def check_holes(panorama: Loaded) -> list[str]:
    """Look for places where one sees out of the home without a window."""
    weight = pixel_solid_angle(*panorama.instance.shape)
    share = float(((panorama.instance == 0) * weight[:, None]).sum() / (4 * np.pi))
    lost = float(((panorama.instance > 0) & (panorama.distance == 0)).mean())
    problems = []
    if share > 0.003:
        problems.append(f"nothing is seen in {share:.2%} of the sphere")
    if lost > 0.001:
        problems.append(f"{lost:.2%} of the pixels have an instance but no distance")
    return problems


def check_relations(panorama: Loaded) -> list[str]:
    """Compare relations with those recomputed from boxes, and boxes with the meshes."""
    scene = panorama.scene
    if scene.relations is None:
        return ["scene.json has no relations"]
    kept = [label for label in panorama.labels.objects if label.in_scene]
    boxes = scene.objects.boxes
    if tuple(label.id for label in kept) != scene.objects.id:
        return ["scene.json and labels.json list different objects"]
    problems = []
    told = boxes_record([Box(label.box.centre, label.box.size, label.box.yaw) for label in kept])
    for name in ("centre", "size"):
        apart = (getattr(told, name) - getattr(boxes, name)).abs()
        if apart.numel() and float(apart.max()) > _MILLIMETRE:
            problems.append(f"boxes of scene.json and labels.json differ by {float(apart.max())} m")
    again = relations_from_boxes(boxes, scene.layout, scene.panorama.camera_height)
    problems += _differing(scene.relations, again, 0.0, "the boxes")
    if panorama.library is not None:
        meshes, missing = _mesh_boxes(kept, panorama.library)
        for label, box in zip(kept, meshes, strict=True):
            off = max(np.abs(np.subtract(box.centre, label.box.centre)).max(),
                      np.abs(np.subtract(box.size, label.box.size)).max())  # fmt: skip
            if off > 2 * _MILLIMETRE and label.category not in ("window", "door"):
                problems.append(f"{label.id}: its box is {off:.3g} m off its mesh")
        problems += [f"{name}: the library has no model of this id" for name in missing]
        again = relations_from_boxes(
            boxes_record(meshes), scene.layout, scene.panorama.camera_height
        )
        problems += _differing(scene.relations, again, 0.01, "the meshes")
    return problems


def check_mirrored(panorama: Loaded) -> list[str]:
    """Look whether objects are on the side of the picture where their boxes are."""
    right = wrong = 0
    found = panorama.object_pixels
    rays = panorama.directions.reshape(-1, 3)[found.flat]
    for k, label in enumerate(panorama.labels.objects):
        centre = np.array(label.box.centre)
        lon = float(np.arctan2(centre[0], centre[1]))
        mine = rays[found.start[k] : found.start[k + 1]]
        told = min(abs(2 * lon), 2 * np.pi - abs(2 * lon)) > 0.4
        if len(mine) and told and label.occlusion < 0.3 and "nadir" not in label.truncated:
            mean = mine.mean(axis=0)
            seen = float(np.arctan2(mean[0], mean[1]))
            apart, mirrored = (abs((seen - s * lon + np.pi) % (2 * np.pi) - np.pi) for s in (1, -1))
            right, wrong = right + (apart < mirrored), wrong + (apart >= mirrored)
    if wrong > 0.1 * (right + wrong):
        return [f"{wrong} of {right + wrong} objects are nearer to the mirrored place of their box"]
    return []


def _mesh_boxes(
    labels: list[ObjectLabel], library: Mapping[str, CadModel]
) -> tuple[list[Box], list[str]]:
    """Return boxes from the meshes; those of the labels for what the building made itself."""
    boxes, missing = [], []
    for label in labels:
        if label.model in library:
            matrix = np.array(label.world_from_object)
            vertices = library[label.model].vertices.astype(np.float64)
            boxes.append(tight_box(moved(matrix, vertices), matrix))
        else:
            if not label.model.startswith("shell/"):
                missing.append(label.model)
            boxes.append(Box(label.box.centre, label.box.size, label.box.yaw))
    return boxes, missing


def _differing(told: Relations, again: Relations, share: float, source: str) -> list[str]:
    problems = []
    for name in _RELATIONS:
        one, two = getattr(told, name), getattr(again, name)
        if one.shape != two.shape:
            problems.append(f"{name} has shape {tuple(one.shape)}, not {tuple(two.shape)}")
            continue
        differ = torch.count_nonzero(one != two)
        if int(differ) > max(share * one.numel(), 4 if share else 0):
            problems.append(f"{name}: {int(differ)} entries differ from those of {source}")
    return problems
