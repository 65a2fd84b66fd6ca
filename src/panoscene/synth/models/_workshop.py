"""The bench on which a model is put together piece by piece."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from panoscene.synth.assets import CadModel, LightSource, Material, Placement

from . import _pieces as pieces
from ._pieces import Number, Piece, Point
from ._shading import shaded


class Finish(NamedTuple):
    """A material and how large its texture is."""

    material: Material
    metres: float = 1.0
    """Edge of the texture in metres; 0 when pieces bring the picture's own uv."""


class Workshop:
    """Collects pieces in a frame of the maker's choice: +x right, +y front, +z up, floor at 0."""

    def __init__(self, rng: np.random.Generator, texture_size: int) -> None:
        self.rng = rng
        self.texture_size = texture_size
        self.support: float | None = None
        self.has_front: bool | None = None
        self.elevation: float | None = None
        self.lights: list[LightSource] = []
        self._finishes: list[Finish] = []
        self._pieces: list[tuple[Piece, int, float]] = []

    def count(self) -> int:
        """Return how many pieces there are so far."""
        return len(self._pieces)

    def add(self, finish: Finish, piece: Piece, at: Point = (0.0, 0.0, 0.0), crease: Number = 50.0):
        """Add a piece, shifted to ``at``."""
        known = [k for k, old in enumerate(self._finishes) if old.material is finish.material]
        if not known:
            self._finishes.append(finish)
        index = known[0] if known else len(self._finishes) - 1
        if finish.metres:
            shift = self.rng.random(2)
            piece = piece._replace(uv=piece.uv / finish.metres + shift)
        self._pieces.append((pieces.move(piece, at), index, crease))

    def box(self, finish: Finish, low: Point, high: Point, bevel: Number = 0.0015) -> None:
        """Add a box between two corners."""
        self.add(finish, pieces.box(low, high, bevel))

    def soft(
        self, finish: Finish, low: Point, high: Point, radius: Number, bulge: Point = (0, 0, 0)
    ):
        """Add a box with round edges, such as upholstery."""
        self.add(finish, pieces.rounded_box(low, high, radius, bulge), crease=70.0)

    def rod(self, finish: Finish, start: Point, end: Point, radius, top: Number | None = None):
        """Add a straight round rod, tapering to the radius ``top``."""
        radii = (radius, radius if top is None else top)
        self.add(finish, pieces.tube([start, end], radii, 14), crease=60.0)

    def pipe(self, finish: Finish, path, radius: Number, joined: bool = False, segments: int = 10):
        """Add a rod bent along a path."""
        self.add(finish, pieces.tube(path, radius, segments, joined), crease=60.0)

    def disc(self, finish: Finish, at: Point, radius: Number, height: Number, top=None) -> None:
        """Add an upright cylinder that stands at ``at``."""
        self.add(finish, pieces.cylinder(radius, 0.0, height, 32, top), at)

    def wheel(self, finish: Finish, at: Point, radius: Number, length: Number) -> None:
        """Add a cylinder along y that starts at ``at``."""
        self.add(finish, pieces.turn(pieces.cylinder(radius, 0.0, length, 32), "x", -np.pi / 2), at)

    def light(
        self,
        position: Point,
        diameter: Number = 0.08,
        colour: tuple[float, float, float] = (1.0, 0.85, 0.65),
    ):
        """Add a lamp at a position of the maker's frame."""
        x, y, z = (float(c) for c in position)
        self.lights.append(LightSource((x, y, z), float(diameter), colour))

    def turn_since(self, first: int, axis: str, angle: Number) -> None:
        """Turn the pieces made since there were ``first`` of them about an axis."""
        last = self._pieces[first:]
        self._pieces[first:] = [(pieces.turn(p, axis, angle), k, c) for p, k, c in last]

    def shift_since(self, first: int, offset: Point) -> None:
        """Shift the pieces made since there were ``first`` of them."""
        last = self._pieces[first:]
        self._pieces[first:] = [(pieces.move(p, offset), k, c) for p, k, c in last]

    def shift_all(self, offset: Point) -> None:
        """Shift everything made so far."""
        self.shift_since(0, offset)

    def model(
        self, name: str, category: str, placement: Placement, elevation: float, has_front: bool
    ) -> CadModel:
        """Return everything made so far as one model around its centre."""
        parts, indices, creases = zip(*self._pieces, strict=True)
        surface = shaded(parts, creases)
        vertices = surface.vertices
        owner = np.repeat(np.array(indices, np.int16), [len(p.faces) for p in parts])
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        centre = 0.5 * (low + high)
        placed = (vertices - centre).astype(np.float32)
        size = placed.max(axis=0) - placed.min(axis=0)
        x, y, z = (float(c) for c in centre)
        lights = tuple(
            replace(s, position=(s.position[0] - x, s.position[1] - y, s.position[2] - z))
            for s in self.lights
        )
        return CadModel(
            id=name, base=name, category=category, vertices=placed,
            normals=surface.normals.astype(np.float32),
            uv=surface.uv.astype(np.float32),
            faces=surface.faces.astype(np.int32), face_material=owner,
            materials=tuple(f.material for f in self._finishes),
            size=(float(size[0]), float(size[1]), float(size[2])), placement=placement,
            elevation=elevation if self.elevation is None else self.elevation,
            support_height=None if self.support is None else float(self.support - low[2]),
            lights=lights,
            has_front=has_front if self.has_front is None else self.has_front, licence="Apache-2.0",
            creator="The panoscene authors", source="panoscene.synth.models",
        )  # fmt: skip
