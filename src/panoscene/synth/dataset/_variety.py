"""Whether homes differ: no statistic may be the same in all of them."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

from panoscene.scene import SceneFormatError

from ._errors import DatasetError
from ._read import SynthDataset
from ._statistics import Tally

FEWEST = 10
"""Homes; fewer may agree in something by chance."""
_CAMERAS = ("camera_height", "tilt_deg")
"""Statistics that a recipe may fix."""
_OF_SETS = ("splits", "homes_in_splits", "bases_only_in_test_unseen")
"""Statistics that say nothing of a single home."""
_MAY_AGREE = ("under_ceiling", "on_floor_share", "inside_room_share", "mesh_contact_share")
"""Relations that few objects have, and shares that may be one in every home."""


def variety_problems(dataset: SynthDataset) -> list[str]:
    """Return the statistics that all homes of a set have in common; none for a few homes.

    Homes whose files cannot be read are left out: other checks tell of them.
    """
    tallies: dict[str, Tally] = {}
    for item in dataset:
        try:
            scene, labels = item.scene(), item.labels()
        except (DatasetError, SceneFormatError):
            continue
        tallies.setdefault(item.home, Tally()).add(scene, labels, item.split)
    if len(tallies) < FEWEST:
        return []
    recipe = dataset.info.recipe
    fixed = _CAMERAS if not (recipe.varied_cameras and recipe.homes.train) else ()
    same = same_statistics([tally.result() for tally in tallies.values()])
    return [f"{name} is the same in all {len(tallies)} homes" for name in same if name not in fixed]


def same_statistics(homes: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names of the statistics that are the same in all homes.

    Args:
        homes: What ``dataset_statistics`` counts, of each home.

    Examples:
        >>> same_statistics([{"objects": 3, "lights": {"dusk": 1}}, {"objects": 4, "lights": {}}])
        []
        >>> same_statistics([{"objects": 3}, {"objects": 3}])
        ['objects']
    """
    told = [dict(_told(home)) for home in homes]
    names = dict.fromkeys(chain.from_iterable(told))
    return [name for name in names if all(one.get(name) == told[0].get(name) for one in told)]


def _told(home: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
    """Return what a home is compared by; each relation is a statistic of its own."""
    for name, value in home.items():
        if name == "relations":
            for relation, count in value.items():
                if relation not in _MAY_AGREE:
                    yield relation, count
        elif name not in _OF_SETS:
            yield name, value
