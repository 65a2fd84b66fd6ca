"""The room and its objects as nodes of viser's scene; world frame, metres."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
import viser
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import OrientedBoxes, box_corners
from panoscene.scene import CATEGORIES, Layout, Mesh, Scene, object_mesh, room_surfaces
from panoscene.style import (
    ALARM,
    FLOOR,
    GROUP_COLOURS,
    INK,
    NO_FRONT,
    PAPER,
    REFERENCE,
    SEE_THROUGH,
    WALL,
    group_of,
)

from ._measurement import COUNTED_FROM, SHOWN_FROM

Colour = tuple[int, int, int]

_EDGES = ((0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7),
          (0, 4), (1, 5), (2, 6), (3, 7))  # fmt: skip
_UNIT_CORNERS = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)]) - 0.5
_FRONT = np.array(
    [[[-0.5, 0.5, 0.5], [0.5, 0.5, 0.5]], [[-0.5, 0.5, -0.5], [0.5, 0.5, -0.5]],
     [[0.0, 0.0, 0.5], [0.0, 0.42, 0.5]], [[-0.12, 0.26, 0.5], [0.0, 0.42, 0.5]],
     [[0.12, 0.26, 0.5], [0.0, 0.42, 0.5]]]
)  # fmt: skip


def rgb(colour: str) -> Colour:
    """Return a colour such as ``#77aadd`` as three numbers from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def mixed(first: str, second: str, part: float) -> Colour:
    """Return a colour with a part of another in it.

    Examples:
        >>> mixed("#000000", "#ffffff", 0.2)
        (51, 51, 51)
    """
    a, b = np.array(rgb(first)), np.array(rgb(second))
    red, green, blue = np.rint(a + part * (b - a)).astype(int).tolist()
    return red, green, blue


def quaternion(yaw: float) -> tuple[float, float, float, float]:
    """Return w, x, y, z of a turn about +z.

    Examples:
        >>> quaternion(0.0)
        (1.0, 0.0, 0.0, 0.0)
    """
    return float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2))


def yaw_of(wxyz: Float[np.ndarray, "4"]) -> float:
    """Return the turn about +z of a rotation that has no other."""
    return 2.0 * float(np.arctan2(wxyz[3], wxyz[0]))


class RoomDrawing:
    """Floor, ceiling, walls that are seen from inside only, and the room's edges."""

    def __init__(self, scene: viser.SceneApi, layout: Layout) -> None:
        colours = {"floor": rgb(FLOOR), "ceiling": rgb(PAPER), "wall": mixed(FLOOR, WALL, 0.18)}
        self._handles: dict[str, list[viser.MeshHandle]] = {"floor": [], "ceiling": [], "wall": []}
        for surface in room_surfaces(layout):
            handle = scene.add_mesh_simple(
                f"/room/{surface.name}",
                _array(surface.vertices),
                surface.faces.cpu().numpy(),
                color=colours[surface.kind],
                flat_shading=True,
                side="front",
                cast_shadow=False,
                receive_shadow=surface.kind == "floor",
                visible=surface.kind != "ceiling",
            )
            self._handles[surface.kind].append(handle)
        scene.add_line_segments(
            "/room/edges",
            _room_edges(layout),
            rgb(WALL),
            thickness=1.6,
            thickness_units="screen",
        )

    def show(self, kind: str, visible: bool) -> None:
        """Show or hide ``floor``, ``ceiling`` or ``wall``."""
        for handle in self._handles[kind]:
            handle.visible = visible


@dataclass(frozen=True, slots=True)
class Look:
    """How one object is shown."""

    category: str
    text: str
    selected: bool = False
    labelled: bool = True
    see_through: bool = False
    trouble: int = 0
    """0 for none; 1 from a centimetre of overlap or outside the room; 2 from the ten that count."""


class ObjectDrawing:
    """One object: its shape or box, edges, front and name."""

    def __init__(
        self, scene: viser.SceneApi, path: str, mesh: Mesh, *, box: OrientedBoxes, look: Look,
        on_click: Callable[[], None],
    ) -> None:  # fmt: skip
        self._look = look
        self._box = box
        self._frame = scene.add_frame(path, show_axes=False)
        is_box = len(mesh.faces) <= 12
        self._mesh = scene.add_mesh_simple(
            f"{path}/shape",
            _array(mesh.vertices),
            mesh.faces.cpu().numpy(),
            flat_shading=is_box,
            side="double",
        )
        self._edges = scene.add_line_segments(
            f"{path}/edges",
            _UNIT_CORNERS[np.array(_EDGES)],
            rgb(INK),
            thickness_units="screen",
        )
        self._front = scene.add_line_segments(
            f"{path}/front",
            _FRONT,
            rgb(INK),
            thickness=3.0,
            thickness_units="screen",
        )
        self._label = scene.add_label(
            f"{path}/name", look.text, anchor="bottom-center", font_screen_scale=0.9
        )
        self._mesh.on_click(lambda _: on_click())
        self._place(box)
        self._dress(look)

    def update(self, box: OrientedBoxes, look: Look) -> None:
        """Show the object with another box or look; nothing is sent that stays the same."""
        if not _same(box, self._box):
            self._place(box)
        if look != self._look:
            self._dress(look)

    def remove(self) -> None:
        """Take the object out of the scene."""
        self._frame.remove()

    def _place(self, box: OrientedBoxes) -> None:
        self._box = box
        x, y, z = box.centre.tolist()
        width, depth, height = box.size.tolist()
        self._frame.position = (x, y, z)
        self._frame.wxyz = quaternion(float(box.yaw))
        for handle in (self._mesh, self._edges, self._front):
            handle.scale = (width, depth, height)
        self._label.position = (0.0, 0.0, height / 2 + 0.04)

    def _dress(self, look: Look) -> None:
        self._look = look
        colour = GROUP_COLOURS[group_of(look.category)]
        self._mesh.color = mixed(colour, ALARM, 0.6 if look.trouble == 2 else 0.0)
        self._mesh.opacity = SEE_THROUGH if look.see_through else None
        edge = rgb(ALARM if look.trouble else INK)
        self._edges.colors = np.array(edge, dtype=np.uint8)
        self._edges.thickness = 4.0 if look.selected else 2.5 if look.trouble else 1.0
        self._front.visible = look.category not in NO_FRONT
        self._label.text = f"! {look.text}" if look.trouble else look.text
        self._label.visible = look.labelled or look.selected


class SceneDrawing:
    """All objects of a scene, kept in step with it."""

    def __init__(self, scene: viser.SceneApi, select: Callable[[str], None]) -> None:
        self._scene = scene
        self._select = select
        self._objects: dict[str, ObjectDrawing] = {}
        self._made = 0

    def update(
        self,
        scene: Scene,
        selected: str | None,
        trouble: Float[Tensor, " n"],
        *,
        labels: bool,
        see_through: bool = False,
    ) -> None:
        """Show the scene as it is, with one object selected and some in trouble, in metres."""
        names = scene.objects.id
        bounds = torch.tensor([SHOWN_FROM, COUNTED_FROM]).to(trouble)
        degrees = torch.bucketize(trouble, bounds, right=True).tolist()
        for name in [name for name in self._objects if name not in names]:
            self._objects.pop(name).remove()
        for k, name in enumerate(names):
            category = CATEGORIES[int(scene.objects.category[k])]
            look = Look(category, name, name == selected, labels, see_through, degrees[k])
            box = scene.objects.boxes[k]
            if name in self._objects:
                self._objects[name].update(box, look)
                continue
            # names are anybody's text, so nodes are numbered
            self._made += 1
            path, mesh = f"/objects/object-{self._made}", object_mesh(scene.objects, k)
            self._objects[name] = ObjectDrawing(
                self._scene,
                path,
                mesh,
                box=box,
                look=look,
                on_click=lambda name=name: self._select(name),
            )


def draw_ghost(scene: viser.SceneApi, boxes: OrientedBoxes) -> viser.LineSegmentsHandle | None:
    """Return the hidden outlines of boxes as they once were; None where there are none."""
    if len(boxes) == 0:
        return None
    lines = _array(box_corners(boxes))[:, np.array(_EDGES)].reshape(-1, 2, 3)
    return scene.add_line_segments(
        "/ghost", lines, rgb(REFERENCE), thickness=1.2, thickness_units="screen", visible=False
    )


def _room_edges(layout: Layout) -> Float[np.ndarray, "edges 2 3"]:
    corners = _array(layout.floor_polygon)
    low = np.column_stack([corners, np.full(len(corners), layout.floor_height)])
    high = np.column_stack([corners, np.full(len(corners), layout.ceiling_height)])
    pairs = [(low, np.roll(low, -1, 0)), (high, np.roll(high, -1, 0)), (low, high)]
    return np.concatenate([np.stack(pair, 1) for pair in pairs]).astype(np.float32)


def _array(tensor: Float[Tensor, "*shape"]) -> Float[np.ndarray, "*shape"]:
    return tensor.detach().cpu().numpy().astype(np.float32)


def _same(a: OrientedBoxes, b: OrientedBoxes) -> bool:
    return bool((a.centre == b.centre).all() and (a.size == b.size).all() and a.yaw == b.yaw)
