"""Physical plausibility of the boxes of a scene: the paper's counts, and what they overlook."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from operator import attrgetter

import numpy as np
import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.eval._padded_rooms import PaddedRooms, padded_rooms
from panoscene.eval._support import floating_distances
from panoscene.geometry import (
    SMALLEST_SHRUNK_SIZE,
    OrientedBoxes,
    box_footprint,
    box_in_room_fraction,
    box_volume,
    boxes_collide,
    signed_distance_to_polygon,
)
from panoscene.scene import Layout, Scene

COLLISION_TOLERANCE = 0.1
"""Metres of overlap that the paper's counts forgive."""
PARTLY_OUTSIDE = 0.05
"""Share of a box's volume beyond walls, floor and ceiling from which it counts as outside."""

_ROUNDING = 1e-9
"""Share of a box's volume in the room that is nothing."""


@dataclass(frozen=True, slots=True)
class PlausibilityRecord:
    """How physical the boxes of one scene are: plain numbers, to be added up over scenes."""

    objects: int
    pairs: int
    """Unordered pairs of objects: n (n - 1) / 2."""
    paper_colliding_pairs: int
    """The paper's collisions per scene: pairs of objects that overlap by more than 0.1 m."""
    paper_hitting_object: int
    """Objects in at least one such pair."""
    paper_hitting_ceiling: int
    """Objects that reach more than 0.1 m above the ceiling."""
    paper_hitting_floor: int
    """Objects that reach more than 0.1 m below the floor, and all boxes less than 1 cm high that
    lie on it (see ``plausibility_record``)."""
    paper_hitting_wall: int
    """Objects that overlap a wall by more than 0.1 m and have a bottom corner in the room."""
    box_volume: float
    """Cubic metres of all boxes together."""
    out_of_room_volume: float
    """Cubic metres of the boxes beyond walls, floor and ceiling."""
    partly_outside: int
    """Objects with more than 5 % of their volume outside."""
    outside: int
    """Objects with all of their volume outside: what the paper's wall count does not see."""
    floating: int
    """Objects that nothing supports, see ``floating_distances``."""
    floating_distance: float
    """Metres that they would fall, added up."""

    def as_dict(self) -> dict[str, int | float]:
        """Return the fields as plain values, for JSON."""
        return asdict(self)


def plausibility_record(scene: Scene, layout: Layout | None = None) -> PlausibilityRecord:
    """Return how physical the boxes of a scene are in its room.

    The counts that start with ``paper_`` follow the released evaluation. Before boxes are tested
    for overlap each loses 0.05 m on every side, walls (cuboids, 0.2 m thick, behind the polygon)
    too; for floor and ceiling each loses 0.1 m on every side; no extent becomes less than 1 cm.
    Three properties of these counts are kept for the comparison's sake, and are the reason for
    the other numbers:

    - An object counts as hitting a wall only when a bottom corner of its shrunk box is inside the
      floor polygon. An object that is entirely outside hits no wall; ``outside`` counts those, and
      ``out_of_room_volume`` weighs them.
    - Fewer objects have fewer collisions; divide by ``pairs``, and compare methods at the same
      recall (``plausibility_at_recall``).
    - An extent below 1 cm grows to 1 cm. A carpet of 8 mm that lies on the floor therefore
      reaches 1 mm below it and counts as hitting the floor, in ground truth too.

    Args:
        scene: the objects, 0 or more.
        layout: the room to judge by, the scene's own when omitted. The paper judges predictions by
            the estimated layout.

    Raises:
        ValueError: The boxes hold a non-finite number or a size that is not positive, or the
            layout is not a valid room.

    Source: paper, Sec. 4 (physical violation); tolerances of the authors' release.

    Examples:
        >>> from panoscene.scene import objects_from_boxes, scene_from_boxes
        >>> room = Layout(torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]))
        >>> boxes = OrientedBoxes(
        ...     torch.tensor([[0.0, 1.0, 0.5], [0.8, 1.0, 0.5]]), torch.ones(2, 3), torch.zeros(2)
        ... )
        >>> objects = objects_from_boxes(boxes, ["chair", "sofa"], camera_height=1.6)
        >>> record = plausibility_record(scene_from_boxes(objects, room, camera_height=1.6))
        >>> record.paper_colliding_pairs, record.paper_hitting_object, record.paper_hitting_wall
        (1, 2, 0)
    """
    (record,) = plausibility_records([scene], None if layout is None else [layout])
    return record


def plausibility_records(
    scenes: Sequence[Scene], layouts: Sequence[Layout] | None = None
) -> tuple[PlausibilityRecord, ...]:
    """Return ``plausibility_record`` of every scene, many times as fast.

    Raises:
        ValueError: as ``plausibility_record``; the message says which scene.
    """
    return records_of_boxes(
        [scene.objects.boxes for scene in scenes],
        [scene.layout for scene in scenes] if layouts is None else layouts,
    )


def records_of_boxes(
    boxes: Sequence[OrientedBoxes], layouts: Sequence[Layout]
) -> tuple[PlausibilityRecord, ...]:
    """Return the records of ``plausibility_record`` for the boxes of each scene."""
    records: dict[int, PlausibilityRecord] = {}
    for scenes, rooms in padded_rooms(boxes, layouts):
        records |= dict(zip(scenes, _records(rooms), strict=True))
    return tuple(records[scene] for scene in range(len(boxes)))


def paper_counts(rooms: PaddedRooms) -> Int64[Tensor, "scenes 5"]:
    """Return colliding pairs, and the objects that hit an object, the ceiling, the floor, a wall.

    Source: paper, Sec. 4; tolerances of the authors' release. See ``plausibility_record``.
    """
    core = _shrunk(rooms.boxes, COLLISION_TOLERANCE)
    n = rooms.valid.shape[1]
    pair = rooms.valid[:, :, None] & rooms.valid[:, None] & ~torch.eye(n, dtype=torch.bool)
    collide = boxes_collide(core[:, :, None], core[:, None]) & pair
    walls = _shrunk(rooms.walls(), COLLISION_TOLERANCE)
    corner = box_footprint(core).flatten(1, 2)
    outside = signed_distance_to_polygon(corner, rooms.polygon).unflatten(1, (n, 4))
    hit_wall = boxes_collide(core[:, :, None], walls[:, None]) & rooms.wall_valid[:, None]
    hit_wall = hit_wall.any(-1) & (outside <= 0).any(-1)
    # the release takes twice as much off for floor and ceiling
    core = _shrunk(rooms.boxes, 2 * COLLISION_TOLERANCE)
    bottom, top = (core.centre[..., 2] + sign * core.size[..., 2] / 2 for sign in (-1, 1))
    hits = [collide.any(-1), top > rooms.ceiling[:, None], bottom < rooms.floor[:, None], hit_wall]
    counts = [(hit & rooms.valid).sum(-1) for hit in hits]
    return torch.stack([collide.sum((-1, -2)) // 2, *counts], dim=-1)


def _records(rooms: PaddedRooms) -> list[PlausibilityRecord]:
    fraction = box_in_room_fraction(rooms.boxes, rooms.polygon, rooms.floor, rooms.ceiling)
    volume = box_volume(rooms.boxes) * rooms.valid
    falls = floating_distances(rooms)
    n = rooms.valid.sum(-1)
    parts = (
        n,
        n * (n - 1) // 2,
        *paper_counts(rooms).unbind(-1),
        volume.sum(-1),
        (volume * (1 - fraction)).sum(-1),
        ((fraction < 1 - PARTLY_OUTSIDE) & rooms.valid).sum(-1),
        ((fraction < _ROUNDING) & rooms.valid).sum(-1),
        (falls > 0).sum(-1),
        falls.sum(-1),
    )
    columns = [part.tolist() for part in parts]
    return [PlausibilityRecord(*row) for row in zip(*columns, strict=True)]


def score_plausibility(records: Sequence[PlausibilityRecord]) -> dict[str, float | None]:
    """Return the plausibility of a data set: means over scenes, and rates over what they count.

    Every scene counts, those without objects with zeros. Rates are of sums, not means of rates;
    where there is nothing to divide by (no pairs, no objects) they are None.

    - ``paper_colliding_pairs``, ``paper_hitting_object``, ``_ceiling``, ``_floor``, ``_wall``:
      the paper's numbers per scene
    - ``collision_rate``: the paper's colliding pairs per pair of objects
    - ``out_of_room_volume``: cubic metres per scene; ``out_of_room_share``: of the boxes' volume
    - ``partly_outside_share``, ``outside_share``: objects with more than 5 %, with all of their
      volume outside, per object
    - ``floating``: unsupported objects per scene; ``floating_share``: per object;
      ``floating_distance``: metres they would fall, averaged over all objects

    Raises:
        ValueError: there are no records.
    """
    if not records:
        raise ValueError("records: expected those of at least one scene, found none")
    return plausibility_of_sums(plausibility_sums(records).sum(axis=0))


def plausibility_sums(
    records: Sequence[PlausibilityRecord],
) -> Float[np.ndarray, "scenes columns"]:
    """Return for each scene a 1 and the numbers of its record, to be added up."""
    return np.array([(1, *_numbers(record)) for record in records], dtype=np.float64)


def plausibility_of_sums(sums: Float[np.ndarray, " columns"]) -> dict[str, float | None]:
    """Return ``score_plausibility`` for added rows of ``plausibility_sums``."""
    names = [field.name for field in fields(PlausibilityRecord)]
    scenes, *numbers = sums.tolist()
    total = dict(zip(names, numbers, strict=True))
    per_scene = [name for name in names if name.startswith("paper_")]
    per_scene += ["objects", "out_of_room_volume", "floating"]
    return {
        "scenes": scenes,
        **{name: total[name] / scenes for name in per_scene},
        "collision_rate": ratio(total["paper_colliding_pairs"], total["pairs"]),
        "out_of_room_share": ratio(total["out_of_room_volume"], total["box_volume"]),
        "partly_outside_share": ratio(total["partly_outside"], total["objects"]),
        "outside_share": ratio(total["outside"], total["objects"]),
        "floating_share": ratio(total["floating"], total["objects"]),
        "floating_distance": ratio(total["floating_distance"], total["objects"]),
    }


def ratio(part: float, whole: float) -> float | None:
    """Return part / whole, or None when there is nothing to divide by."""
    return part / whole if whole else None


_numbers = attrgetter(*(field.name for field in fields(PlausibilityRecord)))


def _shrunk(boxes: OrientedBoxes, by: float) -> OrientedBoxes:
    """Return boxes with ``by`` metres less in every extent, at least 1 cm: thin ones grow."""
    return OrientedBoxes(boxes.centre, (boxes.size - by).clamp(min=SMALLEST_SHRUNK_SIZE), boxes.yaw)
