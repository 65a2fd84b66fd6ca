"""What is in a proposal: its category, its box, its mask."""

from collections import OrderedDict
from collections.abc import Sequence

import torch
import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor, nn

from panoscene.scene import CATEGORIES

from ._box_codes import BoxCoder
from ._boxes import Frame, nearest_turn, suppress, within_picture
from ._config import DetectorConfig
from ._proposals import choose, match_boxes
from ._regions import read_regions
from ._targets import DetectorTargets, RegionPredictions, mask_targets

_BOX_CELLS, _MASK_CELLS = 7, 14
_SAME_OBJECT = 0.5
_START = {
    "mask_predictor.mask_fcn_logits.weight": 1e-3,
    "box_predictor.cls_score.weight": 1e-2,
    "box_predictor.bbox_pred.weight": 1e-3,
}
"""Standard deviations of the last layers' start weights."""


class BoxHead(nn.Module):
    """Two layers on the features of a box."""

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        self.fc6 = nn.Linear(inputs, width)
        self.fc7 = nn.Linear(width, width)

    def forward(self, features: Float[Tensor, "n channels cells cells"]) -> Tensor:
        """Return one vector (n, width) for each box."""
        return self.fc7(self.fc6(features.flatten(1)).relu()).relu()


class BoxPredictor(nn.Module):
    """Scores of background and all categories, and boxes for each of them or one for all."""

    def __init__(self, width: int, boxes: int) -> None:
        super().__init__()
        self.cls_score = nn.Linear(width, len(CATEGORIES) + 1)
        self.bbox_pred = nn.Linear(width, 4 * boxes)

    def forward(self, features: Float[Tensor, "n width"]) -> tuple[Tensor, Tensor]:
        """Return logits (n, 58) and box codes (n, boxes, 4)."""
        return self.cls_score(features), self.bbox_pred(features).unflatten(-1, (-1, 4))


class RegionHeads(nn.Module):
    """Mask R-CNN's box and mask heads, with torchvision's names, on a pyramid, round or not."""

    def __init__(self, config: DetectorConfig) -> None:
        super().__init__()
        self.config = config
        kinds = len(CATEGORIES) + 1 if config.per_category else 1
        width = config.head_width
        self.box_head = BoxHead(config.channels * _BOX_CELLS**2, width)
        self.box_predictor = BoxPredictor(width, kinds)
        self.mask_head = _mask_head(config.channels, config.mask_channels)
        last = config.mask_channels[-1]
        self.mask_predictor = _mask_predictor(last, kinds)
        # features of the backbone may be large: start near indifference
        for name, deviation in _START.items():
            nn.init.normal_(self.get_parameter(name), std=deviation)
        self.coder = BoxCoder(shift=10.0, growth=5.0)

    def losses(
        self,
        pyramid: list[Tensor],
        proposals: list[Tensor],
        targets: list[DetectorTargets],
        period: float | None,
    ) -> dict[str, Tensor]:
        """Return the losses of category, box and mask over sampled proposals."""
        chosen = [self._sample(p, t, period) for p, t in zip(proposals, targets, strict=True)]
        boxes = [c[0] for c in chosen]
        match, label = [c[1] for c in chosen], torch.cat([c[2] for c in chosen])
        logits, codes = self._classify(pyramid, boxes, period)
        terms = {"category": F.cross_entropy(logits, label)}
        positive = label > 0
        counts = [int((m >= 0).sum()) for m in match]
        gold = torch.cat([t.boxes[m[:n]] for t, m, n in zip(targets, match, counts, strict=True)])
        flat = torch.cat(boxes)[positive]
        code = self.coder.encode(nearest_turn(gold, flat, period), flat)
        kind = label[positive] if self.config.per_category else torch.zeros_like(label[positive])
        row = torch.arange(len(kind), device=kind.device)
        terms["box"] = F.smooth_l1_loss(
            codes[positive][row, kind], code, beta=1 / 9, reduction="sum"
        ) / max(len(label), 1)
        of_object = [b[:n] for b, n in zip(boxes, counts, strict=True)]
        masks = self._masks(pyramid, of_object, period)[row, kind]
        wanted = [
            mask_targets(t, b, m[:n], 2 * _MASK_CELLS)
            for t, b, m, n in zip(targets, of_object, match, counts, strict=True)
        ]
        cells = max(masks.numel(), 1)
        terms["mask"] = (
            F.binary_cross_entropy_with_logits(masks, torch.cat(wanted), reduction="sum") / cells
        )
        return terms

    def detect(
        self,
        pyramid: list[Tensor],
        proposals: list[Tensor],
        frame: Frame,
    ) -> list[RegionPredictions]:
        """Return the objects of each picture, best first."""
        logits, codes = self._classify(pyramid, proposals, frame.period)
        counts = [len(p) for p in proposals]
        found = [
            self._select(p, s, c, frame)
            for p, s, c in zip(
                proposals, logits.softmax(-1).split(counts), codes.split(counts), strict=True
            )
        ]
        masks = self._masks(pyramid, [f[0] for f in found], frame.period)
        kind = torch.cat([f[1] for f in found])
        kind = kind + 1 if self.config.per_category else torch.zeros_like(kind)
        row = torch.arange(len(kind), device=kind.device)
        shapes = masks[row, kind].sigmoid().split([len(f[0]) for f in found])
        return [RegionPredictions(*one, mask) for one, mask in zip(found, shapes, strict=True)]

    def _sample(
        self, proposals: Float[Tensor, "n 4"], targets: DetectorTargets, period: float | None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return boxes, their objects (-1 for none) and labels (0 for none), objects first."""
        boxes = torch.cat((targets.boxes, proposals))
        match, label = match_boxes(boxes, targets, period, _SAME_OBJECT, _SAME_OBJECT)
        generator = torch.Generator().manual_seed(targets.seed + 1)
        share, count = self.config.positive_share, self.config.region_samples
        positive, negative = choose(label, count, share, generator)
        category = targets.category[match[positive]] + 1
        chosen = torch.cat((positive, negative))
        nothing = torch.zeros_like(negative)
        return (
            boxes[chosen],
            torch.cat((match[positive], nothing - 1)),
            torch.cat((category, nothing)),
        )

    def _classify(
        self, pyramid: list[Tensor], boxes: list[Tensor], period: float | None
    ) -> tuple[Tensor, Tensor]:
        features = read_regions(pyramid, boxes, _BOX_CELLS, period, self.config.canonical_size)
        return self.box_predictor(self.box_head(features))

    def _masks(
        self, pyramid: list[Tensor], boxes: list[Tensor], period: float | None
    ) -> Float[Tensor, "n kinds size size"]:
        features = read_regions(pyramid, boxes, _MASK_CELLS, period, self.config.canonical_size)
        return self.mask_predictor(self.mask_head(features))

    def _select(
        self,
        proposals: Float[Tensor, "n 4"],
        score: Float[Tensor, "n 58"],
        codes: Float[Tensor, "n kinds 4"],
        frame: Frame,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return boxes, categories and scores of the detections worth keeping."""
        score = score[:, 1:]
        row, category = (score > self.config.score_threshold).nonzero().unbind(-1)
        kind = category + 1 if self.config.per_category else torch.zeros_like(category)
        boxes = self.coder.decode(codes[row, kind], proposals[row])
        boxes = within_picture(boxes, frame)
        score = score[row, category]
        solid = ((boxes[:, 2:] - boxes[:, :2]) > 1.0).all(-1)
        boxes, category, score = boxes[solid], category[solid], score[solid]
        kept = suppress(boxes, score, category, self.config.overlap_threshold, frame.period)
        kept = kept[: self.config.most_detections]
        return boxes[kept], category[kept], score[kept]


def _mask_head(channels: int, widths: Sequence[int]) -> nn.Sequential:
    blocks = []
    for given, made in zip((channels, *widths), widths, strict=False):
        layer = nn.Conv2d(given, made, 3, padding=1)
        nn.init.kaiming_normal_(layer.weight, mode="fan_out", nonlinearity="relu")
        if layer.bias is not None:
            nn.init.zeros_(layer.bias)
        blocks.append(nn.Sequential(layer, nn.ReLU(inplace=True)))
    return nn.Sequential(*blocks)


def _mask_predictor(width: int, kinds: int) -> nn.Sequential:
    larger, logits = nn.ConvTranspose2d(width, width, 2, 2), nn.Conv2d(width, kinds, 1)
    for layer in (larger, logits):
        nn.init.kaiming_normal_(layer.weight, mode="fan_out", nonlinearity="relu")
    return nn.Sequential(
        OrderedDict[str, nn.Module](
            conv5_mask=larger, relu=nn.ReLU(inplace=True), mask_fcn_logits=logits
        )
    )
