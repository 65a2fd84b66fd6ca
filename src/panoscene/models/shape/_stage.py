"""The stage: a photo and its objects to shapes."""

import math
from pathlib import Path

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from panoscene._editions import Edition
from panoscene.geometry import perspective_crop, view_relative_yaw
from panoscene.models._folding import fold_norms
from panoscene.models._weights import load_network, weights_file
from panoscene.scene import Mesh, Objects, Shapes, ShapeSource, box_mesh, built_in

from ._config import CONFIGS
from ._extract import extract_meshes
from ._fewer import FACES_PER_CELL
from ._network import ShapeNetwork, build_shape, view_hints
from ._threads import alone, side_by_side

STAGE = "shape"
"""Name of this stage in files with weights."""
THIN_METRES = 0.03
"""Objects whose smallest side is below it are slabs."""
THIN_SHARE = 0.06
"""So are those whose smallest side is less than this share of the longest: carpets, pictures."""
_BATCH = 32
_TOGETHER = 10
"""Pictures that a thread works on at once."""


class ShapeStage:
    """Gives every object a mesh: predicted, or its box where that says more.

    Args:
        network: With trained weights; it is put in evaluation mode.
        device: To work on.
    """

    def __init__(self, network: ShapeNetwork, device: str | torch.device = "cpu") -> None:
        self.device = torch.device(device)
        self.network = network.to(self.device).eval()

    @torch.inference_mode()
    def __call__(
        self, image: Float[Tensor, "3 height width"], objects: Objects, *, resolution: int = 64
    ) -> Shapes:
        """Return codes and closed meshes of all objects, in the canonical box [-1/2, 1/2]^3.

        Thin objects, doors and windows get a slab: their box. So do, as ``box``, those whose
        predicted shape is empty.
        Where a surface is flat its triangles are joined, until there are about 32 for each cell
        along an axis: 2,048 at resolution 64.

        Args:
            image: Upright panorama, RGB in [0, 1].
            objects: Their BFoVs say where to look; boxes and categories are used, too.
            resolution: Of the grid in which meshes are found: 32, 64, 128 or 256 cells along each
                axis.

        Raises:
            ValueError: ``resolution`` is none of these.

        Source: paper, Sec. 3.1; slabs and fewer triangles are ours.
        """
        codes = self.codes(image, objects)
        network = (~slab_objects(objects)).nonzero()[:, 0]
        most = FACES_PER_CELL * resolution
        found = extract_meshes(self.network, codes[network], resolution=resolution, most=most)
        meshes: list[Mesh] = [box_mesh() for _ in range(len(objects.boxes))]
        sources: list[ShapeSource] = ["slab"] * len(meshes)
        for index, mesh in zip(network.tolist(), found, strict=True):
            sources[index] = "box" if mesh is None else "network"
            if mesh is not None:
                meshes[index] = mesh
        return Shapes(code=codes.cpu(), mesh=tuple(meshes), source=tuple(sources))

    @torch.inference_mode()
    def codes(
        self, image: Float[Tensor, "3 height width"], objects: Objects
    ) -> Float[Tensor, "n code"]:
        """Return the shape codes of all objects.

        Args:
            image: Upright panorama, RGB in [0, 1].
            objects: Seen in it.
        """
        rows = self.network.config.crop
        image = image.to(self.device)
        bfov = objects.bfov.to(image)
        boxes = objects.boxes
        lon = torch.atan2(boxes.centre[:, 0], boxes.centre[:, 1])
        hints = view_hints(bfov, boxes.size.to(image), view_relative_yaw(boxes.yaw, lon).to(image))
        category = objects.category.to(self.device)
        quick = self.device.type == "cpu"

        @torch.inference_mode()
        def some(number: Int64[Tensor, " m"]) -> Float[Tensor, "m code"]:
            crops = perspective_crop(image, bfov[number], (rows, rows)).clamp(0, 1)
            if quick:
                crops = crops.contiguous(memory_format=torch.channels_last)
            return self.network(crops, category[number], hints[number])

        found = [torch.zeros(0, self.network.config.code, device=self.device)]
        number = torch.arange(len(bfov), device=self.device)
        if not quick:
            return torch.cat(found + [some(part) for part in number.split(_BATCH) if len(part)])
        # pieces do not depend on how many threads there are: nor does what is found
        pieces = number.tensor_split(2 * max(math.ceil(len(number) / (2 * _TOGETHER)), 1))
        with alone() as threads:
            found += side_by_side(some, (part for part in pieces if len(part)), threads)
        return torch.cat(found)


def thin_boxes(size: Float[Tensor, "n 3"]) -> Bool[Tensor, " n"]:
    """Return which boxes are so thin that the box itself is the best shape.

    Examples:
        >>> thin_boxes(torch.tensor([[2.0, 1.5, 0.01], [0.5, 0.5, 0.9]]))
        tensor([ True, False])
    """
    least, most = size.amin(-1), size.amax(-1)
    return (least < THIN_METRES) | (least < THIN_SHARE * most)


def slab_objects(objects: Objects) -> Bool[Tensor, " n"]:
    """Return for which objects the box itself is the best shape: thin ones, doors and windows.

    Args:
        objects: Their boxes and categories.
    """
    return thin_boxes(objects.boxes.size) | built_in(objects.category).to(objects.boxes.size.device)


def load_shape_stage(
    edition: Edition = "compact", weights: Path | None = None, device: str = "cpu"
) -> ShapeStage:
    """Return the shape stage with trained weights.

    Args:
        edition: Size of the network.
        weights: File of them; None takes those that come with the package (compact only).
        device: To work on.

    Raises:
        CheckpointError: The weights are missing or for another network.
    """
    path = weights_file(STAGE, edition, weights)
    network = load_network(path, build_shape, CONFIGS[edition], stage=STAGE, edition=edition)
    fold_norms(network.encoder.backbone)
    return ShapeStage(network, device)
