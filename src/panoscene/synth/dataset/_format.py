"""The data model of labels.json: what is known beyond scene.json. Metres, radians, pixels.

Frames: "world" is the frame of scene.json; "home" is the plan of the home, the same for all of
its panoramas. Pixel boxes and masks are in the photo as it was taken; BFoVs are upright.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

LABELS_SCHEMA = "panoscene/synth-labels"
LABELS_VERSION = 1
Split = Literal["train", "val", "test-seen", "test-unseen"]
SPLITS: tuple[Split, ...] = ("train", "val", "test-seen", "test-unseen")
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,99}$")]
FileName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$")]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Point = tuple[float, float, float]
Row = tuple[float, float, float, float]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Format(BaseModel):
    """Settings of every part of the files: closed and finite."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )


class CameraLabel(Format):
    """Where the panorama was taken."""

    position: Point
    """In the home's frame; the third number is the height above the floor."""
    yaw: float
    """Counter-clockwise from above; 0 looks along the home's +y."""
    pitch: float
    """Up, of the image's centre."""
    roll: float
    """Clockwise as the photographer sees it."""
    room: int
    """Index of the camera's room in the home."""
    room_kind: str = ""
    """Such as ``kitchen``."""


class BoxLabel(Format):
    """An upright box in the world frame."""

    centre: Point
    size: Point
    yaw: float


class ObjectLabel(Format):
    """One visible object of the 57 categories."""

    id: str
    """Its name in scene.json, the same in all panoramas of its home."""
    instance: Annotated[int, Field(ge=1, le=65535)]
    """Its value in instance.png."""
    category: str
    model: str
    """CAD model id; ``shell/...`` for doors and windows that the building made itself."""
    base: str
    """The model it was made from; the split by shape goes by it."""
    licence: str = ""
    creator: str = ""
    source: str = ""
    room: int
    """Index of the room it belongs to."""
    world_from_object: tuple[Row, Row, Row, Row]
    """Places the model's vertices, with their scale; with the model it gives the exact mesh."""
    box: BoxLabel
    bfov_visible: Row
    """lon, lat, width, height around the visible pixels."""
    bfov_amodal: Row
    """lon, lat, width, height of the whole box, as if nothing hid it."""
    pixels: int
    """Visible ones."""
    box_2d: tuple[int, int, int, int]
    """Left column, top row, columns and rows of the visible pixels; it may run on past the last
    column, which the first one follows."""
    solid_angle: float
    """Of the visible pixels, steradians."""
    amodal_solid_angle: float
    """Of the whole mesh, as if nothing hid it."""
    occlusion: Share
    """Hidden part of the mesh's solid angle."""
    hull_share: float
    """Area of the convex hull of the visible pixels over that of the box."""
    truncated: tuple[Literal["seam", "zenith", "nadir"], ...] = ()
    """Where the picture's edges cut it."""
    inside_room: bool
    """Wholly in the camera's room."""
    in_scene: bool
    """Whether scene.json has it."""
    left_out: tuple[str, ...] = ()
    """Why scene.json does not: the rules it failed."""


class StructureLabel(Format):
    """What else is seen: parts of the building, and decoration."""

    instance: Annotated[int, Field(ge=1, le=65535)]
    kind: str
    """``wall``, ``floor``, ``ceiling``, ``skirting``, ``frame``, ``sill``, ``door``, ``lamp`` or
    ``decoration``."""
    room: int
    index: int
    """Of the wall in its room, or of the opening in the home; 0 for the rest."""
    pixels: int
    model: str = ""
    """Of decoration."""
    licence: str = ""
    creator: str = ""
    source: str = ""


class ContactLabel(Format):
    """Two objects whose boxes touch: how far apart their meshes are."""

    first: str
    second: str
    gap: float
    """Metres between the nearest points found on both meshes: an upper bound, some 2 cm above
    the truth at most for large flat faces."""


class PanoramaLabels(Format):
    """Everything in labels.json."""

    schema_name: Literal["panoscene/synth-labels"] = Field(LABELS_SCHEMA, alias="schema")
    version: Literal[1] = LABELS_VERSION
    name: Name
    home: str = ""
    home_seed: int = 0
    split: Split | None = None
    camera: CameraLabel
    light: dict[str, str | float | int] = Field(default_factory=dict)
    """How it was lit and exposed, as the renderer tells it."""
    objects: tuple[ObjectLabel, ...]
    structure: tuple[StructureLabel, ...]
    contacts: tuple[ContactLabel, ...] = ()
    files: dict[FileName, Sha256] = Field(default_factory=dict)
    """SHA-256 of every other file of the folder."""
    label_hash: str = ""
    """SHA-256 of scene, distance, instances and categories as numbers, whatever packs them."""
