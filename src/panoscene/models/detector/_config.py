"""What the detector is built from, in both editions."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from panoscene._editions import Edition
from panoscene.models._backbone import BackboneName

Seam = Literal["circular", "extend", "none"]
"""How objects at the left and right edge are seen whole. ``circular``: padding wraps around and
boxes run on past the edge. ``extend``: the left half is appended at the right, as in the paper.
``none``: the picture is cut there, and halves are joined afterwards."""
Anchor = tuple[float, float]
"""Width and height in pixels of the network's picture."""


class DetectorConfig(BaseModel):
    """Everything that decides the network's shape and what it does with a panorama."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    backbone: BackboneName
    width: Annotated[int, Field(multiple_of=64, ge=64)]
    """Columns that the whole panorama is scaled to; its rows become half as many."""
    first_row: Annotated[int, Field(ge=0)] = 0
    """The network sees ``rows`` rows from this one on; what is above hardly shows objects."""
    rows: Annotated[int, Field(multiple_of=32, ge=32)]
    seam: Seam = "circular"
    frozen: tuple[str, ...] = ()
    """Parts of the backbone that keep their start weights."""
    fold_norms: bool = False
    """Whether batch normalisations become part of the convolutions before them."""
    channels: int = 256
    """Of the feature pyramid."""
    extra_level: bool = False
    """Whether a coarser level is pooled from the last one."""
    anchors: tuple[tuple[Anchor, ...], ...]
    """Of each level of the pyramid, finest first; the same number in each."""
    proposal_layers: Annotated[int, Field(ge=0)] = 1
    """Convolutions between the pyramid and the scores of anchors."""
    anchor_samples: int = 256
    """Anchors in the loss of each picture."""
    candidates: tuple[int, int] = (2000, 1000)
    """Best anchors of each level before suppression: training, inference."""
    proposals: tuple[int, int] = (2000, 1000)
    """Proposals after it: training, inference."""
    region_samples: int = 512
    """Proposals in the loss of each picture."""
    positive_share: float = 0.25
    canonical_size: float = 224.0
    """Proposals of this size (root of the area) are read from the third level."""
    head_width: int = 1024
    per_category: bool = True
    """Whether boxes and masks are predicted for each category, or one for all."""
    mask_channels: tuple[int, ...] = (256, 256, 256, 256)
    score_threshold: float = 0.05
    """Detections below are dropped."""
    overlap_threshold: float = 0.5
    """Boxes of a category that overlap a better one by more are dropped."""
    most_detections: int = 100


def _anchors(size: float, ratios: tuple[float, ...] = (0.5, 1.0, 2.0)) -> tuple[Anchor, ...]:
    """Return anchors of one area; ratios are heights by widths."""
    return tuple((size / ratio**0.5, size * ratio**0.5) for ratio in ratios)


CONFIGS: dict[Edition, DetectorConfig] = {
    # Mask R-CNN as in torchvision, whose weights it can load; the picture at the size that the
    # authors' detector brings a panorama of 512 rows to
    "paper": DetectorConfig(
        backbone="resnet50",
        width=1344,
        rows=672,
        seam="extend",
        frozen=("conv1", "bn1", "layer1"),
        extra_level=True,
        anchors=tuple(_anchors(size) for size in (32.0, 64.0, 128.0, 256.0, 512.0)),
    ),
    # latitudes from 50.6 degrees above to 69.4 degrees below the horizon: in the training split
    # 97 % of the objects lie wholly in there. Anchors: all but 6 % of the objects overlap one by
    # more than half; each level has the same shapes, for one head judges them all
    "compact": DetectorConfig(
        backbone="tf_efficientnet_lite0",
        width=768,
        first_row=84,
        rows=256,
        frozen=("conv_stem", "bn1", "blocks.0", "blocks.1"),
        fold_norms=True,
        channels=64,
        extra_level=True,
        anchors=tuple(
            _anchors(size, (0.45, 1.0, 1.8, 3.6)) for size in (14.0, 28.0, 56.0, 112.0, 224.0)
        ),
        proposal_layers=0,
        anchor_samples=192,
        candidates=(200, 150),
        proposals=(160, 100),
        region_samples=64,
        positive_share=0.3,
        canonical_size=112.0,
        head_width=384,
        per_category=False,
        mask_channels=(64, 64),
        most_detections=60,
    ),
}
"""The two editions."""
