"""Colours: every category has one, and the groups stay apart for colour-blind readers."""

import itertools

import numpy as np
import pytest

from panoscene.scene import CATEGORIES
from panoscene.style import FLOOR, GROUP_COLOURS, GROUPS, INK, OPAQUE, group_of, label_fill, words

# Full colour-vision deficiencies in linear RGB (Machado, Oliveira, Fernandes 2009).
VISION = {
    "full": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear(colour: str) -> np.ndarray:
    value = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    x, y, z = np.cbrt(np.maximum(XYZ @ rgb.clip(0, 1) / [0.9505, 1.0, 1.089], 0.008856))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_every_category_has_one_group_and_colour() -> None:
    members = [category for group in GROUPS.values() for category in group]
    assert sorted(members) == list(CATEGORIES)
    assert set(GROUPS) == set(GROUP_COLOURS)
    assert all(group_of(category) in GROUP_COLOURS for category in CATEGORIES)
    assert len({words(category) for category in CATEGORIES}) == len(CATEGORIES)


@pytest.mark.parametrize("vision", VISION)
def test_groups_stay_apart(vision: str) -> None:
    seen = {name: lab(VISION[vision] @ linear(c)) for name, c in GROUP_COLOURS.items()}
    differences = {
        pair: float(np.linalg.norm(seen[pair[0]] - seen[pair[1]]))
        for pair in itertools.combinations(seen, 2)
    }
    assert min(differences.values()) > 12.0, min(differences, key=differences.__getitem__)


def test_text_is_readable_on_every_fill() -> None:
    ink = XYZ[1] @ linear(INK)
    for colour in GROUP_COLOURS.values():
        fill = XYZ[1] @ (OPAQUE * linear(colour) + (1 - OPAQUE) * linear(FLOOR))
        assert (fill + 0.05) / (ink + 0.05) > 4.5, "contrast of WCAG level AA"


def test_text_is_readable_on_every_label() -> None:
    ink = XYZ[1] @ linear(INK)
    for colour in (*GROUP_COLOURS.values(), "#202020"):
        assert (XYZ[1] @ linear(label_fill(colour)) + 0.05) / (ink + 0.05) > 4.5
    assert label_fill(GROUP_COLOURS["tables"]) == GROUP_COLOURS["tables"]
