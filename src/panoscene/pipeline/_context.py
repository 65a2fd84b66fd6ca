"""What pose, shape and relation graph network say of one scene together."""

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.models.context import ContextStage, Estimates
from panoscene.models.pose import PoseStage
from panoscene.models.shape import ShapeStage, analytic_code, blob_centres
from panoscene.scene import Detections, Layout, Objects, Relations

from ._clock import Clock


class ContextReader:
    """Refines the pose network's boxes, and says how objects and walls are related.

    Attributes:
        pose: Gives the first boxes, and what it sees in each crop.
        shape: Gives the codes that the network is told; None where it knows no shapes.
        context: The relation graph network.
    """

    def __init__(self, pose: PoseStage, shape: ShapeStage | None, context: ContextStage) -> None:
        self.pose = pose
        self.shape = shape
        self.context = context

    @torch.inference_mode()
    def __call__(
        self,
        image: Float[Tensor, "3 height width"],
        detections: Detections,
        layout: Layout,
        camera_height: float,
        *,
        clock: Clock | None = None,
    ) -> tuple[Objects, Relations | None]:
        """Return one object for each detection, in their order, and relations if it knows any.

        Args:
            image: Upright panorama, RGB in [0, 1].
            detections: Where the objects are and what they are.
            layout: The room.
            camera_height: Metres above the floor.
            clock: Told of the seconds for ``pose`` and ``codes``.

        Source: paper, Sec. 3.2.
        """
        estimates = self.estimates(image, detections, layout, camera_height, clock=clock)
        return self.context(estimates)[0]

    @torch.inference_mode()
    def estimates(
        self,
        image: Float[Tensor, "3 height width"],
        detections: Detections,
        layout: Layout,
        camera_height: float,
        *,
        clock: Clock | None = None,
    ) -> Estimates:
        """Return what the relation graph network is told, a batch of one scene.

        Args:
            image: As in a call.
            detections: As in a call.
            layout: As in a call.
            camera_height: As in a call.
            clock: As in a call.
        """
        clock = clock or Clock()
        pose = self.pose
        with clock("pose"):
            encoded = pose.encoded(image, detections)
            output = pose.output(encoded, detections, layout, camera_height)
        mean_size = pose.network.mean_size[detections.category.to(encoded.device)]
        code = encoded.new_zeros(len(encoded), 0)
        blobs = encoded.new_zeros(len(encoded), 0, 3)
        if self.shape is not None:
            objects = pose.decoded(output, detections, camera_height)
            config = self.shape.network.config
            with clock("codes"):
                code = analytic_code(self.shape.codes(image, objects), config).to(encoded)
            size = (output.size_residual[0] + 1) * mean_size
            blobs = blob_centres(code, size, config)
        polygon = layout.floor_polygon.to(encoded)
        return Estimates(
            bfov=detections.bfov.to(encoded).unsqueeze(0),
            category=detections.category.to(encoded.device).unsqueeze(0),
            score=detections.score.to(encoded).unsqueeze(0),
            valid=torch.ones(1, len(encoded), dtype=torch.bool, device=encoded.device),
            output=output,
            appearance=encoded.unsqueeze(0),
            shape_code=code.unsqueeze(0),
            blob_centre=blobs.unsqueeze(0),
            mean_size=mean_size.unsqueeze(0),
            camera_height=encoded.new_tensor([camera_height]),
            polygon=polygon.unsqueeze(0),
            wall_valid=torch.ones(1, len(polygon), dtype=torch.bool, device=encoded.device),
            ceiling=encoded.new_tensor([layout.ceiling_height]),
        )
