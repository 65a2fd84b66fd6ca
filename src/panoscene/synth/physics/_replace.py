"""Replacing models by others of their category, at the same place and in the same box."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from panoscene.synth.homes import Home, ModelSummary, Placed, is_kitchen_sink

_MOST = 0.15
_KEPT = ("", "picture")
"""Pictures that hang side by side would become the same one."""


def replace_models(
    home: Home,
    models: Mapping[str, ModelSummary],
    rng: np.random.Generator,
    share: float = 0.5,
) -> Home:
    """Return the home with random models replaced by others of the same category.

    The new model is stretched into the box of the old one, each way by at most 15 %, so that it
    still stands on what the old one stood on and its back is still at the wall. What stood on the
    old one is lifted or lowered to the new height. Equal models of a group, such as the chairs of
    a table, stay equal. What fills openings stays, and so do decoration, pictures,
    and shelves with things on their boards; kitchen sinks are replaced by kitchen sinks. Settle
    the home afterwards: what is inside of the box is new.

    Source: the random replacement of CAD models in Sec. 3.5 of the paper.

    Args:
        home: Furnished.
        models: What is known of the models of the home and of all that may be taken, by id; such
            as the ``entries`` of a library, or those of its training part only.
        rng: Source of randomness.
        share: Probability that a model is replaced when there is another that fits.

    Raises:
        ValueError: ``share`` is no probability, or a model of the home is not in ``models``.
    """
    if not 0.0 <= share <= 1.0:
        raise ValueError(f"share: found {share}, expected a probability")
    missing = sorted({piece.model for piece in home.placed} - set(models))
    if missing:
        raise ValueError(f"models: nothing known of {missing[0]!r}, which the home contains")
    choices: dict[str, list[str]] = {}
    for identifier in sorted(models):
        choices.setdefault(models[identifier].category, []).append(identifier)
    placed = list(home.placed)
    lifts = np.zeros(len(placed))
    carriers = {piece.support for piece in placed}
    for members in _groups(home.placed):
        category = models[placed[members[0]].model].category
        carries = any(index in carriers for index in members)
        kept = category in _KEPT or (category == "shelf" and carries)
        if kept or placed[members[0]].opening is not None or rng.random() >= share:
            continue
        pieces = [placed[index] for index in members]
        fitting = [name for name in choices[category] if _fits(models, name, pieces, carries)]
        if not fitting:
            continue
        name = fitting[int(rng.integers(len(fitting)))]
        for index in members:
            new = _in_its_box(models, placed[index], name)
            lifts[index] = _board(models, new) - _board(models, placed[index])
            placed[index] = new
    return replace(home, placed=tuple(_lifted(placed, lifts)))


def _groups(placed: Sequence[Placed]) -> list[list[int]]:
    """Return indices of equal models of one group; all others alone."""
    found: dict[tuple[object, ...], list[int]] = {}
    for index, piece in enumerate(placed):
        alone = piece.group < 0 or piece.opening is not None
        key = (index,) if alone else (piece.room, piece.group, piece.model)
        found.setdefault(key, []).append(index)
    return list(found.values())


def _fits(
    models: Mapping[str, ModelSummary], name: str, pieces: Sequence[Placed], carries: bool
) -> bool:
    new, old = models[name], models[pieces[0].model]
    same = name == pieces[0].model or new.placement != old.placement
    same = same or is_kitchen_sink(new) != is_kitchen_sink(old)
    if same or (new.has_front and not old.has_front) or (carries and new.support_height is None):
        return False
    scales = np.array([_scale(models, piece, name) for piece in pieces])
    return bool((np.abs(scales - 1.0) <= _MOST).all())


def _scale(
    models: Mapping[str, ModelSummary], piece: Placed, name: str
) -> tuple[float, float, float]:
    """Return the scale that stretches a model into the box of a piece; flat sides stay flat."""
    box = np.array(models[piece.model].size) * piece.scale
    size = np.array(models[name].size)
    flat = (box < 1e-4) & (size < 1e-4)
    x, y, z = np.where(flat, 1.0, box / np.maximum(size, 1e-9)).tolist()
    return x, y, z


def _in_its_box(models: Mapping[str, ModelSummary], piece: Placed, name: str) -> Placed:
    return replace(piece, model=name, scale=_scale(models, piece, name))


def _board(models: Mapping[str, ModelSummary], piece: Placed) -> float:
    """Return the height above its lower edge at which things stand on a piece."""
    height = models[piece.model].support_height
    return 0.0 if height is None else height * piece.scale[2]


def _lifted(placed: Sequence[Placed], lifts: np.ndarray) -> list[Placed]:
    """Return pieces moved up with what they stand on, however many stand on one another."""
    found: list[Placed] = []
    for piece in placed:
        lift, at, steps = 0.0, piece.support, 0
        while at is not None and steps <= len(placed):
            lift += float(lifts[at])
            at, steps = placed[at].support, steps + 1
        x, y, z = piece.position
        found.append(replace(piece, position=(x, y, z + lift)))
    return found
