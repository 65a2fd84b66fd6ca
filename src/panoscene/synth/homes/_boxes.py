"""Homes as boxes and scenes: what stands where, for pictures, checks and statistics."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float

from panoscene.geometry import OrientedBoxes
from panoscene.scene import CATEGORIES, Layout, Scene, objects_from_boxes, scene_from_boxes

from ._library import ModelLibrary, ModelSummary
from ._records import Home, Room


@dataclass(frozen=True, slots=True)
class PlacedBoxes:
    """The boxes of a home's pieces, in the order of ``home.placed``."""

    category: tuple[str, ...]
    """One of the 57, or "" for decoration."""
    centre: Float[np.ndarray, "n 3"]
    """Home frame, metres."""
    size: Float[np.ndarray, "n 3"]
    """Width, depth, height in metres."""
    yaw: Float[np.ndarray, " n"]


def placed_boxes(home: Home, library: ModelLibrary) -> PlacedBoxes:
    """Return the boxes of all pieces of a home.

    Raises:
        ValueError: if the library does not have one of the models.
    """
    models = _models_by_id(library)
    missing = next((piece.model for piece in home.placed if piece.model not in models), None)
    if missing is not None:
        raise ValueError(f"library: expected the models of the home, found no {missing!r}")
    used = [models[piece.model] for piece in home.placed]
    size = np.array([model.size for model in used], dtype=np.float64).reshape(-1, 3)
    scale = np.array([piece.scale for piece in home.placed], dtype=np.float64).reshape(-1, 3)
    centre = np.array([piece.position for piece in home.placed], dtype=np.float64)
    yaw = np.array([piece.yaw for piece in home.placed], dtype=np.float64)
    category = tuple(model.category for model in used)
    return PlacedBoxes(category, centre.reshape(-1, 3), size * scale, yaw)


def _models_by_id(library: ModelLibrary) -> dict[str, ModelSummary]:
    return {model.id: model for category in (*CATEGORIES, "") for model in library.models(category)}


def room_layouts(
    home: Home, camera: tuple[float, float] = (0.0, 0.0), yaw: float = 0.0
) -> tuple[Layout, ...]:
    """Return the layouts of all rooms in the world frame of a camera.

    Args:
        home: the home.
        camera: where it stands in the home's plan, metres.
        yaw: of the panorama's centre column in the home, counter-clockwise from above; 0 looks
            along the home's +y.
    """
    return tuple(_layout(room, camera, yaw) for room in home.rooms)


def home_scene(
    home: Home,
    library: ModelLibrary,
    room: int,
    camera: tuple[float, float],
    *,
    yaw: float = 0.0,
    camera_height: float = 1.6,
) -> Scene:
    """Return one room of a home as a scene of boxes, with its doors and windows.

    Decoration, which is none of the 57 categories, is left out.

    Args:
        home: a furnished home.
        library: the models it was furnished from.
        room: index of the room.
        camera: where the camera stands in the home's plan, metres.
        yaw: of the panorama's centre column in the home, counter-clockwise from above.
        camera_height: metres.

    Convention:
        - the scene's world frame has its origin on the floor under the camera, +y towards the
          panorama's centre column; the home's frame is that of its plan

    Raises:
        ValueError: if there is no such room, or the library does not have one of the models.
    """
    if not 0 <= room < len(home.rooms):
        raise ValueError(f"room must be 0 to {len(home.rooms) - 1}, found {room}")
    boxes = placed_boxes(home, library)
    chosen = [
        k
        for k, piece in enumerate(home.placed)
        if boxes.category[k] and (piece.room == room or _leads_to(home, k, room))
    ]
    centre = boxes.centre[chosen].copy()
    centre[:, :2] = _in_world(centre[:, :2], camera, yaw)
    turned = (boxes.yaw[chosen] - yaw + np.pi) % (2 * np.pi) - np.pi
    oriented = OrientedBoxes(
        torch.as_tensor(centre, dtype=torch.float32),
        torch.as_tensor(boxes.size[chosen], dtype=torch.float32),
        torch.as_tensor(turned, dtype=torch.float32),
    )
    category = [boxes.category[k] for k in chosen]
    names = tuple(f"{name}_{k}" for k, name in enumerate(category))
    objects = objects_from_boxes(oriented, category, camera_height=camera_height, id=names)
    kind = home.rooms[room].kind.replace("_", " ")
    return scene_from_boxes(
        objects, _layout(home.rooms[room], camera, yaw), camera_height=camera_height,
        name=f"home {home.seed}, {kind} {room}",
    )  # fmt: skip


def _leads_to(home: Home, piece: int, room: int) -> bool:
    """Return whether a piece is a door between its own and another room."""
    opening = home.placed[piece].opening
    return opening is not None and home.openings[opening].leads_to == room


def _layout(room: Room, camera: tuple[float, float], yaw: float) -> Layout:
    polygon = _in_world(room.polygon, camera, yaw)
    return Layout(torch.as_tensor(polygon, dtype=torch.float32), ceiling_height=room.ceiling_height)


def _in_world(
    points: Float[np.ndarray, "n 2"], camera: tuple[float, float], yaw: float
) -> Float[np.ndarray, "n 2"]:
    """Return points of the plan in the world frame of a camera."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    world_from_home = np.array([[cos, sin], [-sin, cos]])
    return (points - np.array(camera)) @ world_from_home.T
