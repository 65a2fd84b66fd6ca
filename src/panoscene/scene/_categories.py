"""The 57 object categories, their mean sizes, and the class maps of the paper's tables."""

import difflib
from types import MappingProxyType

import torch
from jaxtyping import Float
from torch import Tensor

CATEGORIES: tuple[str, ...] = (
    "basket", "bathtub", "bed", "bench", "bottom_cabinet", "bottom_cabinet_no_top", "carpet",
    "chair", "chest", "coffee_machine", "coffee_table", "console_table", "cooktop", "counter",
    "crib", "cushion", "dishwasher", "door", "dryer", "fence", "floor_lamp", "fridge",
    "grandfather_clock", "guitar", "heater", "laptop", "loudspeaker", "microwave", "mirror",
    "monitor", "office_chair", "oven", "piano", "picture", "plant", "pool_table", "range_hood",
    "shelf", "shower", "sink", "sofa", "sofa_chair", "speaker_system", "standing_tv", "stool",
    "stove", "table", "table_lamp", "toilet", "top_cabinet", "towel_rack", "trash_can",
    "treadmill", "wall_clock", "wall_mounted_tv", "washer", "window",
)  # fmt: skip
"""Names of the 57 categories in index order, which is alphabetical."""
BUILT_IN: tuple[str, ...] = ("door", "window")
"""Categories that stand in walls, so partly behind their surface."""

_INDEX = {name: index for index, name in enumerate(CATEGORIES)}

_UNSEEN_SIZE = (0.954, 0.585, 0.799)
_SIZES = {
    "bathtub": (1.964, 1.229, 0.480),
    "bed": (1.684, 2.121, 0.902),
    "bottom_cabinet": (0.938, 0.477, 0.894),
    "bottom_cabinet_no_top": (0.662, 0.581, 0.860),
    "carpet": (2.152, 1.729, 0.008),
    "chair": (0.500, 0.486, 0.883),
    "chest": (0.839, 0.448, 0.461),
    "coffee_machine": (0.320, 0.510, 0.395),
    "coffee_table": (1.085, 0.610, 0.374),
    "console_table": (0.539, 0.303, 0.702),
    "cooktop": (0.902, 0.566, 0.066),
    "counter": (1.348, 0.726, 0.031),
    "crib": (1.350, 0.770, 1.129),
    "cushion": (0.560, 0.500, 0.297),
    "dishwasher": (0.615, 0.589, 0.720),
    "door": (1.154, 0.135, 2.053),
    "dryer": (0.780, 0.813, 1.171),
    "fence": (2.525, 0.063, 0.990),
    "floor_lamp": (0.343, 0.366, 1.541),
    "fridge": (0.903, 0.805, 1.715),
    "grandfather_clock": (0.655, 0.345, 2.079),
    "guitar": (0.442, 0.428, 1.040),
    "laptop": (0.311, 0.229, 0.010),
    "loudspeaker": (0.412, 0.149, 0.238),
    "microwave": (0.765, 0.486, 0.370),
    "mirror": (1.219, 0.170, 0.914),
    "monitor": (0.709, 0.175, 0.395),
    "office_chair": (0.468, 0.437, 0.830),
    "oven": (0.815, 0.642, 0.888),
    "piano": (1.400, 0.470, 1.188),
    "picture": (0.712, 0.020, 0.629),
    "plant": (0.374, 0.354, 0.998),
    "pool_table": (2.590, 1.330, 0.673),
    "range_hood": (1.038, 0.634, 0.346),
    "shelf": (1.365, 0.380, 1.089),
    "shower": (1.222, 1.297, 2.190),
    "sink": (0.802, 0.584, 0.946),
    "sofa": (2.297, 1.112, 0.726),
    "sofa_chair": (0.850, 0.846, 0.822),
    "speaker_system": (0.235, 0.428, 0.495),
    "standing_tv": (0.970, 0.166, 0.651),
    "stool": (0.744, 0.704, 0.437),
    "stove": (0.989, 0.671, 0.941),
    "table": (1.139, 0.662, 0.723),
    "table_lamp": (0.282, 0.267, 0.581),
    "toilet": (0.500, 0.704, 0.711),
    "top_cabinet": (0.843, 0.383, 0.725),
    "towel_rack": (0.669, 0.068, 0.038),
    "trash_can": (0.245, 0.222, 0.427),
    "treadmill": (0.860, 1.770, 1.386),
    "wall_mounted_tv": (1.097, 0.113, 0.583),
    "washer": (0.705, 0.773, 1.188),
    "window": (1.654, 0.174, 1.401),
}

MEAN_SIZE: Float[Tensor, "57 3"] = torch.tensor(
    [_SIZES.get(name, _UNSEEN_SIZE) for name in CATEGORIES]
)
"""Mean full extents (width, depth, height) of each category in metres, float32.

Source: means over the training split of the iGibson panoramas of DeepPanoContext, as shipped with
the authors' demo and listed in our fact sheet (section 1.8). The four categories without a
training example (basket, bench, heater, wall_clock) carry the mean of the other 53 means. Boxes
are coded relative to this table, so a trained network must be used with the table it was trained
with. Do not change it in place: clone it.
"""

COMMON_11: tuple[str, ...] = (
    "chair", "sofa", "table", "fridge", "sink", "door", "floor_lamp", "bottom_cabinet",
    "top_cabinet", "sofa_chair", "dryer",
)  # fmt: skip
"""The 11 common categories of the paper's detection table, in the order of its columns."""

PANOCONTEXT_12: tuple[str, ...] = (
    "background", "bed", "painting", "window", "mirror", "desk", "wardrobe", "tv", "door",
    "chair", "sofa", "cabinet",
)  # fmt: skip
"""The 12 labels of the paper's PanoContext segmentation table, in the order of its columns."""

_PANOCONTEXT_MEMBERS = {
    "bed": ("bed", "crib"),
    "painting": ("picture",),
    "window": ("window",),
    "mirror": ("mirror",),
    "desk": ("table", "coffee_table", "console_table", "pool_table"),
    "wardrobe": ("shelf",),
    "tv": ("standing_tv", "monitor", "wall_mounted_tv"),
    "door": ("door",),
    "chair": ("chair", "office_chair", "sofa_chair", "stool"),
    "sofa": ("sofa",),
    "cabinet": ("bottom_cabinet", "bottom_cabinet_no_top"),
}
_PANOCONTEXT_LABEL = {
    member: label for label, members in _PANOCONTEXT_MEMBERS.items() for member in members
}

PANOCONTEXT_LABELS = MappingProxyType(
    {name: _PANOCONTEXT_LABEL.get(name, "background") for name in CATEGORIES}
)
"""The ``PANOCONTEXT_12`` label of each of the 57 categories.

Categories that the table does not print are background. That includes ``chest``: the authors' map
sends it to a label "nightstand", which is not among the 12 that they printed.
"""

PANOCONTEXT_DETECTOR_11 = MappingProxyType(
    {
        "bed": "bed",
        "painting": "picture",
        "table": "table",
        "mirror": "mirror",
        "window": "window",
        "chair": "chair",
        "sofa": "sofa",
        "door": "door",
        "cabinet": "bottom_cabinet",
        "bedside": "bottom_cabinet",
        "tv": "standing_tv",
    }
)
"""Our category for each of the 11 classes of the detector that the paper trains on PanoContext."""

STRUCTURED3D_17: tuple[str, ...] = (
    "door", "picture", "table", "sofa", "chair", "window", "bed", "bottom_cabinet", "chest",
    "sink", "fridge", "bathtub", "shelf", "mirror", "toilet", "counter", "standing_tv",
)  # fmt: skip
"""The 17 categories of the paper's Structured3D table, in the order of its columns."""

STRUCTURED3D_CATEGORIES = MappingProxyType(
    {
        "cabinet": "bottom_cabinet",
        "bookshelf": "shelf",
        "desk": "table",
        "shelves": "shelf",
        "dresser": "bottom_cabinet",
        "floor mat": "carpet",
        "television": "standing_tv",
        "box": "chest",
        "nightstand": "chest",
        "refrigerator": "fridge",
        "bathtub": "bathtub",
        "bed": "bed",
        "chair": "chair",
        "counter": "counter",
        "door": "door",
        "mirror": "mirror",
        "picture": "picture",
        "sink": "sink",
        "sofa": "sofa",
        "table": "table",
        "toilet": "toilet",
        "window": "window",
    }
)
"""Our category for each Structured3D class that has one.

The supplement names nine renamed classes and says that the others keep their name. Its counts (20
classes to 17) do not follow from its own list: the table's 17 columns need the 13 last entries
here, and "floor mat" goes to ``carpet``, which the table does not print. All are kept; scoring
over ``STRUCTURED3D_17`` leaves ``carpet`` out.
"""


def category_index(name: str) -> int:
    """Return the index of a category in ``CATEGORIES``.

    Raises:
        ValueError: The name is not one of the 57; the message suggests the closest ones.

    Examples:
        >>> category_index("bed")
        2
    """
    index = _INDEX.get(name)
    if index is None:
        raise ValueError(f"unknown category {name[:60]!r}; {category_suggestion(name)}")
    return index


def category_suggestion(name: str) -> str:
    """Return a phrase that tells what may have been meant by an unknown category name.

    Examples:
        >>> category_suggestion("television")
        "did you mean 'standing_tv'?"
    """
    wanted = "_".join(name[:60].lower().replace("-", " ").split())
    by_detector = PANOCONTEXT_DETECTOR_11.get(wanted) or STRUCTURED3D_CATEGORIES.get(
        wanted.replace("_", " ")
    )
    close = ([by_detector] if by_detector else []) + difflib.get_close_matches(
        wanted, CATEGORIES, n=3, cutoff=0.6
    )
    parts = [category for category in CATEGORIES if category in wanted.split("_")]
    names = list(dict.fromkeys(close + parts))[:3]
    if not names:
        return f"expected one of the {len(CATEGORIES)} names in panoscene.scene.CATEGORIES"
    return f"did you mean {', '.join(repr(found) for found in names)}?"
