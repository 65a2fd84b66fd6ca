"""The numbers that the paper prints, as data, for the rows that stand beside ours.

Per cent and units are as printed. The areas are those of the authors' evaluation
(``released_average_precision``: recall over detections, mean over detected classes), so they may
be compared with that column alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from panoscene.scene import COMMON_11, PANOCONTEXT_12

PAPER_METHODS: tuple[str, ...] = (
    "Total3D-Pers", "Total3D-Pano", "Im3D-Pers", "Im3D-Pano", "Ours w/o RO", "Ours Full",
)  # fmt: skip
"""The methods of the paper's tables; "Ours" are the authors', RO is relation optimisation."""

_COMMON_ROWS = (
    (13.71, 68.06, 30.55, 36.02, 69.84, 11.88, 12.57, 35.56, 19.19, 64.29, 41.36),
    (20.84, 69.65, 31.79, 43.13, 68.42, 10.27, 16.42, 34.42, 20.83, 62.38, 33.78),
    (30.23, 75.23, 44.16, 52.56, 76.46, 14.91, 9.99, 45.51, 23.37, 80.11, 53.28),
    (33.08, 72.15, 37.43, 70.45, 75.20, 11.58, 6.06, 43.28, 18.99, 78.46, 41.02),
    (33.57, 75.18, 38.65, 71.97, 80.66, 19.94, 18.29, 50.67, 29.05, 79.42, 60.07),
    (27.78, 73.96, 46.85, 74.22, 75.29, 21.43, 20.69, 52.03, 50.39, 77.09, 59.91),
)
PAPER_AP_COMMON: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        method: MappingProxyType(dict(zip(COMMON_11, row, strict=True)))
        for method, row in zip(PAPER_METHODS, _COMMON_ROWS, strict=True)
    }
)
"""AP at IoU 0.15 of each method and common category, per cent. Source: paper, detection table."""

PAPER_MAP_COMMON: Mapping[str, float] = MappingProxyType(
    dict(zip(PAPER_METHODS, (36.64, 37.45, 45.98, 44.34, 50.68, 52.69), strict=True))
)
"""Mean over the 11 common categories, per cent. Source: paper, detection table."""

PAPER_MAP_57: Mapping[str, float] = MappingProxyType(
    dict(zip(PAPER_METHODS, (25.11, 25.79, 29.86, 27.25, 30.91, 33.59), strict=True))
)
"""Mean over "57 categories", per cent; in truth over the 42 that the supplement lists."""

PAPER_AP_FULL: Mapping[str, float] = MappingProxyType(
    {
        **PAPER_AP_COMMON["Ours Full"],
        "window": 9.56,
        "carpet": 0.65,
        "picture": 0.21,
        "oven": 34.50,
        "bottom_cabinet_no_top": 44.17,
        "counter": 1.25,
        "dishwasher": 63.19,
        "shelf": 22.65,
        "coffee_table": 50.69,
        "mirror": 6.12,
        "toilet": 90.00,
        "wall_mounted_tv": 0.14,
        "table_lamp": 2.79,
        "bathtub": 41.02,
        "plant": 16.46,
        "washer": 36.50,
        "stool": 29.09,
        "trash_can": 66.23,
        "stove": 44.44,
        "bed": 71.57,
        "shower": 100.0,
        "piano": 100.0,
        **dict.fromkeys(
            (
                "loudspeaker", "console_table", "fence", "chest", "standing_tv", "speaker_system",
                "treadmill", "office_chair", "towel_rack",
            ),
            0.0,
        ),
    }
)  # fmt: skip
"""AP at IoU 0.15 of "Ours Full" for all 42 printed categories, per cent. Source: supplement."""


@dataclass(frozen=True, slots=True)
class PaperCollisions:
    """Physical violations per scene, as the paper counts them."""

    pairs: float
    """Colliding pairs of objects."""
    with_object: float
    """Objects that collide with another object."""
    with_ceiling: float
    """Objects that reach through the ceiling."""
    with_floor: float
    """Objects that reach through the floor."""
    with_wall: float
    """Objects that collide with a wall."""


PAPER_COLLISIONS: Mapping[str, PaperCollisions] = MappingProxyType(
    {
        "Total3D-Pers": PaperCollisions(3.45, 4.96, 0.09, 2.70, 2.68),
        "Total3D-Pano": PaperCollisions(3.41, 4.87, 0.14, 2.81, 2.66),
        "Im3D-Pers": PaperCollisions(3.16, 4.54, 0.03, 1.79, 2.42),
        "Im3D-Pano": PaperCollisions(2.62, 3.98, 0.02, 2.36, 2.26),
        "Ours w/o RO": PaperCollisions(2.68, 4.08, 0.01, 1.76, 2.23),
        "Ours Full": PaperCollisions(0.86, 1.50, 0.04, 0.45, 1.33),
    }
)
"""Physical violations of each method. Source: paper, table of physical violation."""


@dataclass(frozen=True, slots=True)
class PaperAblation:
    """A row of the paper's ablation; ``None`` where the table has no number."""

    map_57: float
    """Mean AP over "57 categories", per cent."""
    pairs: float
    """Colliding pairs of objects per scene."""
    touching_f1: float | None = None
    """F1 of attachment between objects."""
    touching_wall_f1: float | None = None
    """F1 of attachment to walls."""
    relative_yaw_deg: float | None = None
    """Mean absolute error of the rotation between objects, degrees."""
    relative_yaw_wall_deg: float | None = None
    """Mean absolute error of the rotation to walls, degrees."""


PAPER_ABLATION: Mapping[str, PaperAblation] = MappingProxyType(
    {
        "w/o Fr": PaperAblation(33.22, 0.74, 0.30, 0.71, 64.21, 52.03),
        "w/o Fo": PaperAblation(33.32, 0.83, 0.46, 0.74, 62.83, 43.46),
        "Full": PaperAblation(33.59, 0.86, 0.47, 0.76, 62.97, 43.72),
        "w/o RO": PaperAblation(30.91, 2.68),
        "w/o E_c": PaperAblation(30.42, 2.05),
        "w/o E_r": PaperAblation(29.88, 0.46),
        "w/o E_o": PaperAblation(25.30, 0.09),
    }
)
"""Source: paper, ablation table. Fr are relation features, Fo object features, E the energies."""

PAPER_FOV_MAP_57: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "Ours w/o RO": (30.91, 27.4, 24.77, 25.90, 26.16, 25.51),
        "Ours Full": (33.92, 26.09, 24.34, 23.01, 21.72, 18.52),
    }
)
"""Mean AP over "57 categories" at each of ``FOV_DEG``, per cent.

"Ours Full" at 360 degrees is 33.92 here and 33.59 in the paper's other tables.
"""

PAPER_RO_ON_OTHERS: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = (
    MappingProxyType(
        {
            "Total3D-Pano": ((25.79, 3.41), (32.46, 0.89)),
            "Im3D-Pano": ((27.25, 2.62), (33.54, 0.90)),
        }
    )
)
"""Mean AP over "57 categories" (per cent) and colliding pairs per scene, before and after relation
optimisation of the boxes of other methods."""

_SEMANTIC_ROWS = {
    "PanoContext": (
        86.90, 78.58, 38.70, 35.58, 38.15, 29.55, 27.44, 34.81, 19.40, 9.61, 11.10, 5.46,
    ),
    "Ours Full": (
        87.48, 62.99, 56.33, 65.36, 40.48, 52.86, 53.50, 46.88, 49.70, 34.21, 48.59, 10.36,
    ),
}  # fmt: skip
PAPER_SEMANTIC_IOU: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        method: MappingProxyType(dict(zip(PANOCONTEXT_12, row, strict=True)))
        for method, row in _SEMANTIC_ROWS.items()
    }
)
"""Semantic IoU on the PanoContext photos for each label, per cent. Source: paper."""

PAPER_SEMANTIC_MIOU: Mapping[str, float] = MappingProxyType(
    {"PanoContext": 31.38, "Ours Full": 50.73}
)
"""Mean semantic IoU as printed, per cent; the printed row of PanoContext averages 34.61."""

PAPER_STRUCTURED3D_MAP: Mapping[str, float] = MappingProxyType(
    {"Total3D": 30.52, "Im3D": 33.78, "Ours w/o RO": 37.55, "Ours Full": 40.21}
)
"""Mean AP over 17 categories on Structured3D, per cent. Source: supplement."""

PAPER_SECONDS: Mapping[str, float] = MappingProxyType(
    {
        "initial estimation": 0.66,
        "MGN": 0.23,
        "LIEN+LDIF": 5.92,
        "Scene GCN": 0.03,
        "RGCN": 0.06,
        "RO": 4.74,
    }
)
"""Seconds per scene of each stage on one GTX 1080 Ti. Source: supplement, table of timings."""

PAPER_TOTAL_SECONDS: Mapping[str, float] = MappingProxyType(
    {"Total3D": 0.89, "Im3D": 6.62, "Ours": 11.38}
)
"""Seconds per scene of each method on one GTX 1080 Ti."""
