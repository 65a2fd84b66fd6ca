"""A room being furnished: what stands where, what is still free, and the ways to put a piece."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from panoscene.scene import CATEGORIES, MEAN_SIZE
from panoscene.synth._floor_plan import FloorPlan
from panoscene.synth._frames import place_of

NOMINAL_SIZE: dict[str, tuple[float, float, float]] = {
    **dict(zip(CATEGORIES, MEAN_SIZE.double().tolist(), strict=True)),
    "basket": (0.40, 0.35, 0.35),
    "bench": (1.20, 0.40, 0.45),
    "heater": (0.90, 0.12, 0.60),
    "wall_clock": (0.32, 0.05, 0.32),
}
"""Width, depth, height (metres) about which sizes vary: the mean sizes, except for the four
categories for which the paper's data has only a fall-back value."""

_SLACK = 1e-7
"""Metres by which shared faces may overlap through rounding."""
_TRIES = 24
"""Candidate places that are tested at once for one piece."""
_CAMERA_CLEARANCE = 0.45
"""No piece comes nearer to the camera's vertical than this (metres, along the room's axes)."""


@dataclass(frozen=True, slots=True)
class Piece:
    """One placed object, in the frame of the floor plan."""

    category: str
    centre: Float[np.ndarray, " 3"]
    size: Float[np.ndarray, " 3"]
    yaw: float

    @property
    def top(self) -> float:
        """Height of the upper face in metres."""
        return float(self.centre[2] + self.size[2] / 2)

    def place(self, right: float, front: float) -> Float[np.ndarray, " 2"]:
        """Return the point that lies so far to the piece's right and front of its centre."""
        return place_of(self.centre, self.yaw, right, front)


class Furnishing:
    """Pieces placed so far; each ``put_*`` adds one where it is free, or returns None.

    Collisions are tested between bounding boxes along the room's axes: exact for pieces parallel
    to the walls, on the safe side for turned ones. *Access zones* in front of furniture must be
    empty when it is placed and keep the leading pieces of later groups out, but let companions in
    (the chair of a desk). Nothing at all may stand in front of a door.
    """

    def __init__(
        self,
        plan: FloorPlan,
        camera: Float[np.ndarray, " 2"],
        ceiling: float,
        capacity: int,
        rng: np.random.Generator,
    ) -> None:
        self.plan = plan
        self.ceiling = ceiling
        self.capacity = capacity
        self.rng = rng
        self.pieces: list[Piece] = []
        self._wall_length = plan.wall_length
        self._wall_yaw = plan.wall_yaw
        notches = len(plan.notch_low)
        rows = 2 * capacity + notches + 2
        # one row for each axis: comparing along contiguous rows is several times faster
        self._low = np.zeros((3, rows))
        self._high = np.zeros((3, rows))
        self._is_zone = np.zeros(rows, dtype=bool)
        self._used = 0
        for low, high in zip(plan.notch_low, plan.notch_high, strict=True):
            self._occupy(np.array([*low, -1.0]), np.array([*high, ceiling + 1.0]))
        reach = np.array([_CAMERA_CLEARANCE, _CAMERA_CLEARANCE])
        self._occupy(np.array([*(camera - reach), -1.0]), np.array([*(camera + reach), ceiling]))

    @property
    def full(self) -> bool:
        """Whether the wanted number of pieces has been placed."""
        return len(self.pieces) >= self.capacity

    def sample_size(self, category: str) -> Float[np.ndarray, " 3"]:
        """Return a size around the category's mean: factors of about 10 %, within 0.75 to 1.33."""
        factor = np.exp(self.rng.normal(0.0, 0.06) + self.rng.normal(0.0, 0.08, 3))
        size = np.array(NOMINAL_SIZE[category]) * factor.clip(0.75, 1.33)
        size[2] = min(size[2], self.ceiling - 0.05)
        return size

    def put(
        self,
        category: str,
        size: Float[np.ndarray, " 3"],
        centre: Float[np.ndarray, "k 3"],
        yaw: Float[np.ndarray, " k"],
        *,
        access: float = 0.0,
        surround: float = 0.0,
        companion: bool = False,
    ) -> Piece | None:
        """Return the piece placed at the first free candidate, or None.

        Args:
            category: name of its category.
            size: width, depth, height in metres.
            centre: candidate centres.
            yaw: candidate yaws.
            access: metres in front of the piece that must be free and stay free.
            surround: the same on all sides.
            companion: whether it may stand in access zones.
        """
        if self.full:
            return None
        low, high = _bounds(size, centre, yaw)
        free = self._is_free(low, high, zones=not companion)
        has_zone = access > 0.0 or surround > 0.0
        zone_low, zone_high = low, high
        if has_zone:
            front = np.stack([-np.sin(yaw), np.cos(yaw)], axis=1) * access
            zone_low, zone_high = low.copy(), high.copy()
            zone_low[:, :2] += np.minimum(front, 0.0) - surround
            zone_high[:, :2] += np.maximum(front, 0.0) + surround
            zone_low[:, 2] += 0.05  # a carpet may lie there
            free &= self._is_free(zone_low, zone_high, zones=False)
        if not free.any():
            return None
        best = int(free.argmax())
        piece = Piece(category, centre[best], size, float(yaw[best]))
        self.pieces.append(piece)
        self._occupy(low[best], high[best])
        if has_zone:
            self._occupy(zone_low[best], zone_high[best], is_zone=category != "door")
        return piece

    def put_at_wall(
        self,
        category: str,
        *,
        bottom: float = 0.0,
        access: float = 0.0,
        corner: float = 0.25,
        size: Float[np.ndarray, " 3"] | None = None,
    ) -> Piece | None:
        """Return a piece placed with its whole back on one of the walls.

        Args:
            category: name of its category.
            bottom: height of its lower face.
            access: metres in front that stay free.
            corner: probability that it stands in a corner of the room.
            size: its size when it is already known.
        """
        size = self.sample_size(category) if size is None else size
        spare = (self._wall_length - size[0]).clip(min=0.0)
        if spare.sum() <= 0.0:
            return None
        wall = self.rng.choice(len(spare), _TRIES, p=spare / spare.sum())
        share = self.rng.random(_TRIES)
        in_corner = self.rng.random(_TRIES) < corner
        share = np.where(in_corner, np.round(share), share)
        yaw = self._wall_yaw[wall]
        right = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
        front = np.stack([-right[:, 1], right[:, 0]], axis=1)
        centre = self.plan.polygon[wall] + front * size[1] / 2
        centre += right * (size[0] / 2 + share * spare[wall])[:, None]
        height = np.full((_TRIES, 1), bottom + size[2] / 2)
        return self.put(category, size, np.hstack([centre, height]), yaw, access=access)

    def put_free(
        self, category: str, *, surround: float = 0.0, turned: bool = False
    ) -> Piece | None:
        """Return a piece placed anywhere on the floor.

        Args:
            category: name of its category.
            surround: metres on all sides that stay free.
            turned: any yaw instead of one parallel to the walls.
        """
        size = self.sample_size(category)
        quarter = self.rng.integers(4, size=_TRIES) * (np.pi / 2)
        yaw = self.rng.uniform(-np.pi, np.pi, _TRIES) if turned else quarter
        span = (self.plan.extent - 2 * surround - size[:2].min()).clip(min=0.0)
        place = self.plan.extent / 2 + (self.rng.random((_TRIES, 2)) - 0.5) * span
        height = np.full((_TRIES, 1), size[2] / 2)
        centre = np.hstack([place, height])
        return self.put(category, size, centre, yaw, surround=surround)

    def put_near(
        self,
        category: str,
        lead: Piece,
        right: float,
        front: float,
        *,
        turn: float = 0.0,
        bottom: float = 0.0,
        size: Float[np.ndarray, " 3"] | None = None,
    ) -> Piece | None:
        """Return a piece placed at one place of another piece's frame.

        Args:
            category: name of its category.
            lead: the piece whose frame is meant.
            right: metres to the right of the lead's centre.
            front: metres in front of the lead's centre.
            turn: yaw relative to the lead.
            bottom: height of the lower face above the floor.
            size: its size when it is already known.
        """
        size = self.sample_size(category) if size is None else size
        centre = np.array([[*lead.place(right, front), bottom + size[2] / 2]])
        return self.put(category, size, centre, np.array([lead.yaw + turn]), companion=True)

    def put_along(
        self,
        category: str,
        lead: Piece,
        right: float,
        *,
        bottom: float = 0.0,
        size: Float[np.ndarray, " 3"] | None = None,
    ) -> Piece | None:
        """Return a piece placed with its whole back on the wall at which another one stands.

        Args:
            category: name of its category.
            lead: a piece that stands at a wall.
            right: metres to the right of the lead's centre.
            bottom: height of the lower face above the floor.
            size: its size when it is already known.
        """
        size = self.sample_size(category) if size is None else size
        front = (size[1] - lead.size[1]) / 2
        back = -lead.size[1] / 2
        ends = [lead.place(right - size[0] / 2, back), lead.place(right + size[0] / 2, back)]
        if not self._on_one_wall(np.stack(ends)):
            return None
        return self.put_near(category, lead, right, front, bottom=bottom, size=size)

    def put_on(self, category: str, lead: Piece, *, back: float = 0.5) -> Piece | None:
        """Return a piece placed on top of another one, facing the same way within 10 degrees.

        A piece up to a quarter too wide or too deep is made to fit.

        Args:
            category: name of its category.
            lead: the piece it stands on.
            back: 0 for the front edge of the lead, 1 for its back edge; spread by 0.25.
        """
        size = self.sample_size(category)
        size[:2] = size[:2] * (lead.size[:2] / size[:2]).clip(0.75, 1.0)
        # the last two candidates are parallel to the lead, for pieces that hardly fit
        turn = self.rng.uniform(-1.0, 1.0, 6) * np.deg2rad(10.0)
        turn[4:] = 0.0
        low, high = _bounds(size, np.zeros((6, 3)), turn)
        spare = (lead.size[:2] - (high - low)[:, :2]) / 2
        fits = (spare >= 0.0).all(axis=1)
        if not fits.any() or lead.top + size[2] > self.ceiling:
            return None
        turn, spare = turn[fits], spare[fits]
        across = self.rng.uniform(-1.0, 1.0, len(turn)) * spare[:, 0]
        depth = 1.0 - 2.0 * back + self.rng.uniform(-0.5, 0.5, len(turn))
        depth = depth.clip(-1.0, 1.0) * spare[:, 1]
        place = np.array([lead.place(r, f) for r, f in zip(across, depth, strict=True)])
        height = np.full((len(turn), 1), lead.top + size[2] / 2)
        centre = np.hstack([place, height])
        return self.put(category, size, centre, lead.yaw + turn, companion=True)

    def put_above(self, category: str, lead: Piece, bottom: float) -> Piece | None:
        """Return a piece hung on the wall behind another one, not lower than ``bottom`` metres.

        Args:
            category: name of its category.
            lead: a piece that stands at a wall.
            bottom: height of the lower face; raised when the lead is higher.
        """
        size = self.sample_size(category)
        bottom = max(bottom, lead.top + 0.06)
        if bottom + size[2] > self.ceiling:
            return None
        across = float(self.rng.uniform(-0.3, 0.3)) * max(0.0, lead.size[0] - size[0])
        return self.put_along(category, lead, across, bottom=bottom, size=size)

    def _occupy(
        self, low: Float[np.ndarray, " 3"], high: Float[np.ndarray, " 3"], *, is_zone: bool = False
    ) -> None:
        self._low[:, self._used] = low
        self._high[:, self._used] = high
        self._is_zone[self._used] = is_zone
        self._used += 1

    def _on_one_wall(self, points: Float[np.ndarray, "k 2"]) -> bool:
        start, stop = self.plan.polygon, np.roll(self.plan.polygon, -1, axis=0)
        low, high = np.minimum(start, stop) - _SLACK, np.maximum(start, stop) + _SLACK
        within = (points[:, None] >= low) & (points[:, None] <= high)
        return bool(within.all(axis=(0, 2)).any())

    def _is_free(
        self, low: Float[np.ndarray, "k 3"], high: Float[np.ndarray, "k 3"], *, zones: bool
    ) -> Bool[np.ndarray, " k"]:
        inside = (low[:, :2] >= -_SLACK).all(axis=1)
        inside &= (high[:, :2] <= self.plan.extent + _SLACK).all(axis=1)
        inside &= high[:, 2] <= self.ceiling + _SLACK
        meets = ~self._is_zone[: self._used] | zones
        for axis in range(3):
            meets = meets & (low[:, axis, None] < self._high[axis, : self._used] - _SLACK)
            meets &= high[:, axis, None] > self._low[axis, : self._used] + _SLACK
        return inside & ~meets.any(axis=1)


def _bounds(
    size: Float[np.ndarray, " 3"], centre: Float[np.ndarray, "k 3"], yaw: Float[np.ndarray, " k"]
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "k 3"]]:
    """Return the lower and upper corners of the boxes' bounds along the room's axes."""
    cos, sin = np.abs(np.cos(yaw)), np.abs(np.sin(yaw))
    half = np.stack(
        [cos * size[0] + sin * size[1], sin * size[0] + cos * size[1], np.full_like(cos, size[2])],
        axis=1,
    )
    return centre - half / 2, centre + half / 2
