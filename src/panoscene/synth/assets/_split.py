"""Which shapes are never shown in training."""

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Literal, Protocol, runtime_checkable

Part = Literal["seen", "unseen"]
MIN_BASES = 5
"""Categories with fewer base models keep all of them for training."""


@runtime_checkable
class HasBase(Protocol):
    """What the split needs to know of a model."""

    @property
    def base(self) -> str:
        """The model it was made from."""
        ...

    @property
    def category(self) -> str:
        """Its category, "" for decoration."""
        ...


def split_models(
    models: Iterable[HasBase],
    seed: int = 0,
    unseen_share: float = 0.15,
    frozen: Mapping[str, Part] | None = None,
) -> dict[str, Part]:
    """Return for every base model whether it is seen in training, sorted by base.

    In every category with at least 5 bases about ``unseen_share`` of them, and at least one, are
    unseen: those whose hash with the seed is lowest. Bases with models in several categories (a
    sofa and its cushion) count in each. No category loses more than half of its bases.

    Args:
        models: All models; those made from one base share its part.
        seed: Another seed gives another split.
        unseen_share: Between 0 and 1.
        frozen: An earlier split that is kept; only new bases are divided.

    Raises:
        ValueError: ``unseen_share`` is no share.
    """
    if not 0 <= unseen_share < 1:
        raise ValueError(f"unseen_share: found {unseen_share}, expected at least 0 and below 1")
    bases: dict[str, set[str]] = defaultdict(set)
    every: set[str] = set()
    for model in models:
        every.add(model.base)
        if model.category:
            bases[model.category].add(model.base)
    kept = {base: part for base, part in (frozen or {}).items() if base in every}
    unseen = {base for base, part in kept.items() if part == "unseen"}
    if unseen_share > 0:
        for _, members in sorted(bases.items(), key=lambda item: (len(item[1]), item[0])):
            if len(members) < MIN_BASES:
                continue
            wanted = max(1, round(unseen_share * len(members)))
            order = sorted(members - kept.keys(), key=lambda base: _rank(base, seed))
            for base in order:
                if len(members & unseen) >= wanted:
                    break
                if not _robs_another(base, bases.values(), unseen):
                    unseen.add(base)
    return {base: "unseen" if base in unseen else "seen" for base in sorted(every)}


def _rank(base: str, seed: int) -> bytes:
    return hashlib.sha256(f"{seed}:{base}".encode()).digest()


def _robs_another(base: str, categories: Iterable[set[str]], unseen: set[str]) -> bool:
    """Return whether some category would keep less than half of its bases for training."""
    return any(2 * len(unseen & members | {base}) > len(members) + (len(members) < 3)
               for members in categories if base in members)  # fmt: skip
