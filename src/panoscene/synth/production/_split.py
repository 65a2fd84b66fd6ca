"""Which models homes of training and of the test of unseen shapes may have."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Literal

from panoscene.synth.assets import ModelEntry

Part = Literal["seen", "unseen"]


def entries_for(entries: Iterable[ModelEntry], part: Part) -> dict[str, ModelEntry]:
    """Return the models that homes of a part are furnished with, by id.

    ``seen`` has no model whose base is kept from training. ``unseen`` has nothing else in the
    categories that have such models; all models in the others, which have too few to keep any,
    and all decoration. Models whose category or size is doubtful are in neither.
    """
    sure = [entry for entry in entries if entry.confidence != "low"]
    if part == "seen":
        chosen = [entry for entry in sure if entry.split == "seen" or not entry.category]
        return {entry.id: entry for entry in sorted(chosen, key=lambda entry: entry.id)}
    by_category: dict[str, list[ModelEntry]] = defaultdict(list)
    for entry in sure:
        by_category[entry.category].append(entry)
    found: dict[str, ModelEntry] = {}
    for category, models in by_category.items():
        new = [entry for entry in models if entry.split == "unseen"]
        found |= {entry.id: entry for entry in (new if new and category else models)}
    return dict(sorted(found.items()))
