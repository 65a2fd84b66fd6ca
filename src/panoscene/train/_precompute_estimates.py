"""Pose and shape network, run once over a data set for the relation graph network."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.data import (
    ESTIMATES,
    RECORDS,
    EncodedObjects,
    EstimateRecord,
    PoseAugmentation,
    StageRecord,
    augment_photo,
    match_detections,
    read_stage_record,
    seed_of,
    write_estimate_record,
)
from panoscene.data._pose_samples import jittered_bfov
from panoscene.geometry import wrap_angle
from panoscene.models.pose import PoseStage, pose_crops
from panoscene.models.shape import ShapeStage, analytic_code
from panoscene.scene import Detections, Layout, upright_photo
from panoscene.synth.dataset import PanoramaItem, open_dataset

from ._environment import data_hash
from ._errors import TrainError
from ._precompute import HEADER, begin_records

_SEED = 21
_MOVES = PoseAugmentation()


def precompute_estimates(
    data: Path,
    records: Path,
    output: Path,
    *,
    pose: PoseStage,
    shape: ShapeStage | None,
    sources: Mapping[str, str],
    splits: Sequence[str] = ("train", "val"),
    copies: int = 1,
    told: Callable[[int, int], None] = lambda done, total: None,
) -> int:
    """Write what the encoders see of each panorama; return how many records were new.

    Detections and layouts are those of ``precompute``; the same is done for the true BFoVs, so
    that the training does not hang on the detector alone. Records that are there are kept, so the
    work may be stopped at any time; each appears as a whole or not at all.

    Args:
        data: Folder of a data set.
        records: What ``precompute`` wrote for it.
        output: Folder that gets precompute.json and estimates/NAME.safetensors.
        pose: Encodes crops, and places the objects for the shape network.
        shape: Gives codes; None for none.
        sources: What the stages are, such as the hashes of their weights: records of others are
            not mixed with these.
        splits: Parts of the data set.
        copies: How often the true BFoVs of the part ``train`` are moved as a detector would.
        told: Called with how many are done, and how many there are.

    Raises:
        TrainError: The folder has records of other weights or data, or there are no stage records.
        DatasetError: The data set or a record is damaged.
    """
    items = [item for split in splits for item in open_dataset(data, split)]
    made = _header(records, "stage records: make them with panoscene precompute")
    begin_records(
        output,
        {"data_hash": data_hash(data), "records": made, "copies": str(copies), **sources},
        ESTIMATES,
    )
    new = 0
    for done, item in enumerate(items):
        told(done, len(items))
        file = output / ESTIMATES / f"{item.name}.safetensors"
        if not file.is_file():
            found = read_stage_record(records / RECORDS / f"{item.name}.json", masks=False)
            count = copies if item.split == "train" else 0
            write_estimate_record(estimate_record(item, found, pose, shape, copies=count), file)
            new += 1
    told(len(items), len(items))
    return new


@torch.inference_mode()
def estimate_record(
    item: PanoramaItem,
    found: StageRecord,
    pose: PoseStage,
    shape: ShapeStage | None,
    *,
    copies: int = 0,
) -> EstimateRecord:
    """Return what the encoders see of a panorama, the same at every call."""
    scene = item.scene()
    image = upright_photo(item.image(), scene.panorama)
    height = scene.panorama.camera_height
    objects = scene.objects
    true = Detections(objects.bfov, objects.category, torch.ones_like(objects.score))
    every = torch.arange(len(true.category))

    def seen(
        photo: Float[Tensor, "3 height width"],
        what: Detections,
        target: Int64[Tensor, " n"],
        shape: ShapeStage | None,
    ) -> EncodedObjects:
        layout = found.layout or scene.layout
        return encoded_objects(photo, what, target, layout, height, pose=pose, shape=shape)

    as_true = seen(image, true, every, shape)
    moved = []
    for copy in range(copies):
        generator = torch.Generator().manual_seed(seed_of(_SEED, copy, *item.name.encode()))
        severity = 1.5 * float(torch.rand((), generator=generator))
        bfov = jittered_bfov(true.bfov, _MOVES, severity, generator)
        photo = augment_photo(image, generator)
        view = seen(photo, replace(true, bfov=bfov), every, None)
        moved.append(replace(view, shape_code=as_true.shape_code))
    detections = replace(found.detections, mask=None)
    return EstimateRecord(
        found=seen(image, detections, match_detections(detections, objects), shape),
        true=as_true,
        moved=tuple(moved),
        layout=found.layout,
    )


def encoded_objects(
    image: Float[Tensor, "3 height width"],
    seen: Detections,
    target: Int64[Tensor, " n"],
    layout: Layout,
    camera_height: float,
    *,
    pose: PoseStage,
    shape: ShapeStage | None,
) -> EncodedObjects:
    """Return objects as the encoders see them, in the panorama and in its mirror image.

    Args:
        image: Upright panorama, RGB in [0, 1].
        seen: Where the objects are and what they are.
        target: Index of the true object of each, or -1.
        layout: The room.
        camera_height: Metres above the floor.
        pose: Encodes crops, and places the objects for the shape network.
        shape: Gives codes; None for none.
    """
    appearance, code = [], []
    for mirrored in (False, True):
        photo, what, room = image, seen, layout
        if mirrored:
            flip = seen.bfov.new_tensor([-1.0, 1.0, 1.0, 1.0])
            what = replace(seen, bfov=seen.bfov * flip)
            polygon = layout.floor_polygon * layout.floor_polygon.new_tensor([-1.0, 1.0])
            room = Layout(polygon.flip(0), layout.floor_height, layout.ceiling_height)
            photo = image.flip(-1)
        crops = pose_crops(photo, what.bfov, pose.network.config.crop_px)
        appearance.append(pose.network.encoded(crops))
        if shape is None:
            code.append(crops.new_zeros(len(crops), 0))
            continue
        objects = pose.placed(appearance[-1], what, room, camera_height)
        found = shape.codes(photo, objects)
        code.append(analytic_code(found, shape.network.config).to(appearance[-1]))
    return EncodedObjects(
        bfov=torch.cat([wrap_angle(seen.bfov[:, :1]), seen.bfov[:, 1:]], dim=-1),
        category=seen.category,
        score=seen.score,
        target=target,
        appearance=torch.stack(appearance),
        shape_code=torch.stack(code),
    )


def check_estimates(estimates: Path, data: Path, edition: str, pose: Path) -> None:
    """Check that estimates were made with these weights of the pose network, of this data set.

    Args:
        estimates: What ``precompute_estimates`` wrote.
        data: Folder of a data set.
        edition: Of the networks.
        pose: Weights.

    Raises:
        TrainError: They were not, or are not there.
    """
    found = json.loads(_header(estimates, "estimates: make them with panoscene precompute"))
    expected = {"data_hash": data_hash(data), "edition": edition, "pose": file_hash(pose)}
    wrong = [name for name, value in expected.items() if found.get(name) != value]
    if wrong:
        raise TrainError(
            estimates / HEADER,
            f"found estimates of another {' and '.join(wrong)}: take a new folder, and make them"
            " with the weights that the recipe names",
        )


def file_hash(weights: Path) -> str:
    """Return the SHA-256 of a file with weights, as the records name them."""
    return hashlib.sha256(weights.read_bytes()).hexdigest()


def _header(folder: Path, expected: str) -> str:
    """Return what records were made with."""
    file = folder / HEADER
    try:
        return json.dumps(json.loads(file.read_text(encoding="utf-8")), sort_keys=True)
    except (OSError, json.JSONDecodeError):
        raise TrainError(file, f"expected {expected} first") from None
