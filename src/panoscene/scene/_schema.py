"""The data model of scene.json: what a file may say, field by field.

These models know JSON only. ``_convert.py`` turns them into records and back; the published JSON
Schema is generated from them.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, WithJsonSchema

from ._categories import CATEGORIES, category_index

SCHEMA_NAME = "panoscene/scene"
SCHEMA_VERSION = 1
UNITS = "metres, radians"
FRAME = "right-handed, +z up, origin on the floor under the camera, +y to the centre column"
YAW_BINS_DEG = ("-180", "-135", "-90", "-45", "0", "45", "90", "135")


def _known_category(name: str) -> str:
    category_index(name)
    return name


# The bounds keep every number representable in float32 and catch degrees written for radians.
Metres = Annotated[float, Field(ge=-1e6, le=1e6)]
Length = Annotated[float, Field(ge=1e-6, le=1e6)]
Angle = Annotated[float, Field(ge=-6.2832, le=6.2832)]
Score = Annotated[float, Field(ge=0.0, le=1.0)]
Category = Annotated[
    str,
    AfterValidator(_known_category),
    WithJsonSchema({"type": "string", "enum": list(CATEGORIES)}),
]
Id = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]+$")]
# JSON has lists only; strict mode would insist on tuples when a document is given as Python data
Point2 = Annotated[tuple[Metres, Metres], Field(strict=False)]
Point3 = Annotated[tuple[Metres, Metres, Metres], Field(strict=False)]
Size = Annotated[tuple[Length, Length, Length], Field(strict=False)]
Triangle = Annotated[
    tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]],
    Field(strict=False),
]
YawBin = Literal["-180", "-135", "-90", "-45", "0", "45", "90", "135"]
Targets = dict[Id, Score]
YawTargets = dict[Id, dict[YawBin, Score]]
Direction = Annotated[
    tuple[
        Annotated[float, Field(ge=-1.001, le=1.001)],
        Annotated[float, Field(ge=-1.001, le=1.001)],
        Annotated[float, Field(ge=-1.001, le=1.001)],
    ],
    Field(strict=False),
]


class Model(BaseModel):
    """Settings of every part of the format: closed, exact types, finite numbers."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
        validate_default=False,
    )


class PanoramaModel(Model):
    """The photo that the scene was seen in."""

    width: Annotated[int, Field(ge=2, le=1_000_000)]
    """Columns of the equirectangular image."""
    height: Annotated[int, Field(ge=1, le=500_000)]
    """Rows: half the width."""
    camera_height: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.6
    """Metres from the floor to the camera; the only source of metric scale."""
    file: str | None = None
    """Path of the image, relative to this file."""
    upright_from_photo: Annotated[tuple[Direction, Direction, Direction], Field(strict=False)] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, 1.0),
    )
    """Rotation (rows) that made the photo's viewing directions upright."""


class LayoutModel(Model):
    """The room."""

    floor_polygon: Annotated[list[Point2], Field(min_length=3, max_length=10_000)]
    """Corners (x, y), counter-clockwise from above; wall i runs from corner i to corner i + 1."""
    floor_height: Metres = 0.0
    """World z of the floor."""
    ceiling_height: Metres = 2.6
    """World z of the ceiling."""
    wall_score: list[Score] | None = None
    """Confidence of each wall."""
    raw_polygon: Annotated[list[Point2], Field(min_length=3, max_length=10_000)] | None = None
    """The corners as they were read from the photo, before the polygon was made regular."""


class BoxModel(Model):
    """An upright box."""

    centre: Point3
    """World x, y, z of the middle of the box."""
    size: Size
    """Full extents: width (its left to right), depth (its front to back), height."""
    yaw: Angle = 0.0
    """Counter-clockwise from above; 0 faces +y."""


class BFoVModel(Model):
    """The part of the panorama that shows the object."""

    lon: Annotated[float, Field(ge=-3.1416, le=3.1416)]
    """Longitude of the centre, positive to the right."""
    lat: Annotated[float, Field(ge=-1.5708, le=1.5708)]
    """Latitude of the centre, positive up."""
    width: Annotated[float, Field(ge=0.0, le=6.2832)]
    """Angular width."""
    height: Annotated[float, Field(ge=0.0, le=3.1416)]
    """Angular height."""


class MeshModel(Model):
    """A triangle mesh in canonical object space: the box scaled to [-1/2, 1/2]^3."""

    vertices: list[Point3]
    """x, y, z of each vertex."""
    faces: list[Triangle]
    """Indices of the three vertices of each triangle."""


class ShapeModel(Model):
    """The shape of one object."""

    code: Annotated[list[Metres], Field(min_length=1)] | None = None
    """Latent shape code; every object of the scene has one of the same length, or none has."""
    mesh: MeshModel | None = None
    """Triangle mesh."""
    source: Literal["network", "slab", "box", "model"] | None = None
    """Where the shape comes from: predicted; the box, as the object is thin; the box, for want of
    anything better; or a CAD model."""


class ObjectModel(Model):
    """One object."""

    id: Id | None = None
    """Unique name; when missing, the category and the place in the list, such as ``bed-0``."""
    category: Category
    """One of the 57 categories."""
    box: BoxModel
    score: Score = 1.0
    """Detection score; 1 for ground truth."""
    distance_score: Score = 1.0
    """Confidence of the distance."""
    yaw_score: Score = 1.0
    """Confidence of the yaw."""
    bfov: BFoVModel | None = None
    """When missing, the projection of the box."""
    shape: ShapeModel | None = None


class RelationsModel(Model):
    """Probabilities by the names of subject and object; what is not mentioned is 0.

    Walls are called ``wall-0``, ``wall-1``, ... in the order of the floor polygon.
    """

    touching: dict[Id, Targets] = Field(default_factory=dict)
    """Boxes in contact: subject object -> object or wall -> probability."""
    on_floor: Targets = Field(default_factory=dict)
    """In contact with the floor."""
    under_ceiling: Targets = Field(default_factory=dict)
    """In contact with the ceiling."""
    inside_room: Targets = Field(default_factory=dict)
    farther_than: dict[Id, Targets] = Field(default_factory=dict)
    """Subject object -> object that is nearer to the camera -> probability."""
    relative_yaw_deg: dict[Id, YawTargets] = Field(default_factory=dict)
    """Subject object -> object or wall -> degrees of yaw(object) - yaw(subject) -> probability."""


class SceneModel(Model):
    """A room seen in one panorama: layout, objects and their relations."""

    schema_name: Literal["panoscene/scene"] = Field(alias="schema")
    """Always ``panoscene/scene``."""
    version: Literal[1]
    """Version of this format."""
    units: Literal["metres, radians"] = UNITS
    """Units of every number, unless a name ends in ``_deg`` (degrees)."""
    frame: Literal[
        "right-handed, +z up, origin on the floor under the camera, +y to the centre column"
    ] = FRAME
    """The world frame."""
    name: str = ""
    """Name of the scene."""
    seed: Annotated[int, Field(ge=-(2**63), le=2**64 - 1)] | None = None
    """Seed of the generator of a synthetic scene."""
    panorama: PanoramaModel
    layout: LayoutModel
    objects: Annotated[list[ObjectModel], Field(max_length=10_000)]
    relations: RelationsModel | None = None
    """Missing when nobody has derived or predicted them."""


def scene_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of scene.json, as published with the package.

    What a schema cannot say (unique ids, a simple counter-clockwise polygon, relations that name
    existing objects) is checked by ``read_scene`` on top.

    Examples:
        >>> scene_json_schema()["title"]
        'panoscene scene'
    """
    schema = SceneModel.model_json_schema(by_alias=True, mode="validation")
    schema.pop("title")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:panoscene:scene:{SCHEMA_VERSION}",
        "title": "panoscene scene",
        **schema,
    }
