"""The paper's printed numbers: transcribed right, and consistent as far as the paper is."""

import statistics

import numpy as np
import pytest

from panoscene.eval._average_precision import average_precision, released_average_precision
from panoscene.eval._detection import DetectionScores
from panoscene.eval._fov import FOV_DEG
from panoscene.eval._pooling import detection_values
from panoscene.eval._published import (
    PAPER_ABLATION,
    PAPER_AP_COMMON,
    PAPER_AP_FULL,
    PAPER_COLLISIONS,
    PAPER_FOV_MAP_57,
    PAPER_MAP_57,
    PAPER_MAP_COMMON,
    PAPER_METHODS,
    PAPER_RO_ON_OTHERS,
    PAPER_SECONDS,
    PAPER_SEMANTIC_IOU,
    PAPER_SEMANTIC_MIOU,
    PAPER_TOTAL_SECONDS,
)
from panoscene.scene import CATEGORIES, COMMON_11


@pytest.mark.parametrize("method", PAPER_METHODS)
def test_means_over_the_common_categories(method: str) -> None:
    row = PAPER_AP_COMMON[method]
    assert tuple(row) == COMMON_11
    assert statistics.mean(row.values()) == pytest.approx(PAPER_MAP_COMMON[method], abs=0.0051)


def test_the_mean_over_57_is_one_over_42() -> None:
    assert len(PAPER_AP_FULL) == 42
    assert set(PAPER_AP_FULL) <= set(CATEGORIES)
    assert statistics.mean(PAPER_AP_FULL.values()) == pytest.approx(33.59, abs=0.005)
    assert PAPER_MAP_57["Ours Full"] == 33.59
    # over all 57, with zero for what is never detected, it would be far lower
    assert sum(PAPER_AP_FULL.values()) / 57 == pytest.approx(24.75, abs=0.005)


def test_our_released_mean_gives_the_published_one() -> None:
    printed = np.array([PAPER_AP_FULL.get(name, np.nan) for name in CATEGORIES]) / 100
    counts = np.isfinite(printed).astype(np.float64)
    scores = DetectionScores(
        iou_thresholds=(0.15,),
        score_threshold=0.0,
        average_precision=np.full((1, len(CATEGORIES)), np.nan),
        released_average_precision=printed[None],
        targets=counts,
        detections=counts,
        kept=counts,
        hits=np.zeros((1, len(CATEGORIES))),
    )
    assert scores.mean_released_average_precision() == pytest.approx([0.3359], abs=5e-5)
    common = scores.mean_released_average_precision(COMMON_11)
    assert common == pytest.approx([PAPER_MAP_COMMON["Ours Full"] / 100], abs=5.1e-5)
    named = detection_values(scores)
    assert float(named["released_ap_15_mean_57"]) == pytest.approx(0.3359, abs=5e-5)


def test_standard_areas_differ_whenever_targets_are_missed() -> None:
    hit = np.array([True, True, False, True])
    score = np.array([0.9, 0.8, 0.7, 0.6])
    released = released_average_precision(score, hit)
    assert average_precision(score, hit, 4) == pytest.approx(released)
    for targets in (3, 5, 20):
        assert average_precision(score, hit, targets) == pytest.approx(released * 4 / targets)


def test_tables_agree_where_they_repeat_each_other() -> None:
    full, without = PAPER_ABLATION["Full"], PAPER_ABLATION["w/o RO"]
    assert full.map_57 == PAPER_MAP_57["Ours Full"]
    assert full.pairs == PAPER_COLLISIONS["Ours Full"].pairs
    assert (without.map_57, without.pairs) == (30.91, PAPER_COLLISIONS["Ours w/o RO"].pairs)
    for method, (before, _) in PAPER_RO_ON_OTHERS.items():
        assert before == (PAPER_MAP_57[method], PAPER_COLLISIONS[method].pairs)
    assert PAPER_FOV_MAP_57["Ours w/o RO"][0] == without.map_57
    # known inconsistency of the paper
    assert PAPER_FOV_MAP_57["Ours Full"][0] == 33.92 != full.map_57
    assert all(len(row) == len(FOV_DEG) for row in PAPER_FOV_MAP_57.values())
    assert set(PAPER_COLLISIONS) == set(PAPER_MAP_57) == set(PAPER_METHODS)


def test_objects_in_collisions_are_at_most_twice_the_pairs() -> None:
    for row in PAPER_COLLISIONS.values():
        assert row.with_object <= 2 * row.pairs


def test_times_add_up() -> None:
    first = PAPER_SECONDS["initial estimation"]
    shape = PAPER_SECONDS["LIEN+LDIF"]
    ours = first + shape + PAPER_SECONDS["RGCN"] + PAPER_SECONDS["RO"]
    assert ours == pytest.approx(PAPER_TOTAL_SECONDS["Ours"], abs=0.015)
    im3d = first + shape + PAPER_SECONDS["Scene GCN"]
    assert im3d == pytest.approx(PAPER_TOTAL_SECONDS["Im3D"], abs=0.015)
    assert first + PAPER_SECONDS["MGN"] == pytest.approx(PAPER_TOTAL_SECONDS["Total3D"])


def test_semantic_means() -> None:
    ours = PAPER_SEMANTIC_IOU["Ours Full"].values()
    assert statistics.mean(ours) == pytest.approx(PAPER_SEMANTIC_MIOU["Ours Full"], abs=0.005)
    # known inconsistency of the paper: 31.38 is printed
    theirs = PAPER_SEMANTIC_IOU["PanoContext"].values()
    assert statistics.mean(theirs) == pytest.approx(34.61, abs=0.005)


def test_the_tables_cannot_be_changed() -> None:
    with pytest.raises(TypeError):
        PAPER_MAP_57["Ours Full"] = 99.0  # ty: ignore[invalid-assignment]
