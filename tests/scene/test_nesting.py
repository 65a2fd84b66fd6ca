"""Which things may lie in the boxes of others."""

import torch

from panoscene.scene import CATEGORIES, category_index, nested


def pair(*names: str) -> bool:
    return bool(nested(torch.tensor([category_index(name) for name in names]))[0, 1])


def test_what_lies_in_what() -> None:
    for outer in ("bed", "sofa", "sofa_chair"):
        assert pair("cushion", outer)
    for inner in ("loudspeaker", "plant", "speaker_system"):
        assert pair("shelf", inner)
    assert not pair("cushion", "shelf")
    assert not pair("plant", "sofa")
    assert not pair("sofa", "coffee_table")


def test_it_goes_both_ways_and_nothing_lies_in_its_like() -> None:
    found = nested(torch.arange(len(CATEGORIES)))
    assert torch.equal(found, found.T)
    assert not found.diagonal().any()
    assert int(found.sum()) == 12


def test_scenes_are_looked_up_together() -> None:
    category = torch.randint(len(CATEGORIES), (3, 5), generator=torch.Generator().manual_seed(1))
    found = nested(category)
    assert found.shape == (3, 5, 5)
    assert all(torch.equal(nested(row), part) for row, part in zip(category, found, strict=True))
