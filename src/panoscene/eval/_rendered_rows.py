"""The rows of the table of results on rendered homes."""

from collections.abc import Mapping
from types import MappingProxyType

from panoscene.eval._export import ExportedMethod

RENDERED = "rendered homes"
"""What the targets' description begins with when they are panoramas of a rendered set."""
ROWS: Mapping[str, ExportedMethod] = MappingProxyType(
    {
        "full": ExportedMethod(
            "ours",
            "the whole pipeline; the relations are those of its boxes, without contacts that the"
            " network thinks unlikely, with those it thinks likely where at most 0.3 m are between",
            compared_with=("without-arrangement", "pose"),
        ),
        "without-arrangement": ExportedMethod(
            "ours",
            "the same without the arrangement; the relations are what the network says",
            compared_with=("pose",),
        ),
        "pose-arranged": ExportedMethod(
            "ours",
            "the pose network's boxes of what `full` keeps, arranged with relations that follow "
            "from them",
            compared_with=("pose",),
            shapes=False,
        ),
        "pose": ExportedMethod(
            "input",
            "the pose network's boxes alone of what `full` keeps (doubles are out), relations by a "
            "geometric rule",
        ),
        "mean-box": ExportedMethod(
            "baseline",
            "mean size where its height fills the BFoV, in a square room",
            shapes=False,
        ),
        "true-layout": ExportedMethod(
            "oracle", "the whole pipeline in the true room", shapes=False
        ),
        "true-detections": ExportedMethod(
            "oracle", "the whole pipeline on the true BFoVs", shapes=False
        ),
        "true-boxes": ExportedMethod(
            "oracle", "the true boxes in the room that the pipeline sees", shapes=False
        ),
        "true-relations": ExportedMethod(
            "oracle",
            "the arrangement in the true room, with true BFoVs and relations",
            shapes=False,
        ),
    }
)
"""What ``export_reconstructions`` writes, by name."""
