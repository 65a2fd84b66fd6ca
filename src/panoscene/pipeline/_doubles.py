"""One object, one box."""

from dataclasses import replace

from panoscene.geometry import box_nms
from panoscene.scene import CATEGORIES, Scene, select

_SAME_OBJECT = 0.1
"""IoU of boxes of one category that are the same object: no two things of one category overlap in
the training and the validation homes (``benchmarks/true_overlaps.py``)."""
_SAME_PLACE = 0.3
"""And of boxes of any categories: two things are not in one place. In those homes no two have more
than 0.11. Of the boxes that this limit leaves out there, one in four was right; that costs average
precision, which counts every further guess, and spares the scene three false objects."""


def without_doubles(scene: Scene) -> Scene:
    """Return a scene without the boxes that a box of higher score has the place of.

    A detector finds some objects twice, as two parts or as two categories, which BFoVs do not
    tell. The arrangement would push the boxes apart and leave two objects. What is left is numbered
    anew, so that names agree with the numbers in pictures.

    Args:
        scene: as estimated; names are a category and a number.
    """
    objects = scene.objects
    kept = box_nms(objects.boxes, objects.score, objects.category, iou_threshold=_SAME_OBJECT)
    again = box_nms(objects.boxes[kept], objects.score[kept], iou_threshold=_SAME_PLACE)
    kept = kept[again].sort().values
    if len(kept) == len(objects.boxes):
        return scene
    left = select(scene, kept)
    categories = enumerate(left.objects.category.tolist())
    names = tuple(f"{CATEGORIES[category]}_{k}" for k, category in categories)
    return replace(left, objects=replace(left.objects, id=names))
