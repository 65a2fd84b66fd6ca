"""Training samples of the pose network: the crops of a scene with the codes of their boxes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import torch
from jaxtyping import Bool, Float, Int64
from pydantic import BaseModel, ConfigDict
from torch import Tensor

from panoscene.geometry import (
    BoxCode,
    OrientedBoxes,
    encode_boxes,
    perspective_directions,
    pixel_from_direction,
    sample_panorama,
    wrap_angle,
)
from panoscene.models.pose import pose_clues
from panoscene.scene import CATEGORIES, MEAN_SIZE, Layout, Scene
from panoscene.synth.dataset import PanoramaItem

from ._photometric import augment_photo
from ._pose_matches import match_detections
from ._stage_records import StageRecord

CODE = tuple(field.name for field in fields(BoxCode))
"""Names of the parts of a code."""
_NARROWEST, _WIDEST = 0.01, 3.1


class PoseAugmentation(BaseModel):
    """How a training sample differs from the panorama it is made of."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    centre: float = 0.06
    """Deviation of a BFoV's centre, in its extents; times the scene's severity, 0 to 1.5."""
    extent: float = 0.12
    """Deviation of the logarithm of a BFoV's extents; times the same."""
    tilt_deg: float = 0.7
    """Deviation of what is left of the camera's tilt."""
    wall: float = 0.04
    """Deviation of the room's extents, as a share of them."""
    no_layout: float = 0.25
    """Share of the samples without a layout."""
    detections: float = 0.5
    """Share of the samples with detections, where there are any."""
    photometric: float = 0.5
    """Share of the samples whose colours, sharpness and noise are those of another camera."""
    blind: float = 0.0
    """Share of the samples without crops: they cost a tenth, and teach what geometry says."""
    most_objects: int = 24
    """Of a sample; more are left out at random."""


@dataclass(frozen=True, slots=True)
class PoseScene:
    """A panorama and what is to be learnt from it."""

    item: PanoramaItem
    scene: Scene
    found: StageRecord | None = None
    """What detector and layout network see in the upright panorama."""


@dataclass(frozen=True, slots=True)
class PoseSample:
    """The n objects of one scene; a batch of scenes has padding, ``collate_pose`` makes it."""

    crops: Float[Tensor, "crops 3 rows columns"]
    """Of all objects, or of none."""
    bfov: Float[Tensor, "n 4"]
    category: Int64[Tensor, " n"]
    clues: Float[Tensor, "n clues"]
    code: BoxCode
    matched: Bool[Tensor, " n"]
    """Whether the code is known."""


def read_pose_scenes(
    items: Sequence[PanoramaItem], found: Mapping[str, StageRecord] | None = None
) -> list[PoseScene]:
    """Return the panoramas that show objects, with their truth; pictures are read when needed.

    Args:
        items: Of a data set.
        found: Records of the first stages by name, where there are any.

    Raises:
        SceneFormatError: A scene file is missing or damaged.
    """
    known = found or {}
    scenes = [PoseScene(item, item.scene(), known.get(item.name)) for item in items]
    return [scene for scene in scenes if len(scene.scene.objects.category)]


def mean_sizes(scenes: Sequence[Scene]) -> Float[Tensor, "57 3"]:
    """Return the mean size in metres of each category, ``MEAN_SIZE`` for those never seen."""
    size = torch.cat([MEAN_SIZE.new_zeros(0, 3), *(scene.objects.boxes.size for scene in scenes)])
    category = torch.cat(
        [torch.zeros(0, dtype=torch.int64), *(scene.objects.category for scene in scenes)]
    )
    total = torch.zeros(len(CATEGORIES), 3).index_add_(0, category, size.float())
    count = torch.bincount(category, minlength=len(CATEGORIES)).unsqueeze(-1)
    return torch.where(count > 0, total / count.clamp(min=1), MEAN_SIZE)


def pose_sample(
    source: PoseScene,
    mean_size: Float[Tensor, "57 3"],
    crop_px: int,
    generator: torch.Generator,
    *,
    augmentation: PoseAugmentation | None = None,
) -> PoseSample:
    """Return one scene as a training sample; the same generator gives the same sample.

    The world is turned about the vertical and mirrored at random, the BFoVs (detections, or
    the true ones) are moved as a detector would, the room as a layout network would. Crops are
    read from the photo as it was taken, in one interpolation.

    Args:
        source: The scene.
        mean_size: Metres, what sizes are relative to.
        crop_px: Rows and columns of a crop.
        generator: Of all that is random.
        augmentation: How much is changed.
    """
    change = augmentation or PoseAugmentation()
    turned_from_world = random_turn(generator)
    picked = _picked(source, change, generator)
    seen = turned_bfov(picked.bfov, turned_from_world)
    severity = float(torch.rand((), generator=generator)) * 1.5
    if picked.true:
        seen = jittered_bfov(seen, change, severity, generator)
    objects = source.scene.objects
    boxes = turned_boxes(objects.boxes[picked.target.clamp(min=0)], turned_from_world)
    height = source.scene.panorama.camera_height
    layout = _random_layout(source.scene.layout, turned_from_world, change, generator)
    size = mean_size[picked.category]
    return PoseSample(
        crops=_random_crops(
            source, seen, crop_px, turned_from_world, change=change, generator=generator
        ),
        bfov=seen,
        category=picked.category,
        clues=pose_clues(seen, size, height, layout),
        code=encode_boxes(boxes, seen, size, height),
        matched=picked.target >= 0,
    )


def _random_crops(
    source: PoseScene,
    bfov: Float[Tensor, "n 4"],
    crop_px: int,
    turned_from_world: Float[Tensor, "3 3"],
    *,
    change: PoseAugmentation,
    generator: torch.Generator,
) -> Float[Tensor, "crops 3 rows columns"]:
    """Return crops of a photo that is nearly upright, in other colours; or none."""
    blind, coloured = torch.rand(2, generator=generator).tolist()
    tilt = _random_tilt(change.tilt_deg, generator)
    if blind < change.blind:
        return torch.zeros(0, 3, crop_px, crop_px)
    image = source.item.image()
    if coloured < change.photometric:
        image = augment_photo(image, generator)
    upright_from_photo = image.new_tensor(source.scene.panorama.upright_from_photo)
    photo_from_turned = upright_from_photo.T @ tilt @ turned_from_world.T
    return crops_of_photo(image, bfov, crop_px, photo_from_turned)


def crops_of_photo(
    image: Float[Tensor, "3 height width"],
    bfov: Float[Tensor, "n 4"],
    crop_px: int,
    photo_from_upright: Float[Tensor, "3 3"],
) -> Float[Tensor, "n 3 rows columns"]:
    """Return crops of a photo that is not upright, or that is to be mirrored.

    Args:
        image: Panorama as it was taken.
        bfov: (lon, lat, width, height) in the upright frame.
        crop_px: Rows and columns.
        photo_from_upright: Rotation, or rotation and mirror image, of viewing directions.
    """
    direction = perspective_directions(bfov, (crop_px, crop_px)) @ photo_from_upright.T
    return sample_panorama(image, pixel_from_direction(direction, *image.shape[-2:]))


def collate_pose(samples: Sequence[PoseSample]) -> dict[str, Tensor]:
    """Return scenes as one batch: crops one after the other, all else padded to the longest.

    Keys are the fields of ``PoseSample`` and of its code; ``valid`` is False for padding,
    ``pictured`` too for objects without a crop.
    """
    longest = max(len(sample.category) for sample in samples)
    batch = {"crops": torch.cat([sample.crops for sample in samples])}
    for name in ("bfov", "category", "clues", "matched"):
        batch[name] = padded([getattr(sample, name) for sample in samples], longest)
    for name in CODE:
        batch[name] = padded([getattr(sample.code, name) for sample in samples], longest)
    count = torch.tensor([len(sample.category) for sample in samples])
    batch["valid"] = torch.arange(longest) < count.unsqueeze(-1)
    shown = torch.tensor([len(sample.crops) > 0 for sample in samples])
    batch["pictured"] = batch["valid"] & shown.unsqueeze(-1)
    # a BFoV without extent would be divided by
    batch["bfov"] = torch.where(batch["valid"].unsqueeze(-1), batch["bfov"], 0.1)
    return batch


def code_of(batch: Mapping[str, Tensor]) -> BoxCode:
    """Return the code of a batch."""
    return BoxCode(*(batch[name] for name in CODE))


@dataclass(frozen=True, slots=True)
class _Picked:
    bfov: Float[Tensor, "n 4"]
    category: Int64[Tensor, " n"]
    target: Int64[Tensor, " n"]
    true: bool


def _picked(source: PoseScene, change: PoseAugmentation, generator: torch.Generator) -> _Picked:
    """Return detections or true BFoVs, in a random order, not too many."""
    objects = source.scene.objects
    found = None if source.found is None else source.found.detections
    lucky = float(torch.rand((), generator=generator)) < change.detections
    if found is not None and lucky and len(found.category):
        target = match_detections(found, objects)
        if bool((target >= 0).any()):
            some = _some(len(target), change.most_objects, generator)
            return _Picked(found.bfov[some], found.category[some], target[some], true=False)
    some = _some(len(objects.category), change.most_objects, generator)
    return _Picked(objects.bfov[some], objects.category[some], some, true=True)


def _some(count: int, most: int, generator: torch.Generator) -> Int64[Tensor, " some"]:
    return torch.randperm(count, generator=generator)[:most]


def random_turn(generator: torch.Generator) -> Float[Tensor, "3 3"]:
    """Return a turn about the vertical, for half of all numbers with a mirror image."""
    angle, coin = torch.rand(2, generator=generator).tolist()
    turn = torch.tensor(angle * 2 * torch.pi)
    cos, sin = turn.cos().item(), turn.sin().item()
    flip = -1.0 if coin < 0.5 else 1.0
    return torch.tensor([[cos * flip, -sin, 0.0], [sin * flip, cos, 0.0], [0.0, 0.0, 1.0]])


def _random_tilt(deviation_deg: float, generator: torch.Generator) -> Float[Tensor, "3 3"]:
    x, y = (torch.randn(2, generator=generator) * deviation_deg).deg2rad().tolist()
    return torch.linalg.matrix_exp(torch.tensor([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]]))


def turned_bfov(bfov: Float[Tensor, "n 4"], matrix: Float[Tensor, "3 3"]) -> Float[Tensor, "n 4"]:
    """Return the BFoVs in a world that was turned, and mirrored before where det is -1."""
    flip = torch.linalg.det(matrix).round()
    turn = torch.atan2(matrix[0, 1], matrix[1, 1])
    lon = wrap_angle(flip * bfov[:, 0] + turn)
    return torch.cat([lon.unsqueeze(-1), bfov[:, 1:]], dim=-1)


def turned_boxes(boxes: OrientedBoxes, matrix: Float[Tensor, "3 3"]) -> OrientedBoxes:
    flip = torch.linalg.det(matrix).round()
    turn = torch.atan2(matrix[0, 1], matrix[1, 1])
    return OrientedBoxes(boxes.centre @ matrix.T, boxes.size, wrap_angle(flip * boxes.yaw - turn))


def turned_layout(
    layout: Layout,
    matrix: Float[Tensor, "3 3"],
    stretch: Float[Tensor, "3"],
    shift: Float[Tensor, "2"] | None = None,
) -> Layout:
    """Return a room stretched and moved along the axes, then turned as the world was."""
    corners = layout.floor_polygon * stretch[:2]
    corners = (corners if shift is None else corners + shift) @ matrix[:2, :2].T
    if torch.linalg.det(matrix) < 0:
        corners = corners.flip(0)
    return Layout(corners, layout.floor_height, layout.ceiling_height * float(stretch[2]))


def jittered_bfov(
    bfov: Float[Tensor, "n 4"],
    change: PoseAugmentation,
    severity: float,
    generator: torch.Generator,
) -> Float[Tensor, "n 4"]:
    move, grow = torch.randn(2, len(bfov), 2, generator=generator) * severity
    centre = bfov[:, :2] + move * change.centre * bfov[:, 2:]
    lon, lat = wrap_angle(centre[:, 0]), centre[:, 1].clamp(-torch.pi / 2, torch.pi / 2)
    extent = (bfov[:, 2:] * (grow * change.extent).exp()).clamp(_NARROWEST, _WIDEST)
    return torch.cat([torch.stack([lon, lat], dim=-1), extent], dim=-1)


def _random_layout(
    layout: Layout,
    matrix: Float[Tensor, "3 3"],
    change: PoseAugmentation,
    generator: torch.Generator,
) -> Layout | None:
    """Return the room as a network might have seen it, or none."""
    lucky = float(torch.rand((), generator=generator)) < change.no_layout
    stretch = 1 + torch.randn(3, generator=generator) * change.wall
    if lucky:
        return None
    return turned_layout(layout, matrix, stretch)


def padded(parts: Sequence[Tensor], length: int) -> Tensor:
    whole = parts[0].new_zeros(len(parts), length, *parts[0].shape[1:])
    for k, part in enumerate(parts):
        whole[k, : len(part)] = part
    return whole
