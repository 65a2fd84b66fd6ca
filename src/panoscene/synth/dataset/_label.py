"""From a rendered panorama to its scene and labels."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int64, UInt8
from torch import Tensor

from panoscene.geometry import OrientedBoxes, bfov_from_boxes
from panoscene.scene import (
    Layout,
    Mesh,
    Objects,
    Panorama,
    Relations,
    Scene,
    Shapes,
    category_index,
    relations_from_boxes,
)
from panoscene.synth.render import Camera, RenderedPanorama, RenderScene

from ._contacts import mesh_gap
from ._format import (
    BoxLabel,
    CameraLabel,
    ContactLabel,
    ObjectLabel,
    PanoramaLabels,
    StructureLabel,
)
from ._pixels import Regions, find_regions
from ._semantic import UNLABELLED, semantic_value
from ._things import Box, home_from_world, moved, things_of
from ._views import View, canonical_mesh, upright_from_photo, view_of, visible_bfovs

_DIGITS = 7


@dataclass(frozen=True, slots=True)
class VisibilityRules:
    """Which visible objects scene.json has; the others are in labels.json only.

    The paper's release keeps visible contours of at least 20 pixels and 10 x 10 pixels around
    them, whose convex hull covers at least 0.2 of that of the projected box. Here the hulls are
    measured in an equal-area map, which unlike a perspective camera has no limit at 90 degrees.
    """

    pixels: int = 20
    columns: int = 10
    rows: int = 10
    hull_share: float = 0.2


@dataclass(frozen=True, slots=True)
class LabelledPanorama:
    """A panorama with everything that is known about it, ready to be written."""

    scene: Scene
    """Layout, objects and relations; the panorama's file is not set."""
    labels: PanoramaLabels
    semantic: UInt8[np.ndarray, "height width"]
    rendered: RenderedPanorama
    meshes: tuple[Mesh, ...]
    """Shapes of the scene's objects, canonical, for exports that want them."""

    def with_meshes(self) -> Scene:
        """Return the scene with the exact mesh of every object."""
        objects = self.scene.objects
        return Scene(
            self.scene.panorama,
            self.scene.layout,
            Objects(
                objects.boxes, objects.category, objects.score, objects.bfov,
                objects.distance_score, objects.yaw_score, objects.id, Shapes(mesh=self.meshes),
            ),
            self.scene.relations,
            self.scene.name,
            self.scene.seed,
        )  # fmt: skip


def label_panorama(
    scene: RenderScene,
    rendered: RenderedPanorama,
    *,
    name: str = "panorama",
    home: str = "",
    seed: int = 0,
    room_kind: str = "",
    light: Mapping[str, str | float | int] | None = None,
    rules: VisibilityRules | None = None,
) -> LabelledPanorama:
    """Return the scene and the labels of a rendered panorama.

    Convention:
        - the world frame has its origin on the floor under the camera and +y under the picture's
          centre column; pitch and roll of the camera are ``panorama.upright_from_photo``
        - boxes are tight around the meshes as they are drawn, with the yaw of the object's front
        - relations come from the boxes, as ``relations_from_boxes`` defines them; the gaps
          between the meshes of objects that touch are in ``labels.contacts``
        - BFoVs belong to the upright panorama, pixel boxes to the photo

    Args:
        scene: The home as it was drawn.
        rendered: What came out.
        name: Of the panorama; letters, digits, - and _.
        home: Name of the home.
        seed: Of the home.
        room_kind: Of the camera's room, such as ``kitchen``.
        light: How it was lit, to be kept with the labels.
        rules: Which objects the scene gets.

    Raises:
        ValueError: an instance id is above 65535 or belongs to nothing in the scene, or the
            camera's room does not exist.
    """
    camera = rendered.camera
    if not 0 <= camera.room < len(scene.polygons):
        raise ValueError(f"camera.room: found {camera.room} of {len(scene.polygons)} rooms")
    regions = find_regions(rendered.instance)
    things = things_of(scene, set(regions.instance.tolist()))
    layout = _layout(scene, camera)
    views = [view_of(thing, camera, regions) for thing in things]
    boxes = boxes_record([view.box for view in views])
    height = float(camera.position[2])
    relations = relations_from_boxes(boxes, layout, height)
    objects = _object_labels(views, relations, bfov_from_boxes(boxes, height), rules)
    order = [k for k, label in enumerate(objects) if label.in_scene]
    seen = torch.tensor([objects[k].bfov_visible for k in order], dtype=torch.float32).reshape(
        -1, 4
    )
    structure = _structure(scene, regions, {thing.instance for thing in things})
    labels = PanoramaLabels(
        schema="panoscene/synth-labels",
        name=name,
        home=home,
        home_seed=seed,
        camera=_camera_label(camera, room_kind),
        light=dict(light or {}),
        objects=tuple(objects),
        structure=structure,
        contacts=_contacts(views, objects, order, relations),
    )
    record = Scene(
        panorama=Panorama(
            camera.width,
            camera.height,
            height,
            None,
            _rows(upright_from_photo(camera)),
        ),
        layout=layout,
        objects=_objects(views, objects, order, boxes, seen),
        relations=_chosen(relations, order),
        name=name,
        seed=seed,
    )
    return LabelledPanorama(
        record,
        labels,
        _semantic(labels, regions),
        rendered,
        tuple(canonical_mesh(views[k]) for k in order),
    )


def boxes_record(boxes: Sequence[Box]) -> OrientedBoxes:
    """Return boxes as one record of float32 tensors."""
    return OrientedBoxes(
        torch.tensor([box.centre for box in boxes], dtype=torch.float32).reshape(-1, 3),
        torch.tensor([box.size for box in boxes], dtype=torch.float32).reshape(-1, 3),
        torch.tensor([box.yaw for box in boxes], dtype=torch.float32),
    )


def label_hash(
    scene_json: str, distance_mm: np.ndarray, instance: np.ndarray, semantic: np.ndarray
) -> str:
    """Return SHA-256 over the labels as numbers: the same whatever wrote the picture files."""
    digest = hashlib.sha256(scene_json.encode())
    for array, kind in ((distance_mm, "<u2"), (instance, "<u2"), (semantic, "u1")):
        digest.update(repr(array.shape).encode())
        digest.update(np.ascontiguousarray(array.astype(kind)).tobytes())
    return digest.hexdigest()


def _object_labels(
    views: Sequence[View],
    relations: Relations,
    amodal: Float[Tensor, "n 4"],
    rules: VisibilityRules | None,
) -> list[ObjectLabel]:
    rules = rules or VisibilityRules()
    visible = visible_bfovs(views)
    labels = []
    for k, view in enumerate(views):
        thing = view.thing
        failed = [
            f"{name} {found:.3g}, expected at least {least}"
            for name, found, least in (
                ("pixels", view.pixels, rules.pixels),
                ("columns", view.box_2d[2], rules.columns),
                ("rows", view.box_2d[3], rules.rows),
                ("hull_share", view.hull_share, rules.hull_share),
            )
            if found < least
        ]
        labels.append(
            ObjectLabel(
                id=f"{thing.category}-{thing.instance}",
                instance=thing.instance,
                category=thing.category,
                model=thing.model,
                base=thing.base,
                licence=thing.licence,
                creator=thing.creator,
                source=thing.source,
                room=thing.room,
                world_from_object=_rows(view.world_from_object),
                box=BoxLabel(
                    centre=_rounded(view.box.centre),
                    size=_rounded(view.box.size),
                    yaw=round(view.box.yaw, _DIGITS),
                ),
                bfov_visible=_rounded(visible[k].tolist()),
                bfov_amodal=_rounded(amodal[k].tolist()),
                pixels=view.pixels,
                box_2d=view.box_2d,
                solid_angle=round(view.solid_angle, _DIGITS),
                amodal_solid_angle=round(view.amodal_solid_angle, _DIGITS),
                occlusion=round(1 - min(view.solid_angle / view.amodal_solid_angle, 1.0), 4),
                hull_share=round(view.hull_share, 4),
                truncated=view.truncated,  # ty: ignore[invalid-argument-type]
                inside_room=bool(relations.inside_room[k] > 0.5),
                in_scene=not failed,
                left_out=tuple(failed),
            )
        )
    return labels


def _contacts(
    views: Sequence[View], labels: Sequence[ObjectLabel], order: list[int], relations: Relations
) -> tuple[ContactLabel, ...]:
    """Return the gaps between meshes of objects in the scene whose boxes touch."""
    touching = relations.touching.numpy() > 0.5
    contacts = []
    for place, a in enumerate(order):
        for b in order[place + 1 :]:
            if touching[a, b]:
                one, two = ((views[k].vertices, views[k].thing.faces) for k in (a, b))
                gap = mesh_gap(one, two)
                if np.isfinite(gap):
                    contacts.append(
                        ContactLabel(first=labels[a].id, second=labels[b].id, gap=round(gap, 4))
                    )
    return tuple(contacts)


def _structure(
    scene: RenderScene, regions: Regions, labelled: set[int]
) -> tuple[StructureLabel, ...]:
    """Return what else is seen, by rising instance id."""
    parts = {part.instance: part for part in reversed(scene.parts)}
    models = {placed.instance: placed for placed in scene.placed}
    labels = []
    for instance, pixels in zip(regions.instance.tolist(), regions.pixels.tolist(), strict=True):
        if instance in labelled:
            continue
        if instance in models:
            placed = models[instance]
            model = placed.model
            labels.append(
                StructureLabel(
                    instance=instance, kind="decoration", room=placed.room, index=0, pixels=pixels,
                    model=model.id, licence=model.licence, creator=model.creator,
                    source=model.source,
                )
            )  # fmt: skip
        elif instance in parts:
            part = parts[instance]
            labels.append(
                StructureLabel(
                    instance=instance, kind=part.kind, room=part.room, index=part.index,
                    pixels=pixels,
                )
            )  # fmt: skip
        else:
            raise ValueError(f"instance: found id {instance}, which nothing in the scene has")
    return tuple(labels)


def _semantic(labels: PanoramaLabels, regions: Regions) -> UInt8[np.ndarray, "height width"]:
    values = {label.instance: semantic_value(label.category) for label in labels.objects}
    values |= {label.instance: semantic_value(label.kind) for label in labels.structure}
    table = [values[instance] for instance in regions.instance.tolist()]
    return np.array([*table, UNLABELLED], np.uint8)[regions.place]


def _objects(
    views: Sequence[View],
    labels: Sequence[ObjectLabel],
    order: list[int],
    boxes: OrientedBoxes,
    bfov: Float[Tensor, "n 4"],
) -> Objects:
    category: Int64[Tensor, " n"] = torch.tensor(
        [category_index(views[k].thing.category) for k in order], dtype=torch.int64
    )
    return Objects(
        boxes[torch.tensor(order, dtype=torch.int64)],
        category,
        torch.ones(len(order)),
        bfov,
        torch.ones(len(order)),
        torch.ones(len(order)),
        tuple(labels[k].id for k in order),
    )


def _chosen(relations: Relations, order: list[int]) -> Relations:
    pick = torch.tensor(order, dtype=torch.int64)
    return Relations(
        relations.touching[pick][:, pick],
        relations.touching_wall[pick],
        relations.on_floor[pick],
        relations.under_ceiling[pick],
        relations.inside_room[pick],
        relations.farther_than[pick][:, pick],
        relations.relative_yaw[pick][:, pick],
        relations.relative_yaw_wall[pick],
    )


def _layout(scene: RenderScene, camera: Camera) -> Layout:
    plan = np.asarray(scene.polygons[camera.room], dtype=np.float64)
    flat = np.concatenate([plan, np.zeros((len(plan), 1))], axis=1)
    corners = moved(np.linalg.inv(home_from_world(camera)), flat)[:, :2]
    return Layout(
        torch.from_numpy(corners.astype(np.float32)),
        ceiling_height=float(scene.heights[camera.room]),
    )


def _camera_label(camera: Camera, room_kind: str) -> CameraLabel:
    return CameraLabel(
        position=_rounded(camera.position), yaw=round(camera.yaw, _DIGITS),
        pitch=round(camera.pitch, _DIGITS), roll=round(camera.roll, _DIGITS), room=camera.room,
        room_kind=room_kind,
    )  # fmt: skip


def _rows(matrix: np.ndarray) -> tuple[tuple[Any, ...], ...]:
    return tuple(_rounded(row) for row in (matrix + 0.0).tolist())


def _rounded(values: Sequence[float]) -> tuple:
    return tuple(round(float(value), _DIGITS) + 0.0 for value in values)
