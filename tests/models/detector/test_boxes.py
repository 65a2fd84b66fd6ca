"""Boxes on the cylinder, against torchvision on the plane and by hand."""

import pytest
import torch
import torchvision
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.models.detector import box_overlaps
from panoscene.models.detector._boxes import Frame, nearest_turn, suppress, within_picture


def _boxes(count: int, seed: int, period: float = 100.0) -> torch.Tensor:
    generator = torch.Generator().manual_seed(seed)
    place = torch.rand(count, 2, generator=generator) * torch.tensor([period, 40.0])
    size = 1 + torch.rand(count, 2, generator=generator) * torch.tensor([period / 3, 30.0])
    return torch.cat((place, place + size), -1)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_overlap_without_period_is_torchvisions(seed: int) -> None:
    a, b = _boxes(7, seed), _boxes(5, seed + 1)
    torch.testing.assert_close(
        box_overlaps(a, b, None)[1], torchvision.ops.box_iou(a, b), atol=1e-5, rtol=1e-4
    )


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.integers(-3, 3), st.floats(0, 100))
def test_overlap_on_a_cylinder_does_not_know_where_the_seam_is(
    seed: int, turns: int, shift: float
) -> None:
    a, b = _boxes(6, seed), _boxes(4, seed + 1)
    across = torch.tensor([1.0, 0.0, 1.0, 0.0])
    moved_a, moved_b = a + shift * across, b + (shift + 100 * turns) * across
    torch.testing.assert_close(
        box_overlaps(moved_a, moved_b, 100.0)[1],
        box_overlaps(a, b, 100.0)[1],
        atol=1e-4,
        rtol=1e-3,
    )


def test_a_box_at_the_seam_meets_its_other_half() -> None:
    seam = torch.tensor([[95.0, 0.0, 105.0, 10.0]])
    half = torch.tensor([[0.0, 0.0, 5.0, 10.0]])
    assert box_overlaps(seam, half, None)[1].item() == 0
    assert box_overlaps(seam, half, 100.0)[1].item() == pytest.approx(0.5)
    assert nearest_turn(half, seam, 100.0).tolist() == [[100.0, 0.0, 105.0, 10.0]]
    assert nearest_turn(half, seam, None).tolist() == half.tolist()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.1, 0.9))
def test_suppression_without_period_is_torchvisions(seed: int, threshold: float) -> None:
    boxes = _boxes(30, seed)
    score = torch.rand(30, generator=torch.Generator().manual_seed(seed))
    kept = suppress(boxes, score, None, threshold, None)
    assert kept.tolist() == torchvision.ops.nms(boxes, score, threshold).tolist()


def test_suppression_works_across_the_seam_and_within_groups() -> None:
    boxes = torch.tensor([[96.0, 0, 104, 8], [-4.0, 0, 4, 8], [96.0, 0, 104, 8], [50.0, 0, 58, 8]])
    score = torch.tensor([0.9, 0.8, 0.7, 0.6])
    group = torch.tensor([0, 0, 1, 0])
    assert suppress(boxes, score, None, 0.5, 100.0).tolist() == [0, 3]
    assert suppress(boxes, score, None, 0.5, None).tolist() == [0, 1, 3]
    assert suppress(boxes, score, group, 0.5, 100.0).tolist() == [0, 2, 3]
    assert suppress(boxes[:0], score[:0], None, 0.5, 100.0).tolist() == []


def test_boxes_are_cut_at_edges_but_run_on_around_the_cylinder() -> None:
    boxes = torch.tensor([[-10.0, -5.0, 20.0, 30.0], [190.0, 5.0, 260.0, 60.0], [0.0, 0, 300, 9]])
    flat = within_picture(boxes, Frame(50, 200, None))
    assert flat.tolist() == [[0, 0, 20, 30], [190, 5, 200, 50], [0, 0, 200, 9]]
    around = within_picture(boxes, Frame(50, 200, 200.0))
    assert around.tolist() == [[190, 0, 220, 30], [190, 5, 260, 50], [50, 0, 250, 9]]
