"""Scenes as one padded batch: what the energy is a function of, and what it is not."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence

from panoscene.arrange._checks import check_scene
from panoscene.geometry import OrientedBoxes, wall_boxes
from panoscene.scene import Scene, built_in, nested, relations_from_boxes


@dataclass(frozen=True, slots=True)
class ArrangementBatch:
    """A batch of scenes, padded to n objects and m walls; padding exists only in this record.

    Padded objects are unit boxes far below the room and have ``valid`` False; the polygon is
    padded by repeating its last corner; padded walls have ``wall_valid`` False.
    """

    boxes: OrientedBoxes
    """Start boxes, world frame, batch shape (scenes, n)."""
    valid: Bool[Tensor, "scenes n"]
    bfov: Float[Tensor, "scenes n 4"]
    """What the image shows: lon, lat, width, height in radians."""
    score: Float[Tensor, "scenes n"]
    distance_score: Float[Tensor, "scenes n"]
    yaw_score: Float[Tensor, "scenes n"]
    built_in: Bool[Tensor, "scenes n"]
    """Doors and windows."""
    nested: Bool[Tensor, "scenes n n"]
    """Pairs of which one may well lie in the box of the other: cushions on sofas."""
    touching: Float[Tensor, "scenes n n"]
    touching_wall: Float[Tensor, "scenes n m"]
    on_floor: Float[Tensor, "scenes n"]
    under_ceiling: Float[Tensor, "scenes n"]
    inside_room: Float[Tensor, "scenes n"]
    farther_than: Float[Tensor, "scenes n n"]
    relative_yaw: Float[Tensor, "scenes n n 8"]
    relative_yaw_wall: Float[Tensor, "scenes n m 8"]
    polygon: Float[Tensor, "scenes m 2"]
    walls: OrientedBoxes
    """Wall cuboids, batch shape (scenes, m)."""
    wall_valid: Bool[Tensor, "scenes m"]
    floor_height: Float[Tensor, " scenes"]
    ceiling_height: Float[Tensor, " scenes"]
    camera_height: Float[Tensor, " scenes"]

    @property
    def pair_valid(self) -> Bool[Tensor, "scenes n n"]:
        """Whether both are real objects and not the same one."""
        count = self.valid.shape[1]
        different = ~torch.eye(count, dtype=torch.bool, device=self.valid.device)
        return self.valid[:, :, None] & self.valid[:, None, :] & different

    @property
    def wall_pair_valid(self) -> Bool[Tensor, "scenes n m"]:
        """Whether both the object and the wall are real."""
        return self.valid[:, :, None] & self.wall_valid[:, None, :]


def collate_scenes(scenes: Sequence[Scene]) -> ArrangementBatch:
    """Return the scenes as one padded batch.

    Relations that a scene does not carry are derived from its boxes and layout; an object then
    belongs in the room if any of its lower corners is inside, since the boxes may be off.

    Raises:
        ValueError: no scenes, or one with something that cannot be arranged: a number that is not
            finite, a size that is not positive, a score outside [0, 1], relations of the wrong
            shape, an invalid floor polygon; the message names scene and field.
    """
    if not scenes:
        raise ValueError("scenes: found none, expected at least one")
    for number, scene in enumerate(scenes):
        check_scene(scene, number)
    relations = [
        scene.relations
        if scene.relations is not None
        else relations_from_boxes(
            scene.objects.boxes, scene.layout, scene.panorama.camera_height, inside="any_corner"
        )
        for scene in scenes
    ]
    count = max(len(scene.objects.boxes) for scene in scenes)
    corners = max(scene.layout.floor_polygon.shape[0] for scene in scenes)
    dtype = functools.reduce(
        torch.promote_types, [scene.objects.boxes.centre.dtype for scene in scenes]
    )
    device = scenes[0].objects.boxes.centre.device

    def objects(parts: Sequence[Tensor], fill: float = 0.0) -> Tensor:
        """Pad the first axis to n."""
        stacked = pad_sequence([p.to(dtype) for p in parts], batch_first=True, padding_value=fill)
        return stacked.to(device)

    def pairs(parts: Sequence[Tensor], second: int) -> Tensor:
        """Pad the first two axes to n and n or m."""
        out = torch.zeros(
            (len(parts), count, second, *parts[0].shape[2:]), dtype=dtype, device=device
        )
        for row, part in zip(out, parts, strict=True):
            row[: part.shape[0], : part.shape[1]] = part
        return out

    polygons = [scene.layout.floor_polygon for scene in scenes]
    walls = [
        wall_boxes(p, s.layout.floor_height, s.layout.ceiling_height)
        for p, s in zip(polygons, scenes, strict=True)
    ]
    polygon = torch.stack(
        [torch.cat([p, p[-1:].expand(corners - len(p), 2)]).to(dtype) for p in polygons]
    )
    records = [scene.objects for scene in scenes]

    def heights(values: Sequence[float]) -> Tensor:
        return torch.tensor(values, dtype=dtype, device=device)

    return ArrangementBatch(
        boxes=OrientedBoxes(
            centre=objects([o.boxes.centre for o in records], fill=-1e3),
            size=objects([o.boxes.size for o in records], fill=1.0),
            yaw=objects([o.boxes.yaw for o in records]),
        ),
        valid=objects([torch.ones_like(o.score) for o in records]) > 0,
        bfov=objects([o.bfov for o in records], fill=1.0),
        score=objects([o.score for o in records]),
        distance_score=objects([o.distance_score for o in records]),
        yaw_score=objects([o.yaw_score for o in records]),
        built_in=objects([built_in(o.category) for o in records]) > 0,
        nested=pairs([nested(o.category) for o in records], count) > 0,
        touching=pairs([r.touching for r in relations], count),
        touching_wall=pairs([r.touching_wall for r in relations], corners),
        on_floor=objects([r.on_floor for r in relations]),
        under_ceiling=objects([r.under_ceiling for r in relations]),
        inside_room=objects([r.inside_room for r in relations]),
        farther_than=pairs([r.farther_than for r in relations], count),
        relative_yaw=pairs([r.relative_yaw for r in relations], count),
        relative_yaw_wall=pairs([r.relative_yaw_wall for r in relations], corners),
        polygon=polygon.to(device),
        walls=OrientedBoxes(
            centre=objects([w.centre for w in walls], fill=-2e3),
            size=objects([w.size for w in walls], fill=1.0),
            yaw=objects([w.yaw for w in walls]),
        ),
        wall_valid=objects([torch.ones_like(w.yaw) for w in walls]) > 0,
        floor_height=heights([s.layout.floor_height for s in scenes]),
        ceiling_height=heights([s.layout.ceiling_height for s in scenes]),
        camera_height=heights([s.panorama.camera_height for s in scenes]),
    )
