"""Reading regions and coding boxes, against torchvision."""

import pytest
import torch
from torch import Tensor
from torchvision.models.detection._utils import BoxCoder as TheirCoder
from torchvision.ops import FeaturePyramidNetwork, roi_align

from panoscene.models.detector._box_codes import BoxCoder
from panoscene.models.detector._pyramid import TopDown
from panoscene.models.detector._regions import read_regions

ROWS, COLUMNS = 64, 128


def _pyramid(generator: torch.Generator, batch: int = 2) -> list[Tensor]:
    shapes = [(batch, 5, ROWS // stride, COLUMNS // stride) for stride in (4, 8, 16, 32)]
    return [torch.rand(shape, generator=generator) for shape in shapes]


def _boxes(count: int, generator: torch.Generator, most: int = COLUMNS) -> Tensor:
    start = torch.rand(count, 2, generator=generator) * torch.tensor([most, ROWS]) * 0.8
    side = torch.rand(count, 2, generator=generator) ** 2 * torch.tensor([most, ROWS])
    end = torch.minimum(start + 4 + side, torch.tensor([float(most), ROWS]))
    return torch.cat((start, end), -1)


def _levels(boxes: Tensor, canonical_size: float) -> Tensor:
    side = ((boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])).sqrt()
    return (2 + (side / canonical_size).log2()).floor().clamp(0, 3)


@pytest.mark.parametrize("cells", [7, 14])
def test_regions_are_read_as_torchvision_reads_them(cells: int) -> None:
    generator = torch.Generator().manual_seed(0)
    pyramid = [level.requires_grad_() for level in _pyramid(generator)]
    boxes = [_boxes(40, generator), _boxes(25, generator)]
    # torchvision reads zeros where a box thinner than a pixel of its level goes beyond the picture
    for one in boxes:
        one[:, 1] = one[:, 1].clamp_max(ROWS - 32)
        one[:, 3] = one[:, 3].maximum(one[:, 1] + 8)
    read = read_regions(pyramid, boxes, cells, None, 24.0)
    assert read.shape == (65, 5, cells, cells)
    level = _levels(torch.cat(boxes), 24.0)
    assert level.unique().tolist() == [0, 1, 2, 3]
    picture = torch.arange(2.0).repeat_interleave(torch.tensor([40, 25]))[:, None]
    regions = torch.cat((picture, torch.cat(boxes)), -1)
    expected = torch.stack(
        [
            roi_align(pyramid[int(k)], region[None], cells, 0.25 / 2 ** int(k), 2)[0]
            for k, region in zip(level, regions, strict=True)
        ]
    )
    torch.testing.assert_close(read, expected)
    weight = torch.rand(read.shape, generator=generator)
    for ours, theirs in zip(
        torch.autograd.grad((read * weight).sum(), pyramid, retain_graph=True),
        torch.autograd.grad((expected * weight).sum(), pyramid),
        strict=True,
    ):
        torch.testing.assert_close(ours, theirs, atol=1e-4, rtol=1e-4)


def test_regions_go_on_at_the_left_edge() -> None:
    generator = torch.Generator().manual_seed(1)
    pyramid = _pyramid(generator, batch=1)
    wide = [torch.cat((level, level), -1) for level in pyramid]
    boxes = _boxes(60, generator)
    boxes[:, ::2] += 60
    assert (boxes[:, 2] > COLUMNS).any()
    read = read_regions(pyramid, [boxes], 7, float(COLUMNS), 24.0)
    torch.testing.assert_close(read, read_regions(wide, [boxes], 7, None, 24.0))


def test_no_regions_are_no_features() -> None:
    pyramid = _pyramid(torch.Generator().manual_seed(2))
    none = torch.zeros(0, 4)
    assert read_regions(pyramid, [none, none], 7, None, 24.0).shape == (0, 5, 7, 7)


@pytest.mark.parametrize("factors", [(1.0, 1.0), (10.0, 5.0)])
def test_codes_are_those_of_torchvision(factors: tuple[float, float]) -> None:
    generator = torch.Generator().manual_seed(3)
    boxes, reference = _boxes(50, generator), _boxes(50, generator)
    shift, growth = factors
    ours, theirs = BoxCoder(shift, growth), TheirCoder((shift, shift, growth, growth))
    codes = ours.encode(boxes, reference)
    torch.testing.assert_close(codes, theirs.encode_single(boxes, reference))
    torch.testing.assert_close(ours.decode(codes, reference), boxes, atol=1e-3, rtol=1e-4)
    wild = 40 * torch.randn(50, 4, generator=generator)
    torch.testing.assert_close(ours.decode(wild, reference), theirs.decode_single(wild, reference))


def test_the_pyramid_is_that_of_torchvision() -> None:
    generator = torch.Generator().manual_seed(4)
    channels = [3, 4, 5, 6]
    ours, theirs = TopDown(channels, 8), FeaturePyramidNetwork(channels, 8)
    ours.load_state_dict(theirs.state_dict())
    maps = [
        torch.rand(1, c, 32 // 2**k, 64 // 2**k, generator=generator)
        for k, c in enumerate(channels)
    ]
    expected = theirs({str(k): level for k, level in enumerate(maps)}).values()
    for one, other in zip(ours(maps), expected, strict=True):
        torch.testing.assert_close(one, other)
