"""The region proposal network: where there may be an object of any category."""

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from panoscene.models._circular import make_circular

from ._box_codes import BoxCoder
from ._boxes import Frame, box_overlaps, nearest_turn, suppress, within_picture
from ._config import DetectorConfig
from ._targets import DetectorTargets

_SUPPRESS_ABOVE = 0.7
_OBJECT_ABOVE, _NOTHING_BELOW = 0.7, 0.3
_COMPACT_OBJECT_ABOVE = 0.5
_LEAST_SIDE = 1e-3
_IGNORE_SHARE = 0.5  # a box with more of itself in an ignored one teaches nothing


class ProposalHead(nn.Module):
    """Scores and shifts of the anchors at each pixel, with torchvision's names."""

    def __init__(self, channels: int, anchors: int, layers: int) -> None:
        super().__init__()
        self.conv = nn.Sequential(
            *(
                nn.Sequential(nn.Conv2d(channels, channels, 3, padding=1), nn.ReLU(inplace=True))
                for _ in range(layers)
            )
        )
        self.cls_logits = nn.Conv2d(channels, anchors, 1)
        self.bbox_pred = nn.Conv2d(channels, anchors * 4, 1)
        for layer in self.modules():
            if isinstance(layer, nn.Conv2d):
                nn.init.normal_(layer.weight, std=0.01)
                if layer.bias is not None:
                    nn.init.zeros_(layer.bias)

    def forward(self, level: Float[Tensor, "batch channels rows columns"]) -> tuple[Tensor, Tensor]:
        """Return logits (batch, n) and codes (batch, n, 4), by rows, columns and anchors."""
        features = self.conv(level)
        logits = self.cls_logits(features).permute(0, 2, 3, 1).flatten(1)
        codes = self.bbox_pred(features).permute(0, 2, 3, 1).flatten(1)
        return logits, codes.unflatten(1, (-1, 4))


class ProposalNetwork(nn.Module):
    """The proposal head on a pyramid, with anchors that know the cylinder."""

    def __init__(self, config: DetectorConfig) -> None:
        super().__init__()
        self.config = config
        self.head = ProposalHead(config.channels, len(config.anchors[0]), config.proposal_layers)
        if config.seam == "circular":
            make_circular(self.head)
        self.coder = BoxCoder()

    def forward(
        self,
        pyramid: list[Tensor],
        frame: Frame,
        targets: list[DetectorTargets] | None,
    ) -> tuple[list[Tensor], dict[str, Tensor]]:
        """Return proposals (n, 4) of each picture, and the losses where there are targets."""
        outputs = [self.head(level) for level in pyramid]
        counts = [logit.shape[1] for logit, _ in outputs]
        logits, shifts = (torch.cat(part, 1) for part in zip(*outputs, strict=True))
        anchors = self.anchors(pyramid, frame)
        batch = pyramid[0].shape[0]
        with torch.no_grad():
            proposals = [
                self._best(
                    logits[k].detach().split(counts),
                    shifts[k].detach().split(counts),
                    anchors.split(counts),
                    frame,
                )
                for k in range(batch)
            ]
        if targets is None:
            return proposals, {}
        terms = [
            self._losses(logits[k], shifts[k], anchors, targets[k], frame.period)
            for k in range(batch)
        ]
        objectness, box = (torch.stack(term).mean() for term in zip(*terms, strict=True))
        return proposals, {"objectness": objectness, "proposal_box": box}

    def anchors(self, pyramid: list[Tensor], frame: Frame) -> Float[Tensor, "n 4"]:
        """Return the anchors of all levels, in the order of the head's outputs."""
        found = []
        for level, shapes in zip(pyramid, self.config.anchors, strict=True):
            rows, columns = level.shape[-2:]
            half = level.new_tensor(shapes, dtype=torch.float32) / 2
            base = torch.cat((-half, half), -1).round()
            v = torch.arange(rows, device=level.device) * (frame.height // rows)
            u = torch.arange(columns, device=level.device) * (frame.width // columns)
            grid_v, grid_u = torch.meshgrid(v, u, indexing="ij")
            centre = torch.stack((grid_u, grid_v, grid_u, grid_v), -1).reshape(-1, 1, 4)
            found.append((centre + base).reshape(-1, 4))
        return torch.cat(found)

    def _best(
        self,
        logits: Sequence[Tensor],
        shifts: Sequence[Tensor],
        anchors: Sequence[Tensor],
        frame: Frame,
    ) -> Float[Tensor, "m 4"]:
        """Return the best proposals of all levels, whose outputs come one by one."""
        phase = 0 if self.training else 1
        boxes, scores = [], []
        for logit, shift, anchor in zip(logits, shifts, anchors, strict=True):
            score, index = logit.topk(min(self.config.candidates[phase], len(logit)))
            box = within_picture(self.coder.decode(shift[index], anchor[index]), frame)
            solid = ((box[:, 2:] - box[:, :2]) > _LEAST_SIDE).all(-1)
            box, score = box[solid], score[solid]
            kept = suppress(box, score, None, _SUPPRESS_ABOVE, frame.period)
            boxes.append(box[kept])
            scores.append(score[kept])
        score = torch.cat(scores)
        most = min(self.config.proposals[phase], len(score))
        return torch.cat(boxes)[score.topk(most).indices]

    def _losses(
        self,
        logits: Float[Tensor, " n"],
        shifts: Float[Tensor, "n 4"],
        anchors: Float[Tensor, "n 4"],
        targets: DetectorTargets,
        period: float | None,
    ) -> tuple[Tensor, Tensor]:
        own = self.config.per_category
        above = _OBJECT_ABOVE if own else _COMPACT_OBJECT_ABOVE
        match, label = match_boxes(
            anchors, targets, period, above, _NOTHING_BELOW, best_for_each=True
        )
        generator = torch.Generator().manual_seed(targets.seed)
        count = self.config.anchor_samples
        positive, negative = choose(label, count, 0.5, generator)
        chosen = torch.cat((positive, negative))
        wanted = torch.cat((torch.ones_like(positive), torch.zeros_like(negative))).float()
        objectness = F.binary_cross_entropy_with_logits(
            logits[chosen], wanted, reduction="sum"
        ) / max(len(chosen), 1)
        if not len(positive):
            return objectness, shifts.sum() * 0
        gold = nearest_turn(targets.boxes[match[positive]], anchors[positive], period)
        code = self.coder.encode(gold, anchors[positive])
        box = F.smooth_l1_loss(shifts[positive], code, beta=1 / 9, reduction="sum")
        return objectness, box / len(chosen)


def match_boxes(
    boxes: Float[Tensor, "n 4"],
    targets: DetectorTargets,
    period: float | None,
    above: float,
    below: float,
    *,
    best_for_each: bool = False,
) -> tuple[Int[Tensor, " n"], Int[Tensor, " n"]]:
    """Return the index of each box's object, and 1 for an object, 0 for nothing, -1 for neither.

    Args:
        boxes: Anchors or proposals.
        targets: Of the picture.
        period: Of the cylinder.
        above: Least overlap with an object.
        below: Largest overlap that still is nothing; between the two, boxes do not count.
        best_for_each: Whether the best boxes of an object count as it, however poor.
    """
    nothing = torch.zeros(len(boxes), dtype=torch.long, device=boxes.device)
    if len(targets.boxes):
        overlap = box_overlaps(targets.boxes, boxes, period)[1]
        best, match = overlap.max(0)
        label = torch.where(best >= above, 1, torch.where(best < below, 0, -1))
        if best_for_each:
            highest = overlap.max(1, keepdim=True).values
            label[((overlap >= highest - 1e-6) & (highest > 1e-3)).any(0)] = 1
    else:
        match, label = nothing, nothing.clone()
    if len(targets.ignored):
        label = torch.where((label == 0) & _is_ignored(boxes, targets, period), -1, label)
    return match, label


def choose(
    label: Int[Tensor, " n"], count: int, positive_share: float, generator: torch.Generator
) -> tuple[Int[Tensor, " positive"], Int[Tensor, " negative"]]:
    """Return random positives, a share of count at most, and negatives to make up count."""
    found = []
    left = int(count * positive_share)
    for value in (1, 0):
        index = (label == value).nonzero()[:, 0]
        order = torch.randperm(len(index), generator=generator)[:left].to(index.device)
        found.append(index[order])
        left = count - len(found[0])
    return found[0], found[1]


def _is_ignored(
    boxes: Float[Tensor, "n 4"], targets: DetectorTargets, period: float | None
) -> Bool[Tensor, " n"]:
    shared = box_overlaps(boxes, targets.ignored, period)[0]
    area = ((boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])).clamp_min(1e-6)
    return (shared > _IGNORE_SHARE * area[:, None]).any(-1)
