"""The furniture of one room while it is settled or checked."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from panoscene.synth.assets import CadModel
from panoscene.synth.homes import Home, Placed, Room

from ._contact import Intervals, Overlap, overlap
from ._engine import Body, Freedom
from ._records import Models
from ._rest import MOST_LIFT, Falls, Rest, rest
from ._shapes import CollisionShape, collision_shape
from ._solids import Solid, solid

CARPET = "carpet"
CARPET_THICKNESS = 0.01
SOFT = ("cushion",)
_BROAD = 1.2
_MET = 0.002


def freedom_of(placed: Placed, model: CadModel, on_floor: bool) -> Freedom:
    """Return how a model can move.

    What is on walls, ceilings and in openings is fixed, and so are carpets. What stands on
    something is free to tip over, unless it is soft or broad. All else slides on the floor.

    Args:
        placed: Where it is.
        model: What it is.
        on_floor: Whether it has no support but the floor or a carpet.
    """
    if placed.opening is not None or model.placement == "in_wall" or model.category == CARPET:
        return "fixed"
    if model.placement in ("wall", "ceiling") and placed.support is None:
        return "fixed"
    if on_floor and model.placement != "on_top":
        return "sliding"
    broad = max(model.size[0] * placed.scale[0], model.size[1] * placed.scale[1]) > _BROAD
    return "upright" if broad or model.category in SOFT else "free"


@dataclass(slots=True)
class Scene:
    """Models of one room by their index in the home."""

    room: Room
    placed: dict[int, Placed]
    models: dict[int, CadModel]
    solids: dict[int, Solid]
    freedom: dict[int, Freedom]
    support: dict[int, int | None]
    _known: dict[tuple[int, int], Overlap] = field(default_factory=dict)
    _falls: Falls = field(default_factory=Falls)

    def dependents(self, index: int) -> tuple[int, ...]:
        """Return what stands on a model, directly or not, lowest first."""
        found: list[int] = []
        level = [index]
        while level:
            level = [k for k in self.solids if self.support[k] in level and k not in found]
            found += level
        return tuple(found)

    def order(self) -> tuple[int, ...]:
        """Return what can move, supports before what stands on them."""

        def rank(index: int) -> tuple[int, float, int]:
            depth, at = 0, self.support[index]
            while at is not None and depth < len(self.support):
                depth, at = depth + 1, self.support.get(at)
            return depth, self.solids[index].low, index

        return tuple(sorted((k for k in self.solids if self.freedom[k] != "fixed"), key=rank))

    def put(self, index: int, body: Solid) -> None:
        """Put a model at another place."""
        if body is not self.solids.get(index):
            self.solids[index] = body
            self._known = {pair: v for pair, v in self._known.items() if index not in pair}

    def place(self, index: int, position: Float64[np.ndarray, " 3"], yaw: float) -> None:
        """Put a model at a position and yaw."""
        if yaw == self.solids[index].yaw:
            self.put(index, self.solids[index].shifted(position - self.solids[index].position))
            return
        x, y, z = (float(v) for v in position)
        at = replace(self.placed[index], position=(x, y, z), yaw=yaw)
        self.put(index, solid(self.models[index], at, self.solids[index].shape))

    def remove(self, index: int) -> None:
        """Take a model out."""
        del self.solids[index]
        self._known = {pair: v for pair, v in self._known.items() if index not in pair}

    def meets(self, first: int, second: int) -> Overlap:
        """Return how deep one model is in another; the move is that of the first."""
        pair = (first, second)
        if pair not in self._known:
            self._known[pair] = overlap(self.solids[first], self.solids[second])
        return self._known[pair]

    def rest(self, index: int, without: Collection[int], most_lift: float = MOST_LIFT) -> Rest:
        """Return where a model comes to rest when it only moves up or down.

        Args:
            index: Of the model.
            without: What it cannot rest on, besides itself.
            most_lift: Longest way up that is tried.
        """
        body = self.solids[index]
        others = {k: v for k, v in self.solids.items() if k != index and k not in without}

        def blocked(key: int, other: Solid, reach: float) -> Intervals:
            return self._falls.blocked((index, key), body, other, reach)

        return rest(body, others, most_lift=most_lift, blocked=blocked)

    def pairs(self, only: tuple[int, ...] | None = None) -> Iterator[tuple[int, int]]:
        """Return pairs of models whose bounds overlap, the lower index first.

        Args:
            only: At least one of each pair is in here; None for all pairs.
        """
        keys = sorted(self.solids)
        if len(keys) < 2:
            return
        low = np.array([self.solids[k].bounds[0] for k in keys])
        high = np.array([self.solids[k].bounds[1] for k in keys])
        shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
        for i, j in np.argwhere(np.triu((shared > _MET).all(axis=-1), 1)):
            first, second = keys[i], keys[j]
            inside = self.placed[first].opening is None or self.placed[second].opening is None
            if inside and (only is None or first in only or second in only):
                yield first, second

    def body(self, index: int) -> Body:
        """Return what the engine needs to know of a model."""
        found = self.solids[index]
        boxes = found.shape.boxes * found.scale
        return Body(boxes, found.position, found.yaw, self.freedom[index])


def scene_of(
    home: Home,
    room: int,
    models: Models,
    shapes: dict[str, CollisionShape],
    cache: Path | None,
) -> Scene:
    """Return the furniture of a room; leaves of doors that stand open are left out.

    Args:
        home: The home.
        room: Index of the room.
        models: By id.
        shapes: Collision shapes that are known, by model id; new ones are added.
        cache: Folder of the assets, or None.

    Raises:
        ValueError: A model is missing, or stands on something that is not in the home.
    """
    scene = Scene(home.rooms[room], {}, {}, {}, {}, {})
    for index, placed in enumerate(home.placed):
        if placed.room != room:
            continue
        if placed.opening is not None and home.openings[placed.opening].swing:
            continue
        model = _model(models, placed.model)
        if model.id not in shapes:
            shapes[model.id] = collision_shape(model, cache)
        support = placed.support
        if support is not None and not 0 <= support < len(home.placed):
            raise ValueError(f"home: placed {index} stands on {support}, which is not there")
        if support is not None:
            under = _model(models, home.placed[support].model)
            support = None if under.category == CARPET else support
        scene.placed[index], scene.models[index] = placed, model
        scene.solids[index] = solid(model, placed, shapes[model.id])
        scene.support[index] = support
        scene.freedom[index] = freedom_of(placed, model, support is None)
    return scene


def _model(models: Models, identifier: str) -> CadModel:
    if identifier not in models:
        raise ValueError(f"models: no model {identifier!r}, which the home contains")
    return models[identifier]
