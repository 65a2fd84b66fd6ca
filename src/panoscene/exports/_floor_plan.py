"""A room as an architect draws it: walls with openings, furniture, dimensions, in metres."""

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from jaxtyping import Float

from panoscene.exports._plan_dimensions import Dimension, plan_dimensions
from panoscene.exports._plan_labels import LABEL_MM, Label, place_labels
from panoscene.exports._plan_openings import Opening, find_openings
from panoscene.geometry import box_footprint, polygon_turn
from panoscene.scene import CATEGORIES, Scene, Shapes, object_names, scene_to_json
from panoscene.style import NO_FRONT, OVERHEAD, WALL_THICKNESS

SCALES = (10, 20, 50, 100, 200, 500)
"""The scales 1:n of drawings; larger rooms go on in powers of ten."""
LONGEST_MM = 260.0
"""The longest side of room and furniture on paper."""
FAR = 2.0
"""Metres outside the room from which a piece is left out of the plan."""


@dataclass(frozen=True, slots=True)
class Footprint:
    """A piece of furniture from above."""

    index: int
    """Of the object in the scene."""
    name: str
    category: str
    corners: Float[np.ndarray, "4 2"]
    """Counter-clockwise from the back left corner; the front is from corner 3 to corner 2."""
    has_front: bool
    overhead: bool
    """Hangs more than 1.3 m above the floor: dashed."""
    height: float
    """Of its upper side above the floor, in metres."""

    @property
    def shape(self) -> shapely.Polygon:
        """The rectangle."""
        return shapely.Polygon(self.corners)


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """A room from above; all lengths in metres, all places in the turned frame of the plan."""

    name: str
    turn: float
    """Radians, counter-clockwise, by which the world is turned so that walls run along the page."""
    scale: int
    """The drawing is meant for paper at 1 : scale; texts and lines have their size from it."""
    corners: Float[np.ndarray, "corners 2"]
    """The inner faces of the walls, counter-clockwise."""
    walls: shapely.Geometry
    """What is cut: walls of the usual thickness outside the inner faces, without the openings.
    The photo shows inner faces only."""
    openings: tuple[Opening, ...]
    furniture: tuple[Footprint, ...]
    """In paint order: what is higher comes later."""
    dimensions: tuple[Dimension, ...]
    labels: tuple[Label, ...]
    """Names of the furniture, or numbers where names do not fit."""
    key: tuple[str, ...]
    """What number 1, 2, ... stand for."""
    area: float
    """Of the floor, in square metres."""
    height: float
    """From floor to ceiling."""
    area_place: tuple[float, float]
    """Where area and height are written."""
    camera: tuple[float, float]
    """Where the photo was taken."""
    ahead: tuple[float, float]
    """Unit vector towards the photo's centre column."""

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Left, bottom, right, top of everything, dimensions included."""
        shapes = [self.walls, *(piece.shape for piece in self.furniture)]
        shapes += [dimension.strip(self.metres(3.0)) for dimension in self.dimensions]
        return shapely.unary_union(shapes).bounds

    def metres(self, paper_mm: float) -> float:
        """Return what a length on paper stands for."""
        return paper_mm * self.scale / 1000


def floor_plan(scene: Scene) -> FloorPlan:
    """Return the floor plan of a scene.

    Doors and windows become openings of the wall that they lie in or against; one that no wall
    explains is drawn as a piece of furniture. Doors swing into the room, from the jamb next to the
    nearer corner, since the photo does not tell; wide ones have two leaves.

    Convention:
        - turned, by at most 45 degrees, so that walls run along the page's edges
        - walls and openings are dimensioned outside; lengths are those of the inner faces

    Raises:
        SceneFormatError: the scene has numbers that are not finite or a room that is none.
    """
    bare = replace(scene.objects, shapes=Shapes())
    scene_to_json(replace(scene, objects=bare, relations=None))
    turn = polygon_turn(scene.layout.floor_polygon)
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    corners = scene.layout.floor_polygon.double().numpy(force=True) @ rotation.T
    floor = shapely.Polygon(corners)
    pieces = _footprints(scene, rotation, floor)
    openings, rest = find_openings(
        corners, [(piece.name, piece.category, piece.corners) for piece in pieces]
    )
    furniture = tuple(sorted((pieces[k] for k in rest), key=lambda p: (p.overhead, p.height)))
    cut = shapely.unary_union([opening.gap for opening in openings])
    walls = floor.buffer(WALL_THICKNESS, join_style="mitre").difference(floor).difference(cut)
    scale = _scale(shapely.unary_union([walls, *(piece.shape for piece in furniture)]).bounds)
    solid = [piece.shape for piece in furniture if piece.category != "carpet"]
    camera = shapely.Point(0.0, 0.0).buffer(2.0 * scale / 1000)
    area_place = _area_place(floor, [camera, *solid], openings, scale)
    labels, key = place_labels(
        [(piece.category, piece.shape) for piece in furniture],
        area_place,
        openings,
        [camera],
        scale,
    )
    return FloorPlan(
        name=scene.name,
        turn=turn,
        scale=scale,
        corners=corners,
        walls=walls,
        openings=openings,
        furniture=furniture,
        dimensions=plan_dimensions(corners, openings, furniture_hull(furniture, floor), scale),
        labels=labels,
        key=key,
        area=floor.area,
        height=scene.layout.ceiling_height - scene.layout.floor_height,
        area_place=area_place,
        camera=(0.0, 0.0),
        ahead=(-math.sin(turn), math.cos(turn)),
    )


def furniture_hull(
    furniture: tuple[Footprint, ...], floor: shapely.Polygon
) -> tuple[float, float, float, float]:
    """Return left, bottom, right, top of walls and furniture, which dimensions stay clear of."""
    outside = floor.buffer(WALL_THICKNESS, join_style="mitre")
    return shapely.unary_union([outside, *(piece.shape for piece in furniture)]).bounds


def _footprints(
    scene: Scene, rotation: Float[np.ndarray, "2 2"], floor: shapely.Polygon
) -> list[Footprint]:
    boxes = scene.objects.boxes
    corners = box_footprint(boxes).double().numpy(force=True) @ rotation.T
    bottom = boxes.centre[:, 2] - boxes.size[:, 2] / 2 - scene.layout.floor_height
    tops = (bottom + boxes.size[:, 2]).tolist()
    category = [CATEGORIES[int(index)] for index in scene.objects.category]
    return [
        Footprint(
            index=k,
            name=name,
            category=category[k],
            corners=corners[k],
            has_front=category[k] not in NO_FRONT,
            overhead=bool(bottom[k] > OVERHEAD),
            height=tops[k],
        )
        for k, name in enumerate(object_names(scene.objects))
        if floor.distance(shapely.Polygon(corners[k])) <= FAR
    ]


def _scale(bounds: tuple[float, float, float, float]) -> int:
    longest = max(bounds[2] - bounds[0], bounds[3] - bounds[1]) * 1000 / LONGEST_MM
    for scale in SCALES:
        if longest <= scale:
            return scale
    return int(10 ** math.ceil(math.log10(longest)))


def _area_place(
    floor: shapely.Polygon,
    things: list[shapely.Polygon],
    openings: tuple[Opening, ...],
    scale: int,
) -> tuple[float, float]:
    """Return the middle of the largest free part of the floor."""
    wide, high = 9.0 * scale / 1000, (2 * LABEL_MM) * scale / 1000
    # stretched so that the largest circle suits a text that is wider than high
    free = shapely.difference(
        floor.buffer(-high / 4),
        shapely.unary_union([*things, *(opening.swing for opening in openings)]),
    )
    if shapely.area(free) < wide * high:
        free = floor
    stretched = shapely.transform(free, lambda xy: xy * [1.0, wide / high])
    circle = shapely.maximum_inscribed_circle(np.array(stretched))
    x, y = shapely.get_coordinates(circle)[0].tolist()
    return x, y * high / wide
