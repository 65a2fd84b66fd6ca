"""From where a room is looked at."""

from dataclasses import dataclass

import viser

from panoscene.scene import Scene

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class View:
    """A place to look from; world frame, metres and radians."""

    position: Point
    look_at: Point
    fov: float
    """Vertical."""


def view_of(name: str, scene: Scene) -> View:
    """Return the view called Overview, From above or From camera.

    Raises:
        ValueError: there is no view of that name.
    """
    layout = scene.layout
    low, high = layout.floor_polygon.amin(0), layout.floor_polygon.amax(0)
    x, y = ((low + high) / 2).tolist()
    width, depth = (high - low).tolist()
    top = layout.ceiling_height
    span = max(width, depth, top)
    if name == "Overview":
        away = 0.5 * depth + 0.62 * span
        return View((x, y - away, 0.5 * top + 1.15 * span), (x, y, 0.3 * top), 0.85)
    if name == "From above":
        # straight down leaves open which way is up
        return View((x, y - 0.01, top + 1.25 * span), (x, y, 0.0), 0.85)
    if name == "From camera":
        height = scene.panorama.camera_height
        return View((0.0, 0.0, height), (0.0, 0.05, height), 1.4)
    raise ValueError(f"name: found {name!r}, expected Overview, From above or From camera")


def aim(client: viser.ClientHandle, view: View) -> None:
    """Move the camera of one browser."""
    with client.atomic():
        client.camera.up_direction = (0.0, 0.0, 1.0)
        client.camera.position = view.position
        client.camera.look_at = view.look_at
        client.camera.fov = view.fov
