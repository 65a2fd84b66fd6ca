"""A scene being edited: frozen states, operations that return new ones, undo and redo."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch

from panoscene.arrange import ArrangementSettings, Certificate, arrange
from panoscene.geometry import OrientedBoxes, polygon_contains, wrap_angle
from panoscene.scene import CATEGORIES, Scene, category_index, object_names, select

from ._objects import with_box, with_relations

MOST_STATES = 200
"""States that undo remembers."""
GAP = 0.1
"""Metres between an object and its duplicate."""


@dataclass(frozen=True, slots=True)
class EditState:
    """The scene at one moment, and what led there."""

    scene: Scene
    """Its relations are the wanted ones: those that were given, and for objects that somebody
    placed, those of the place."""
    action: str = "opened"
    """In words, such as ``moved sofa-1``."""
    certificate: Certificate | None = None
    """When a solve led here."""


@dataclass(frozen=True, slots=True)
class Editor:
    """A scene being edited. It never changes: every operation returns the editor after it.

    Objects are called by their names (``object_names`` of the scene that was opened), which stay
    the same when others are deleted.

    Examples:
        >>> from panoscene.sample import sample_room_path
        >>> from panoscene.scene import read_scene
        >>> editor = Editor.open(read_scene(sample_room_path()))
        >>> moved = editor.place("bed_7", yaw=0.5)
        >>> moved.state.action, moved.undo().scene is editor.scene
        ('turned bed_7', True)
    """

    opened: Scene
    state: EditState
    past: tuple[EditState, ...] = ()
    """What undo returns to, the oldest first."""
    future: tuple[EditState, ...] = ()
    """What redo returns to, the next first."""
    gesture: str = ""
    """The drag or slide that is going on; all its changes are undone as one."""

    @staticmethod
    def open(scene: Scene) -> "Editor":
        """Return an editor of a scene.

        Objects without ids get their names as ids; relations that are missing are derived from
        the boxes.

        Raises:
            ValueError: the scene has no relations and they cannot be derived.
        """
        objects = replace(scene.objects, id=object_names(scene.objects))
        known = with_relations(replace(scene, objects=objects))
        return Editor(known, EditState(known))

    @property
    def scene(self) -> Scene:
        """The scene as it stands."""
        return self.state.scene

    @property
    def names(self) -> tuple[str, ...]:
        """The objects' names, in the scene's order."""
        return self.scene.objects.id

    def index(self, name: str) -> int:
        """Return the place of an object in the scene.

        Raises:
            ValueError: there is no object of that name.
        """
        if name not in self.names:
            raise ValueError(f"name: found {name[:60]!r}, expected one of the objects' names")
        return self.names.index(name)

    def place(
        self,
        name: str,
        *,
        centre: Sequence[float] | None = None,
        size: Sequence[float] | None = None,
        yaw: float | None = None,
        gesture: str = "",
    ) -> "Editor":
        """Return the editor after an object was moved, resized or turned.

        Args:
            name: the object.
            centre: world x, y, z in metres, or None to leave it.
            size: full extents (width, depth, height) in metres, or None to leave them.
            yaw: radians counter-clockwise from above, or None to leave it.
            gesture: a name for the drag that this is part of; undo takes back all of it.

        Raises:
            ValueError: no such object, or a number that is not finite or a size not above 0.
        """
        index = self.index(name)
        old = self.scene.objects.boxes[index]
        new = OrientedBoxes(
            old.centre if centre is None else old.centre.new_tensor(_numbers("centre", centre)),
            old.size if size is None else old.size.new_tensor(_numbers("size", size)),
            old.yaw if yaw is None else wrap_angle(old.yaw.new_tensor(_numbers("yaw", [yaw])[0])),
        )
        if not bool((new.size > 0).all()):
            raise ValueError(f"size: found {new.size.tolist()}, expected metres above 0")
        parts = {
            "moved": (old.centre, new.centre),
            "resized": (old.size, new.size),
            "turned": (old.yaw, new.yaw),
        }
        changes = [word for word, (a, b) in parts.items() if not torch.equal(a, b)]
        if not changes:
            return self
        action = f"{' and '.join(changes)} {name}"
        return self._then(with_box(self.scene, index, new), action, gesture=gesture)

    def delete(self, name: str) -> "Editor":
        """Return the editor after an object was removed; all other relations stay.

        Raises:
            ValueError: there is no object of that name.
        """
        gone = self.index(name)
        rest = [k for k in range(len(self.names)) if k != gone]
        index = torch.tensor(rest, dtype=torch.int64)
        return self._then(select(self.scene, index), f"deleted {name}")

    def duplicate(self, name: str) -> "Editor":
        """Return the editor after a copy of an object was put to its side, as the last object.

        Raises:
            ValueError: there is no object of that name.
        """
        source, count = self.index(name), len(self.names)
        scene = select(self.scene, torch.tensor([*range(count), source]))
        copy = self._free_name(CATEGORIES[int(self.scene.objects.category[source])])
        objects = replace(scene.objects, id=(*self.names, copy))
        box = self._beside(self.scene.objects.boxes[source])
        scene = with_box(replace(scene, objects=objects), count, box)
        return self._then(scene, f"duplicated {name}")

    def categorise(self, name: str, category: str) -> "Editor":
        """Return the editor after an object was said to be of another category.

        Raises:
            ValueError: no such object, or no such category.
        """
        index, wanted = self.index(name), category_index(category)
        old = self.scene.objects
        if int(old.category[index]) == wanted:
            return self
        changed = old.category.clone()
        changed[index] = wanted
        scene = replace(self.scene, objects=replace(old, category=changed))
        return self._then(scene, f"called {name} {category}")

    def solve(self, settings: ArrangementSettings | str = "default") -> "Editor":
        """Return the editor after the arrangement optimiser ran from the current boxes.

        Wanted relations are the given ones, and for objects that somebody placed those of the
        place. The state carries the certificate, also when nothing changed.

        Raises:
            ValueError: an unknown preset, or a scene that cannot be arranged.
        """
        result = arrange(self.scene, settings)
        certificate = result.certificate
        if not certificate.changed:
            return replace(self, state=replace(self.state, certificate=certificate), gesture="")
        return self._then(result.scene, f"solved ({certificate.preset})", certificate)

    def restart(self) -> "Editor":
        """Return the editor with the scene as it was opened; can be undone."""
        if self.scene is self.opened:
            return self
        return self._then(self.opened, "returned to the start")

    def undo(self) -> "Editor":
        """Return the editor before the last change, or itself if there is none."""
        if not self.past:
            return self
        future = (self.state, *self.future)
        return Editor(self.opened, self.past[-1], self.past[:-1], future)

    def redo(self) -> "Editor":
        """Return the editor after the change that was undone last, or itself if there is none."""
        if not self.future:
            return self
        return Editor(self.opened, self.future[0], (*self.past, self.state), self.future[1:])

    def _then(
        self, scene: Scene, action: str, certificate: Certificate | None = None, gesture: str = ""
    ) -> "Editor":
        """Return the editor after one more change; the same gesture replaces the last one."""
        going_on = bool(gesture) and gesture == self.gesture and bool(self.past)
        past = self.past if going_on else (*self.past, self.state)[-MOST_STATES:]
        return Editor(self.opened, EditState(scene, action, certificate), past, (), gesture)

    def _free_name(self, category: str) -> str:
        names = set(self.names) | set(self.opened.objects.id)
        return next(name for k in range(len(names) + 1) if (name := f"{category}-{k}") not in names)

    def _beside(self, box: OrientedBoxes) -> OrientedBoxes:
        """Return the box moved to its right, or to its left where that stays in the room."""
        right = torch.stack([box.yaw.cos(), box.yaw.sin(), torch.zeros_like(box.yaw)])
        step = right * (box.size[0] + GAP)
        centres = torch.stack([box.centre + step, box.centre - step])
        polygon = self.scene.layout.floor_polygon.to(centres)
        inside = polygon_contains(centres[:, :2], polygon).tolist()
        return replace(box, centre=centres[1 if inside == [False, True] else 0])


def _numbers(field: str, values: Sequence[float]) -> list[float]:
    numbers = [float(value) for value in values]
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"{field}: found {numbers}, expected finite numbers")
    return numbers
