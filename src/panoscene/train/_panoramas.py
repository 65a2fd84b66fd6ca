"""The panoramas that a training learns from."""

from pathlib import Path

from panoscene.synth.dataset import PanoramaItem, open_dataset

from ._errors import TrainError
from ._recipe import TrainRecipe


def training_panoramas(data: Path, recipe: TrainRecipe) -> tuple[PanoramaItem, ...]:
    """Return the panoramas of the training part that a recipe asks for.

    Panoramas of a home follow each other in a set, so the first ones are those of whole homes, but
    for the last home.

    Args:
        data: Folder of a data set.
        recipe: With ``panoramas``.

    Raises:
        TrainError: The part has fewer panoramas.
        DatasetError: The set is damaged.
    """
    part = open_dataset(data, "train")
    if recipe.panoramas is not None and recipe.panoramas > len(part):
        raise TrainError(
            "recipe",
            f"panoramas: found {recipe.panoramas}, expected at most the {len(part)} of {data}",
        )
    return part[: recipe.panoramas]
