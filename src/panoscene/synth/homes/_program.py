"""What rooms a home has, and how large they are."""

from dataclasses import dataclass

import numpy as np

from ._records import RoomKind


@dataclass(frozen=True, slots=True)
class RoomNeed:
    """A room that a home shall have."""

    kind: RoomKind
    area: float
    """Square metres, about."""


AREA: dict[RoomKind, tuple[float, float]] = {
    "living": (16.0, 30.0), "dining": (10.0, 17.0), "kitchen": (7.0, 14.0),
    "bedroom": (11.0, 19.0), "child": (9.0, 15.0), "bathroom": (4.0, 8.5), "hall": (4.0, 14.0),
    "office": (8.5, 14.0), "laundry": (4.0, 7.5), "hobby": (13.0, 24.0),
    "open_plan": (24.0, 44.0),
}  # fmt: skip
"""Between which areas the rooms of a kind are chosen (square metres)."""

LEAST_WIDTH: dict[RoomKind, float] = {
    "living": 3.3, "dining": 2.8, "kitchen": 2.3, "bedroom": 2.8, "child": 2.5, "bathroom": 1.75,
    "hall": 1.2, "office": 2.4, "laundry": 1.75, "hobby": 3.2, "open_plan": 3.6,
}  # fmt: skip
"""Metres between the centre lines of the walls."""

PUBLIC: tuple[RoomKind, ...] = ("open_plan", "living", "dining", "kitchen")
SMALL: tuple[RoomKind, ...] = ("bathroom", "laundry")

_ROOM_COUNT = {2: 0.08, 3: 0.12, 4: 0.16, 5: 0.22, 6: 0.20, 7: 0.13, 8: 0.09}
_SPARE: dict[RoomKind, float] = {
    "bedroom": 2.6, "child": 3.4, "office": 2.2, "dining": 2.6, "bathroom": 1.4, "laundry": 1.7,
    "hobby": 2.6,
}  # fmt: skip
_MOST: dict[RoomKind, int] = {"bedroom": 3, "child": 2, "bathroom": 2}


def sample_program(rng: np.random.Generator, rooms: int | None = None) -> list[RoomNeed]:
    """Return the rooms of a home; the first one is that from which the others are reached.

    Raises:
        ValueError: if the number of rooms is not 2 to 8.
    """
    if rooms is not None and not 2 <= rooms <= 8:
        raise ValueError(f"rooms must be 2 to 8, found {rooms}")
    count = rooms or int(rng.choice(list(_ROOM_COUNT), p=list(_ROOM_COUNT.values())))
    kinds = _kinds(rng, count)
    generous = rng.uniform(0.0, 0.6)  # a home is small or large in all its rooms
    return [
        RoomNeed(kind, float(low + (high - low) * (generous + rng.uniform(0.0, 0.4))))
        for kind in kinds
        for low, high in [AREA[kind]]
    ]


def _kinds(rng: np.random.Generator, count: int) -> list[RoomKind]:
    if count == 2:
        return ["open_plan", "bathroom"]
    if count == 3:
        other: RoomKind = "office" if rng.random() < 0.15 else "bedroom"
        return ["open_plan", "bathroom", other]
    kinds: list[RoomKind]
    if count == 4 and rng.random() < 0.55:
        kinds = ["open_plan", "bathroom", "bedroom"]
    elif count == 4 and rng.random() < 0.5:
        kinds = ["hall", "open_plan", "bathroom", "bedroom"]
    elif count == 4:
        kinds = ["hall", "living", "kitchen", "bathroom"]
    elif count <= 6 and rng.random() < 0.3:
        kinds = ["living", "kitchen", "bathroom", "bedroom"]
    elif rng.random() < 0.35:
        kinds = ["hall", "open_plan", "bathroom", "bedroom"]
    else:
        kinds = ["hall", "living", "kitchen", "bathroom", "bedroom"]
    while len(kinds) < count:
        choices: list[RoomKind] = [
            kind for kind in _SPARE
            if kinds.count(kind) < _MOST.get(kind, 1)
            and not (kind == "dining" and "open_plan" in kinds)
            and not (kind == "bathroom" and "bathroom" in kinds and count < 6)
        ]  # fmt: skip
        weight = np.array([_SPARE[kind] for kind in choices])
        kinds.append(choices[int(rng.choice(len(choices), p=weight / weight.sum()))])
    return kinds
