"""Builds the rooms themselves: floors, walls with their openings, ceilings and trim."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from jaxtyping import Float64, Int32

from panoscene.synth.homes._records import Home
from panoscene.synth.render._openings import (
    Hole,
    WallFrame,
    holes_of,
    is_passable,
    is_second_entry,
    wall_depth,
    wall_frame,
)
from panoscene.synth.render._records import (
    Finish,
    PartKind,
    RoomFinish,
    ShellPart,
    WindowPane,
)

_SKIRTING = (0.07, 0.014)
"""Height and thickness in metres."""
_CASING = (0.065, 0.012)
"""Width and thickness of the frame around doorways."""
_SILL = (0.03, 0.10, 0.05)
"""Thickness, how far it stands into the room, and how far past the jambs."""
_BAR = 0.05
_LEAF = 0.04


@dataclass(slots=True)
class Shell:
    """The building: its visible parts, its windows, and which rooms light passes between."""

    parts: list[ShellPart] = field(default_factory=list)
    panes: list[WindowPane] = field(default_factory=list)
    links: list[tuple[int, int]] = field(default_factory=list)
    next_instance: int = 1


def build_shell(
    home: Home,
    finishes: Sequence[RoomFinish],
    first_instance: int = 1,
    fitted: Mapping[int, tuple[int, float]] | None = None,
) -> Shell:
    """Return the triangles of a home's rooms.

    Every wall, floor and ceiling has an instance id of its own; so has the skirting of every wall
    and the frame of every opening. A window without a model gets a plain frame, and its frame and
    pane share one id. A door without a model gets a plain leaf.

    Args:
        home: the home.
        finishes: one for each room.
        first_instance: id of the first part.
        fitted: instance id of the model that stands in an opening, and how many metres out of the
            room its glass is; by the opening's index.

    Raises:
        ValueError: if there is not one finish for each room.
    """
    if len(finishes) != len(home.rooms):
        raise ValueError(
            f"finishes must be one for each of the {len(home.rooms)} rooms, found {len(finishes)}"
        )
    builder = _Builder(home, finishes, Shell(next_instance=first_instance), dict(fitted or {}))
    holes = holes_of(home)
    for room in range(len(home.rooms)):
        builder.flats(room)
        for wall in range(len(home.rooms[room].polygon)):
            builder.wall(room, wall, holes.get((room, wall), []))
    for index in range(len(home.openings)):
        builder.opening(index)
    return builder.shell


@dataclass(slots=True)
class _Builder:
    home: Home
    finishes: Sequence[RoomFinish]
    shell: Shell
    fitted: dict[int, tuple[int, float]]

    def add(
        self,
        kind: PartKind,
        room: int,
        index: int,
        pieces: "list[_Piece]",
        finish: Finish,
        *,
        instance: int | None = None,
    ) -> int:
        """Append a part and return its instance id."""
        if instance is None:
            instance = self.shell.next_instance
            self.shell.next_instance += 1
        if pieces:
            counts = np.cumsum([0] + [len(p[0]) for p in pieces])
            faces = np.concatenate([p[2] + n for p, n in zip(pieces, counts, strict=False)])
            uv = np.concatenate([p[1] for p in pieces]) / np.array(finish.tile)
            vertices = np.concatenate([p[0] for p in pieces])
            part = ShellPart(
                kind, instance, room, index, vertices, uv, faces.astype(np.int32), finish.material
            )
            self.shell.parts.append(part)
        return instance

    def flats(self, room: int) -> None:
        """Add the floor and the ceiling of a room."""
        plan = self.home.rooms[room].polygon
        triangles = _triangulate(plan)
        height = self.home.rooms[room].ceiling_height
        corners = triangles.reshape(-1, 2)
        faces = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
        looks = self.finishes[room]
        for z, finish in ((0.0, looks.floor), (height, looks.ceiling)):
            kind: PartKind = "ceiling" if z else "floor"
            vertices = np.column_stack([corners, np.full(len(corners), z)])
            turned = faces[:, ::-1] if z else faces
            self.add(kind, room, 0, [(vertices, corners, turned)], finish)

    def wall(self, room: int, wall: int, holes: list[Hole]) -> None:
        """Add a wall around its holes, its skirting and the casings of its doorways."""
        home, looks = self.home, self.finishes[room]
        frame = wall_frame(home.rooms[room].polygon, wall)
        height = home.rooms[room].ceiling_height
        finish = looks.walls[wall % len(looks.walls)]
        self.add("wall", room, wall, [_panel(frame, height, holes)], finish)
        strips, at = [], 0.0
        doors = [h for h in holes if h.bottom < _SKIRTING[0]]
        for hole in sorted(doors, key=lambda h: h.start):
            strips.append((at, hole.start - _CASING[0]))
            at = hole.end + _CASING[0]
        strips.append((at, frame.length))
        pieces = [
            _box(frame, (a, b), (-_SKIRTING[1], 0.0), (0.0, _SKIRTING[0]))
            for a, b in strips
            if b - a > 0.01
        ]
        self.add("skirting", room, wall, pieces, looks.trim)
        for hole in doors:
            wide, thick = _CASING
            top = min(hole.top + wide, height)
            sides = [(hole.start - wide, hole.start), (hole.end, hole.end + wide)]
            casing = [_box(frame, side, (-thick, 0.0), (0.0, top)) for side in sides]
            casing.append(_box(frame, (hole.start, hole.end), (-thick, 0.0), (hole.top, top)))
            self.add("frame", room, hole.opening, casing, looks.trim)

    def opening(self, index: int) -> None:
        """Add what is inside the thickness of the wall, and a pane or a leaf."""
        o = self.home.openings[index]
        if o.leads_to is not None and is_passable(o):
            self.shell.links.append((o.room, o.leads_to))
        if is_second_entry(self.home, index):
            return
        looks = self.finishes[o.room]
        frame = wall_frame(self.home.rooms[o.room].polygon, o.wall)
        depth = wall_depth(self.home, index)
        span = (o.start, o.start + o.width)
        window = o.kind == "window" and o.leads_to is None
        glass = self.fitted[index][1] if index in self.fitted else depth / 2
        reach = min(glass + 0.05, depth) if window else depth
        finish = looks.walls[o.wall % len(looks.walls)] if window else looks.trim
        jambs = _tunnel(frame, span, (0.0, reach), (o.bottom, o.top), floor=window)
        self.add("frame", o.room, index, jambs, finish)
        if not window:
            threshold = _level(frame, span, (0.0, depth), o.bottom)
            self.add("sill", o.room, index, [threshold], looks.floor)
        if window:
            self._window(index, frame, glass)
        elif o.kind == "door" or o.leads_to is None:
            self._leaf(index, frame, depth)

    def _window(self, index: int, frame: WallFrame, out: float) -> None:
        o = self.home.openings[index]
        looks = self.finishes[o.room]
        start, end = o.start, o.start + o.width
        if o.bottom > 0.2:
            thick, stand, past = _SILL
            board = _box(
                frame, (start - past, end + past), (-stand, 0.0), (o.bottom - thick, o.bottom)
            )
            inner = _box(frame, (start, end), (0.0, out), (o.bottom - 0.001, o.bottom + 0.002))
            self.add("sill", o.room, index, [board, inner], looks.trim)
        if index in self.fitted:
            instance = self.fitted[index][0]
        else:
            bars = _window_bars(frame, (start, end), out, (o.bottom, o.top))
            instance = self.add("frame", o.room, index, bars, looks.trim)
        centre = frame.place((start + end) / 2, out, (o.bottom + o.top) / 2)
        half = frame.along * (o.width / 2)
        self.shell.panes.append(
            WindowPane(
                instance,
                o.room,
                (float(centre[0]), float(centre[1]), float(centre[2])),
                (float(half[0]), float(half[1]), 0.0),
                (0.0, 0.0, (o.top - o.bottom) / 2),
                (float(-frame.outward[0]), float(-frame.outward[1]), 0.0),
            )
        )

    def _leaf(self, index: int, frame: WallFrame, depth: float) -> None:
        """Add a plain leaf where there is no model, and close what leads outside."""
        o = self.home.openings[index]
        trim = self.finishes[o.room].trim
        span = (o.start, o.start + o.width)
        pieces = []
        if o.leads_to is None:  # nobody may look out of an outer door
            pieces.append(_box(frame, span, (depth - 0.01, depth), (o.bottom, o.top)))
        if index not in self.fitted and o.kind == "door":
            out = (0.02, 0.02 + _LEAF)
            vertices, uv, faces = _box(frame, span, out, (o.bottom + 0.005, o.top - 0.003))
            hinge = frame.place(o.start, 0.02, 0.0)[:2]
            turn = o.swing  # into the room, which is left of the wall's direction
            plan = vertices[:, :2] - hinge
            cos, sin = np.cos(turn), np.sin(turn)
            vertices[:, :2] = plan @ np.array([[cos, sin], [-sin, cos]]) + hinge
            pieces.append((vertices, uv, faces))
        if pieces:
            self.add("door", o.room, index, pieces, trim)


_Piece = tuple[
    Float64[np.ndarray, "vertices 3"], Float64[np.ndarray, "vertices 2"], Int32[np.ndarray, "f 3"]
]
"""Vertices, texture coordinates in metres, and faces."""


def _triangulate(plan: Float64[np.ndarray, "corners 2"]) -> Float64[np.ndarray, "triangles 3 2"]:
    """Return triangles, counter-clockwise from above, that fill a polygon."""
    pieces = shapely.constrained_delaunay_triangles(shapely.Polygon(plan)).geoms
    triangles = np.array([shapely.get_coordinates(t)[:3] for t in pieces])
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    clockwise = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < 0
    triangles[clockwise] = triangles[clockwise][:, ::-1]
    return triangles


def _panel(frame: WallFrame, height: float, holes: list[Hole]) -> _Piece:
    """Return a wall without its holes: the cells of a grid through the holes' edges."""
    s = np.unique([0.0, frame.length, *(a for h in holes for a in (h.start, h.end))])
    z = np.unique([0.0, height, *(a for h in holes for a in (h.bottom, h.top))])
    s, z = s[(s >= 0) & (s <= frame.length)], z[(z >= 0) & (z <= height)]
    left, low = (a.reshape(-1) for a in np.meshgrid(s[:-1], z[:-1], indexing="ij"))
    right, high = (a.reshape(-1) for a in np.meshgrid(s[1:], z[1:], indexing="ij"))
    middle_s, middle_z = (left + right) / 2, (low + high) / 2
    solid = np.ones(len(left), dtype=bool)
    for h in holes:
        in_s = (middle_s > h.start) & (middle_s < h.end)
        solid &= ~(in_s & (middle_z > h.bottom) & (middle_z < h.top))
    along = np.stack([right, left, left, right], axis=1)[solid]
    up = np.stack([low, low, high, high], axis=1)[solid]
    # seen from inside, the wall runs to the left, and its pattern to the right
    uv = np.stack([frame.length - along, up], axis=-1)
    return _quads(frame.place(along, 0.0, up), uv)


def _quads(corners: Float64[np.ndarray, "n 4 3"], uv: Float64[np.ndarray, "n 4 2"]) -> _Piece:
    """Return rectangles as triangles."""
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])]).astype(
        np.int32
    )
    return corners.reshape(-1, 3), uv.reshape(-1, 2), faces


_BOX_FACES = np.array(
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
)
"""Corner bits are along, out, up; seen from outside when ``out`` points away from the viewer."""


def _box(
    frame: WallFrame,
    span: tuple[float, float],
    out: tuple[float, float],
    z: tuple[float, float],
) -> _Piece:
    """Return a box given in a wall's frame."""
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    local = np.stack([np.array(side)[bits[:, k]] for k, side in enumerate((span, out, z))], axis=1)
    corners = local[_BOX_FACES]
    uv = np.stack([corners[..., 0] + corners[..., 1], corners[..., 2] + corners[..., 1]], axis=-1)
    return _quads(frame.place(*np.moveaxis(corners, -1, 0)), uv)


def _tunnel(
    frame: WallFrame,
    span: tuple[float, float],
    out: tuple[float, float],
    z: tuple[float, float],
    *,
    floor: bool,
) -> list[_Piece]:
    """Return the inner sides of a hole: jambs, lintel and, with ``floor``, the lower side."""
    (a, b), (near, far), (low, high) = span, out, z
    pieces = []
    for s, turned in ((a, False), (b, True)):
        depths = np.array([far, near, near, far] if not turned else [near, far, far, near])
        heights = np.array([low, low, high, high])
        corners = frame.place(s, depths, heights)[None]
        pieces.append(_quads(corners, np.stack([depths, heights], axis=-1)[None]))
    pieces.append(_level(frame, span, out, high, downward=True))
    if floor:
        pieces.append(_level(frame, span, out, low))
    return pieces


def _level(
    frame: WallFrame,
    span: tuple[float, float],
    out: tuple[float, float],
    z: float,
    *,
    downward: bool = False,
) -> _Piece:
    """Return a level rectangle inside a wall."""
    along = np.array([span[0], span[1], span[1], span[0]])
    depths = np.array([out[0], out[0], out[1], out[1]])
    if not downward:
        along, depths = along[::-1], depths[::-1]
    corners = frame.place(along, depths, z)[None]
    return _quads(corners, np.stack([along, depths], axis=-1)[None])


def _window_bars(
    frame: WallFrame, span: tuple[float, float], out: float, z: tuple[float, float]
) -> list[_Piece]:
    """Return a plain window frame with mullions at most 0.9 m apart."""
    deep = (out - 0.03, out + 0.03)
    (a, b), (low, high) = span, z
    count = max(1, round((b - a) / 0.9))
    middles = np.linspace(a, b, count + 1)[1:-1]
    upright = [(a, a + _BAR), (b - _BAR, b), *((m - _BAR / 2, m + _BAR / 2) for m in middles)]
    bars = [_box(frame, (float(x), float(y)), deep, (low, high)) for x, y in upright]
    bars += [_box(frame, (a, b), deep, side) for side in ((low, low + _BAR), (high - _BAR, high))]
    return bars
