"""Homes ready to be photographed: planned, furnished, with other models, and settled."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from panoscene.synth.assets import CadModel, ModelEntry
from panoscene.synth.homes import Home, Placed, furnish_home, sample_home
from panoscene.synth.models import vary_model
from panoscene.synth.physics import SettleReport, replace_models, settle_home
from panoscene.synth.render import world_from_placed

from ._doors import door_leaf, leaf_pose
from ._models import PARAMETRIC, Models
from ._split import Part

_REPLACED = 0.3
"""Share of the furniture that is replaced by other models of its category."""
_AJAR = 0.05
"""Radians; doors that stand open less are drawn closed, with their frame."""


@dataclass(frozen=True, slots=True)
class FurnishedHome:
    """A home whose furniture is at rest, and how it is drawn."""

    home: Home
    drawn: tuple[CadModel, ...]
    """Of each placed piece, recoloured; open doors are their leaves."""
    poses: np.ndarray
    """world_from_object of each piece, (placed, 4, 4)."""
    report: SettleReport


def furnished_home(
    seed: int, models: Models, part: Part = "seen", *, attempt: int = 0, texture_size: int = 256
) -> FurnishedHome:
    """Return the home of a seed, furnished and settled.

    Args:
        seed: Of the plan, the furniture and its looks.
        models: To furnish it with.
        part: ``unseen`` takes shapes that training homes do not have.
        attempt: Another number gives other furniture, sparser with every attempt: for homes whose
            free floor was too small to take pictures.
        texture_size: Edge of the textures of recoloured models, in pixels.

    Raises:
        ModuleNotFoundError: The optional package mujoco is missing.
    """
    rng = np.random.default_rng([seed, 3, attempt])
    entries = models.entries_of(part)
    density = None if attempt == 0 else float(np.clip(0.5 - 0.15 * attempt, 0.0, 1.0))
    home = furnish_home(sample_home(seed), models.summaries(part), rng, density)
    home = replace_models(home, entries, rng, _REPLACED)
    home = _with_leaves(home, entries)
    home, report = settle_home(home, models.plain(), cache=models.cache)
    drawn, poses = _drawn(home, models, texture_size)
    return FurnishedHome(home, drawn, poses, report)


def _with_leaves(home: Home, entries: Mapping[str, ModelEntry]) -> Home:
    """Return the home with parametric doors where doors stand open: only they come apart."""
    able = [name for name in entries if name.startswith(f"{PARAMETRIC}door/")]
    placed, openings = list(home.placed), list(home.openings)
    for index, piece in enumerate(placed):
        if piece.opening is None or not _is_open(home, piece) or not able:
            continue
        old = piece.model
        name = old if old in able else able[len(old) * 7 % len(able)]
        placed[index] = replace(piece, model=name, scale=(1.0, 1.0, 1.0))
        for k, opening in enumerate(openings):
            if opening.model == old and _same_doorway(home, k, piece.opening):
                openings[k] = replace(opening, model=name)
    return replace(home, placed=tuple(placed), openings=tuple(openings))


def _is_open(home: Home, piece: Placed) -> bool:
    if piece.opening is None:
        return False
    opening = home.openings[piece.opening]
    return opening.kind == "door" and abs(opening.swing) > _AJAR


def _same_doorway(home: Home, first: int, second: int) -> bool:
    a, b = home.openings[first], home.openings[second]
    return first == second or (
        a.room == b.leads_to and a.leads_to == b.room and abs(a.width - b.width) < 1e-9
    )


def _drawn(
    home: Home, models: Models, texture_size: int
) -> tuple[tuple[CadModel, ...], np.ndarray]:
    """Return the recoloured model and the pose of every piece; equal looks share one model."""
    looks: dict[tuple[str, int, bool], CadModel] = {}
    drawn: list[CadModel] = []
    poses = np.zeros((len(home.placed), 4, 4))
    for index, piece in enumerate(home.placed):
        leaf = _is_open(home, piece)
        key = (piece.model, piece.look, leaf)
        if key not in looks:
            looks[key] = _looking(models[piece.model], piece.look, leaf, texture_size)
        drawn.append(looks[key])
        cut = leaf and looks[key].size != models[piece.model].size
        if cut and piece.opening is not None:
            poses[index] = leaf_pose(home, home.openings[piece.opening], looks[key])
        else:
            poses[index] = world_from_placed(piece)
    return tuple(drawn), poses


def _looking(model: CadModel, look: int, leaf: bool, texture_size: int) -> CadModel:
    """Return a model in another colour, under its own id: its shape is the same."""
    if look:
        rng = np.random.default_rng([look, 5])
        varied = vary_model(model, rng, 0.0, texture_size)
        model = replace(varied, id=model.id, base=model.base)
    return (door_leaf(model) or model) if leaf else model
