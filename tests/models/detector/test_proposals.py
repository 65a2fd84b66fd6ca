"""Which anchors and proposals teach what."""

import torch

from panoscene.models.detector import CONFIGS, DetectorTargets
from panoscene.models.detector._boxes import Frame
from panoscene.models.detector._proposals import ProposalNetwork, choose, match_boxes


def _targets() -> DetectorTargets:
    return DetectorTargets(
        torch.tensor([[90.0, 10.0, 110.0, 30.0]]),
        torch.tensor([4]),
        torch.tensor([1], dtype=torch.int32),
        torch.zeros(40, 100, dtype=torch.int32),
        torch.tensor([[40.0, 0.0, 60.0, 20.0]]),
    )


def test_boxes_are_matched_across_the_seam_and_ignored_ones_teach_nothing() -> None:
    boxes = torch.tensor(
        [[-10.0, 10, 10, 30], [-4.0, 10, 16, 30], [45.0, 5, 55, 15], [20.0, 0, 30, 10]]
    )
    match, label = match_boxes(boxes, _targets(), 100.0, 0.7, 0.3)
    assert label.tolist() == [1, -1, -1, 0]
    assert match[0].item() == 0
    assert match_boxes(boxes, _targets(), None, 0.7, 0.3)[1].tolist() == [0, 0, -1, 0]


def test_the_best_box_of_an_object_counts_however_poor() -> None:
    boxes = torch.tensor([[85.0, 5.0, 95.0, 15.0], [20.0, 0.0, 30.0, 10.0]])
    label = match_boxes(boxes, _targets(), 100.0, 0.7, 0.3, best_for_each=True)[1]
    assert label.tolist() == [1, 0]


def test_choices_keep_to_their_shares() -> None:
    label = torch.tensor([1] * 30 + [0] * 50 + [-1] * 20)
    positive, negative = choose(label, 20, 0.25, torch.Generator().manual_seed(0))
    assert len(positive) == 5
    assert len(negative) == 15
    assert bool((label[positive] == 1).all())
    assert bool((label[negative] == 0).all())
    few = choose(label[29:], 20, 0.25, torch.Generator().manual_seed(0))
    assert [len(part) for part in few] == [1, 19]


def test_anchors_stand_on_every_cell() -> None:
    config = CONFIGS["compact"]
    network = ProposalNetwork(config)
    pyramid = [torch.zeros(1, 64, 64 // 2**k, 192 // 2**k) for k in range(len(config.anchors))]
    anchors = network.anchors(pyramid, Frame(256, 768, 768.0))
    shapes = len(config.anchors[0])
    assert len(anchors) == shapes * sum(level[0, 0].numel() for level in pyramid)
    size = (anchors[:shapes, 2:] - anchors[:shapes, :2]).tolist()
    wanted = [list(shape) for shape in config.anchors[0]]
    assert all(
        abs(a - b) <= 1
        for x, y in zip(size, wanted, strict=True)
        for a, b in zip(x, y, strict=True)
    )
    second = (anchors[shapes, :2] + anchors[shapes, 2:] - anchors[0, :2] - anchors[0, 2:]) / 2
    assert second.tolist() == [4.0, 0.0]
