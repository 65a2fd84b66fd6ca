"""Pasted objects: they are whole, labelled, and hide what is behind them."""

from collections import Counter
from pathlib import Path

import pytest
import torch

from panoscene.data._detector_pasting import (
    Pasting,
    donors_by_category,
    draw_donor,
    draw_pasted,
    still_visible,
)
from panoscene.data._detector_samples import DetectorAugmentation, DetectorSamples
from panoscene.models.detector import CONFIGS, DetectorTargets
from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import PanoramaItem, open_dataset

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
SMALL = CONFIGS["compact"].model_copy(update={"width": 256, "first_row": 0, "rows": 128})


@pytest.fixture(scope="module")
def items() -> tuple[PanoramaItem, ...]:
    return tuple(open_dataset(SAMPLES, "train")[:])


def _sample(items: tuple[PanoramaItem, ...], seed: int, pasting: Pasting | None) -> DetectorTargets:
    settings = DetectorAugmentation(mirror=0, roll=False, tilted=0, photometric=None)
    settings = settings.model_copy(update={"pasting": pasting})
    generator = torch.Generator().manual_seed(seed)
    targets = DetectorSamples(items, SMALL).augmented(0, generator, settings).targets
    assert isinstance(targets, DetectorTargets)
    return targets


def test_pasted_objects_are_labelled_and_seen(items: tuple[PanoramaItem, ...]) -> None:
    plain = _sample(items, 3, None)
    more = _sample(items, 3, Pasting(share=1.0, others=1.0))
    new = more.instance[~torch.isin(more.instance, plain.instance)]
    assert len(new)
    for k in (more.instance[:, None] == new).any(1).nonzero()[:, 0].tolist():
        mask = more.instances == more.instance[k]
        rows, columns = mask.any(1).nonzero()[:, 0], mask.any(0).nonzero()[:, 0]
        left, top, right, bottom = more.boxes[k].tolist()
        assert (top, bottom) == (int(rows.min()), int(rows.max()) + 1)
        assert left % 256 in columns.tolist()
        assert (right - 1) % 256 in columns.tolist()


def test_the_same_number_gives_the_same_sample(items: tuple[PanoramaItem, ...]) -> None:
    first, second = (_sample(items, 5, Pasting(share=1.0)) for _ in range(2))
    assert torch.equal(first.instances, second.instances)
    assert torch.equal(first.boxes, second.boxes)


def test_a_share_of_zero_pastes_nothing(items: tuple[PanoramaItem, ...]) -> None:
    assert torch.equal(
        _sample(items, 5, Pasting(share=0.0)).instances, _sample(items, 5, None).instances
    )


def test_rare_categories_are_drawn_as_often_as_others(items: tuple[PanoramaItem, ...]) -> None:
    donors = donors_by_category(items, 0.2)
    assert donors
    for category, where in donors.items():
        for index in where:
            shown = [x for x in items[index].labels().objects if x.in_scene and x.occlusion <= 0.2]
            assert CATEGORIES[category] in {x.category for x in shown}
    generator = torch.Generator().manual_seed(0)
    drawn = [draw_donor(donors, generator) for _ in range(100 * len(donors))]
    counts = Counter(found[0] for found in drawn if found is not None)
    assert set(counts) == set(donors)
    assert min(counts.values()) > 60
    assert draw_donor({}, generator) is None


def test_hidden_objects_are_never_chosen() -> None:
    generator = torch.Generator().manual_seed(0)
    category = torch.tensor([4, 4, 7, 9])
    whole = torch.tensor([True, False, False, True])
    assert draw_pasted(category, whole, 4, 0.0, generator).tolist() == [True, False, False, False]
    assert draw_pasted(category, whole, 4, 1.0, generator).tolist() == [True, False, False, True]


def test_objects_behind_pasted_ones_need_not_be_found() -> None:
    before = torch.tensor([[1, 1, 1, 1, 2, 2, 2, 2, 2, 2]])
    after = torch.tensor([[1, 1, 9, 9, 9, 9, 9, 9, 2, 2]])
    seen = still_visible(before, after, torch.tensor([1, 2, 5]))
    assert seen.tolist() == [True, False, True]
