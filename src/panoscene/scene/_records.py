"""Frozen records that the stages exchange. One scene has exactly n objects and m walls."""

from dataclasses import dataclass, field
from typing import Literal

from jaxtyping import Bool, Float, Int64
from torch import Tensor

from panoscene.geometry import OrientedBoxes


@dataclass(frozen=True, slots=True)
class Panorama:
    """What is known about the photo; pixels stay in the file.

    The world frame has its origin on the floor under the camera, +z up, and +y towards the
    panorama's centre column; the camera is at (0, 0, camera_height).
    """

    width: int
    """Columns of the equirectangular image."""
    height: int
    """Rows; width / 2 for a full sphere."""
    camera_height: float = 1.6
    """Metres from the floor to the optical centre; the only source of metric scale."""
    file: str | None = None
    """Path of the image, relative to the scene file."""
    upright_from_photo: tuple[tuple[float, float, float], ...] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
    )
    """Rotation that was applied to the photo's viewing directions to make it upright."""


@dataclass(frozen=True, slots=True)
class Detections:
    """Objects seen in the panorama: where, what, how sure."""

    bfov: Float[Tensor, "n 4"]
    """Centre lon, centre lat, angular width, angular height in radians."""
    category: Int64[Tensor, " n"]
    """Index into ``CATEGORIES``."""
    score: Float[Tensor, " n"]
    """Detector score in [0, 1]."""
    mask: Bool[Tensor, "n height width"] | None = None
    """Visible pixels of each object, when the source gives them."""


@dataclass(frozen=True, slots=True)
class Layout:
    """The room: a simple floor polygon and two heights."""

    floor_polygon: Float[Tensor, "corners 2"]
    """World x, y of the corners in metres, counter-clockwise from above; wall i runs from
    corner i to corner i + 1."""
    floor_height: float = 0.0
    """World z of the floor in metres; 0 by the definition of the world frame."""
    ceiling_height: float = 2.6
    """World z of the ceiling in metres."""
    wall_score: Float[Tensor, " corners"] | None = None
    """Confidence of each wall in [0, 1], when the source gives it."""
    raw_polygon: Float[Tensor, "raw_corners 2"] | None = None
    """The floor polygon as it was read from the photo, before it was made regular."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """A triangle mesh in canonical object space: the box scaled to [-1/2, 1/2]^3."""

    vertices: Float[Tensor, "vertices 3"]
    faces: Int64[Tensor, "faces 3"]


ShapeSource = Literal["network", "slab", "box", "model"]


@dataclass(frozen=True, slots=True)
class Shapes:
    """Shapes of the n objects, as latent codes, as meshes, or both."""

    code: Float[Tensor, "n code"] | None = None
    """LDIF shape codes (1344 numbers in the paper's edition)."""
    mesh: tuple[Mesh | None, ...] = ()
    """One mesh for each object, or none for objects without one; () when there are no meshes."""
    source: tuple[ShapeSource, ...] = ()
    """Where the shape of each object comes from; () when that is not known. ``network``: predicted
    from the photo; ``slab``: the box itself, as the object is too thin for a predicted shape;
    ``box``: the box itself, for want of anything better; ``model``: a CAD model."""


@dataclass(frozen=True, slots=True)
class Objects:
    """The n objects of a scene."""

    boxes: OrientedBoxes
    """World frame, batch shape (n,)."""
    category: Int64[Tensor, " n"]
    """Index into ``CATEGORIES``."""
    score: Float[Tensor, " n"]
    """Detection score in [0, 1]; 1 for ground truth."""
    bfov: Float[Tensor, "n 4"]
    """What the image shows: centre lon, centre lat, angular width, angular height (radians)."""
    distance_score: Float[Tensor, " n"]
    """Confidence of the distance in [0, 1]."""
    yaw_score: Float[Tensor, " n"]
    """Confidence of the yaw in [0, 1]."""
    id: tuple[str, ...] = ()
    """A unique name for each object."""
    shapes: Shapes = field(default_factory=Shapes)


@dataclass(frozen=True, slots=True)
class Relations:
    """Relation scores (probabilities) among n objects and m walls; 0 and 1 for ground truth.

    Pairwise tensors are indexed [subject, object]; their diagonal carries no meaning and is 0.
    ``relative_yaw`` holds 8 bins whose centres are -180, -135, ..., +135 degrees of
    wrap(yaw of the object or wall - yaw of the subject), in the world frame.
    """

    touching: Float[Tensor, "n n"]
    """Boxes in contact; symmetric."""
    touching_wall: Float[Tensor, "n m"]
    on_floor: Float[Tensor, " n"]
    under_ceiling: Float[Tensor, " n"]
    """In contact with the ceiling."""
    inside_room: Float[Tensor, " n"]
    farther_than: Float[Tensor, "n n"]
    """Centre of the subject is farther from the camera than that of the object."""
    relative_yaw: Float[Tensor, "n n 8"]
    relative_yaw_wall: Float[Tensor, "n m 8"]


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything known about one room."""

    panorama: Panorama
    layout: Layout
    objects: Objects
    relations: Relations | None = None
    name: str = ""
    seed: int | None = None
    """Seed of the generator for a synthetic scene."""
