"""The pose stage: detections in a panorama to boxes in the room."""

from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

from panoscene._editions import Edition
from panoscene.geometry import OrientedBoxes, decode_box_code, perspective_crop
from panoscene.models._weights import load_network, weights_file
from panoscene.scene import CATEGORIES, Detections, Layout, Objects

from ._clues import pose_clues
from ._config import CONFIGS
from ._network import PoseNetwork, PoseOutput, build_pose

STAGE = "pose"
"""Name of this stage in files with weights."""
SMALLEST_SIZE = 0.005
"""Metres; boxes are never thinner."""
_ROWS = 512
_CROPS_AT_ONCE = 64
_NEAREST = 0.05


class PoseStage:
    """Turns detections into boxes with sizes, places and yaws.

    Attributes:
        network: In evaluation mode.
    """

    def __init__(self, network: PoseNetwork) -> None:
        self.network = network.eval()

    @torch.inference_mode()
    def __call__(
        self,
        image: Float[Tensor, "3 height width"],
        detections: Detections,
        layout: Layout | None,
        camera_height: float,
    ) -> Objects:
        """Return one object for each detection, in the same order.

        Args:
            image: Upright panorama, RGB in [0, 1].
            detections: Where the objects are and what they are.
            layout: The room, which the compact network uses where there is one.
            camera_height: Metres above the floor.

        Convention:
            - scores are those of the detections; ``distance_score`` and ``yaw_score`` are the
              probabilities of the chosen bins
            - ids are the category and the place in the list, such as chair_4
            - source: the paper, Sec. 3.1

        Raises:
            ValueError: The camera is not above the floor.
        """
        encoded = self.encoded(image, detections)
        return self.placed(encoded, detections, layout, camera_height)

    @torch.inference_mode()
    def encoded(
        self, image: Float[Tensor, "3 height width"], detections: Detections
    ) -> Float[Tensor, "n features"]:
        """Return the encoded crop of each detection, where the network is.

        Args:
            image: As in a call.
            detections: As in a call.
        """
        device = self.network.mean_size.device
        crop_px = self.network.config.crop_px
        return self.network.encoded(
            pose_crops(image.to(device), detections.bfov.to(device), crop_px)
        )

    @torch.inference_mode()
    def placed(
        self,
        encoded: Float[Tensor, "n features"],
        detections: Detections,
        layout: Layout | None,
        camera_height: float,
    ) -> Objects:
        """Return what a call returns, for crops that are encoded already.

        Args:
            encoded: From ``encoded``.
            detections: As in a call.
            layout: As in a call.
            camera_height: As in a call.

        Raises:
            ValueError: The camera is not above the floor.
        """
        output = self.output(encoded, detections, layout, camera_height)
        return self.decoded(output, detections, camera_height)

    @torch.inference_mode()
    def output(
        self,
        encoded: Float[Tensor, "n features"],
        detections: Detections,
        layout: Layout | None,
        camera_height: float,
    ) -> PoseOutput:
        """Return what the network says of one scene, batch shape (1, n).

        Args:
            encoded: From ``encoded``.
            detections: As in a call.
            layout: As in a call.
            camera_height: As in a call.

        Raises:
            ValueError: The camera is not above the floor.
        """
        if not camera_height > 0:
            raise ValueError(f"camera_height: found {camera_height}, expected above 0")
        device = self.network.mean_size.device
        bfov = detections.bfov.to(device, torch.float32)
        category = detections.category.to(device)
        clues = None
        if self.network.config.clues:
            mean_size = self.network.mean_size[category]
            clues = pose_clues(bfov, mean_size, camera_height, layout).unsqueeze(0)
        every = torch.ones_like(category, dtype=torch.bool)
        return self.network.placed(
            encoded, bfov.unsqueeze(0), category.unsqueeze(0), every.unsqueeze(0), clues=clues
        )

    def decoded(self, output: PoseOutput, detections: Detections, camera_height: float) -> Objects:
        """Return the objects that the network's output describes.

        Args:
            output: Of one scene.
            detections: It is of.
            camera_height: As in a call.
        """
        device = self.network.mean_size.device
        bfov = detections.bfov.to(device, torch.float32)
        category = detections.category
        mean_size = self.network.mean_size[category.to(device)]
        boxes = decode_box_code(
            output.code(), bfov.unsqueeze(0), mean_size.unsqueeze(0), camera_height
        )[0]
        back = detections.bfov.device
        return Objects(
            boxes=_kept_sound(boxes, camera_height, back),
            category=detections.category,
            score=detections.score,
            bfov=detections.bfov,
            distance_score=_confidence(output.distance_logit).to(back),
            yaw_score=_confidence(output.yaw_logit).to(back),
            id=tuple(f"{CATEGORIES[k]}_{i}" for i, k in enumerate(category.tolist())),
        )


def pose_crops(
    image: Float[Tensor, "3 height width"], bfov: Float[Tensor, "n 4"], crop_px: int
) -> Float[Tensor, "n 3 rows columns"]:
    """Return the crops of BFoVs as the network wants them; a larger panorama is shrunk first.

    Args:
        image: Upright panorama, RGB in [0, 1].
        bfov: (lon, lat, width, height) in radians.
        crop_px: Rows and columns.
    """
    if not len(bfov):
        return image.new_zeros(0, 3, crop_px, crop_px)
    shrink = image.shape[-2] // _ROWS
    if shrink > 1:
        image = functional.avg_pool2d(image, shrink)
    parts = [
        perspective_crop(image, part, (crop_px, crop_px)) for part in bfov.split(_CROPS_AT_ONCE)
    ]
    return torch.cat(parts).clamp(0.0, 1.0)


def load_pose_stage(
    edition: Edition = "compact", weights: Path | None = None, device: str = "cpu"
) -> PoseStage:
    """Return the pose stage with trained weights.

    Args:
        edition: Which network.
        weights: A .safetensors file; None for the compact weights that come with the package.
        device: Where it runs.

    Raises:
        CheckpointError: There are no weights, or they are for another network.
    """
    path = weights_file(STAGE, edition, weights)
    network = load_network(path, build_pose, CONFIGS[edition], stage=STAGE, edition=edition)
    return PoseStage(network.to(device))


def _kept_sound(boxes: OrientedBoxes, camera_height: float, device: torch.device) -> OrientedBoxes:
    """Return boxes with positive sizes, none of them centred on the camera."""
    eye = boxes.centre.new_tensor([0.0, 0.0, camera_height])
    ray = boxes.centre - eye
    length = torch.linalg.vector_norm(ray, dim=-1, keepdim=True).clamp(min=1e-6)
    centre = eye + ray * (length.clamp(min=_NEAREST) / length)
    size = boxes.size.clamp(min=SMALLEST_SIZE)
    return OrientedBoxes(centre.to(device), size.to(device), boxes.yaw.to(device))


def _confidence(logit: Float[Tensor, "1 n bins"]) -> Float[Tensor, " n"]:
    return logit[0].softmax(dim=-1).amax(dim=-1)
