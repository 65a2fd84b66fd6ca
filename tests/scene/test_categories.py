import pytest
import torch

from panoscene.scene import (
    CATEGORIES,
    COMMON_11,
    MEAN_SIZE,
    PANOCONTEXT_12,
    PANOCONTEXT_DETECTOR_11,
    PANOCONTEXT_LABELS,
    STRUCTURED3D_17,
    STRUCTURED3D_CATEGORIES,
    category_index,
)


def test_the_57_categories_are_alphabetical_and_unique() -> None:
    assert len(CATEGORIES) == 57
    assert list(CATEGORIES) == sorted(set(CATEGORIES))


@pytest.mark.parametrize(
    ("name", "index"),
    [("basket", 0), ("chair", 7), ("fridge", 21), ("picture", 33), ("sofa", 40), ("window", 56)],
)
def test_category_index_is_that_of_the_authors_list(name: str, index: int) -> None:
    assert category_index(name) == index


def test_mean_sizes_are_positive_and_the_unseen_ones_are_the_mean_of_the_rest() -> None:
    assert MEAN_SIZE.shape == (57, 3)
    assert MEAN_SIZE.dtype == torch.float32
    assert bool((MEAN_SIZE > 0).all())
    unseen = [category_index(name) for name in ("basket", "bench", "heater", "wall_clock")]
    seen = [index for index in range(57) if index not in unseen]
    # an oracle for the whole table: a mistyped digit anywhere would move the mean
    mean = MEAN_SIZE[seen].double().mean(dim=0)
    for index in unseen:
        torch.testing.assert_close(MEAN_SIZE[index].double(), mean, atol=6e-4, rtol=0)


def test_paper_tables_have_their_class_counts() -> None:
    assert len(set(COMMON_11)) == 11
    assert set(COMMON_11) <= set(CATEGORIES)
    assert len(set(PANOCONTEXT_12)) == 12
    assert len(set(STRUCTURED3D_17)) == 17
    assert set(STRUCTURED3D_17) <= set(CATEGORIES)
    assert len(PANOCONTEXT_DETECTOR_11) == 11
    assert set(PANOCONTEXT_DETECTOR_11.values()) <= set(CATEGORIES)


def test_every_category_has_a_panocontext_label() -> None:
    assert tuple(PANOCONTEXT_LABELS) == CATEGORIES
    assert set(PANOCONTEXT_LABELS.values()) == set(PANOCONTEXT_12)
    assert PANOCONTEXT_LABELS["crib"] == "bed"
    assert PANOCONTEXT_LABELS["pool_table"] == "desk"
    assert PANOCONTEXT_LABELS["stove"] == "background"


def test_structured3d_reaches_exactly_the_17_columns_and_carpet() -> None:
    assert set(STRUCTURED3D_CATEGORIES.values()) == {*STRUCTURED3D_17, "carpet"}
    assert STRUCTURED3D_CATEGORIES["nightstand"] == "chest"


@pytest.mark.parametrize(
    ("name", "suggestion"),
    [
        ("Sofa", "'sofa'"),
        ("sofachair", "'sofa_chair'"),
        ("coffee table", "'coffee_table'"),
        ("television", "'standing_tv'"),
        ("bedside", "'bottom_cabinet'"),
        ("zzz", "CATEGORIES"),
        ("", "CATEGORIES"),
        ("x" * 10_000, "CATEGORIES"),
    ],
)
def test_unknown_category_is_refused_with_a_suggestion(name: str, suggestion: str) -> None:
    with pytest.raises(ValueError, match="unknown category") as caught:
        category_index(name)
    assert suggestion in str(caught.value)
    assert len(str(caught.value)) < 300
