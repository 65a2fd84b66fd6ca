"""What each pixel is: 57 categories, floor, wall and ceiling."""

from types import MappingProxyType

from panoscene.scene import CATEGORIES

SEMANTIC_NAMES: tuple[str, ...] = (*CATEGORIES, "floor", "wall", "ceiling")
"""Names of the 60 values of semantic.png, by value."""
UNLABELLED = 255
"""Value of semantic.png where there is none of them: decoration, and the outside."""
PART_NAME = MappingProxyType(
    {
        "wall": "wall", "skirting": "wall", "frame": "wall", "sill": "wall", "floor": "floor",
        "ceiling": "ceiling",
    }
)  # fmt: skip
"""Semantic name of the parts of a building that have one."""


def semantic_value(name: str) -> int:
    """Return the value of a category or part of the building in semantic.png, 255 for others.

    Examples:
        >>> semantic_value("bed"), semantic_value("skirting"), semantic_value("lamp")
        (2, 58, 255)
    """
    wanted = PART_NAME.get(name, name)
    return SEMANTIC_NAMES.index(wanted) if wanted in SEMANTIC_NAMES else UNLABELLED
