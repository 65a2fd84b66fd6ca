"""The live editor: what people do in the browser to edits, and edits to what they see."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
import viser
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import OrientedBoxes
from panoscene.scene import Scene, SceneFormatError, write_scene

from ._cameras import aim, view_of
from ._drawing import RoomDrawing, SceneDrawing, draw_ghost, quaternion, yaw_of
from ._editor import Editor
from ._measurement import Measurement, measure_scene
from ._panels import NOTHING, REDO, RESTART, UNDO, Panels
from ._photo import draw_photo
from ._saving import scene_bytes

SLIDE = 1.0
"""Seconds without a change after which the next one of the same control is a step of its own."""
GIZMO = 0.35
"""Metres by which the arrows reach out of an object."""

Act = Callable[[Any], None]
"""What a control does; it is given the client who used it, None for a program."""


class ViewerApp:
    """One scene, edited by everybody who is connected.

    Everything that viser calls comes from its threads, so ``_lock`` is held while anything
    changes. Measuring takes tens of milliseconds: a thread of its own measures the latest state
    and leaves out those in between, so that the panels follow a drag without holding it up.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        scene: Scene,
        image: Float[Tensor, "3 height width"] | None = None,
        save_to: Path | None = None,
    ) -> None:
        self._server = server
        self._save_to = save_to
        self._lock = threading.RLock()
        self._news = threading.Condition(self._lock)
        self._editor = Editor.open(scene)
        self._measured = (self._editor, measure_scene(self._editor.scene))
        self._selected: str | None = None
        self._showing = False
        self._stopped = False
        self._dragged: viser.TransformControlsHandle | None = None
        self._gestures = 0
        self._slide = ("", 0.0)
        self.panels = Panels(server.gui, self._editor, photo=image is not None, save_to=save_to)
        self._room = RoomDrawing(server.scene, scene.layout)
        self._objects = SceneDrawing(server.scene, self.select)
        self._ghost = draw_ghost(server.scene, scene.objects.boxes)
        self._photo = None if image is None else draw_photo(server.scene, image, scene)
        self.mover, self.lifter = self._gizmos()
        view = view_of("Overview", scene)
        server.initial_camera.fov = view.fov
        server.initial_camera.position = view.position
        server.initial_camera.look_at = view.look_at
        server.scene.configure_default_lights(cast_shadow=False)
        server.scene.configure_environment_map(None)
        # sides in the shade keep the colours of their groups
        server.scene.add_light_ambient("/light", intensity=2.0)
        self._wire()
        self._show()
        self._thread = threading.Thread(target=self._keep_measuring, daemon=True)
        self._thread.start()

    @property
    def editor(self) -> Editor:
        """The scene, and what undo needs."""
        return self._editor

    @property
    def selected(self) -> str | None:
        """The name of the selected object."""
        return self._selected

    def select(self, name: str | None) -> None:
        """Select an object, or none."""
        with self._lock:
            if self._selected != name:
                self._selected = name
                self._dragged = None
                self._show()

    def change(self, operation: Callable[[Editor], Editor], client: Any = None) -> None:
        """Replace the editor by what an operation makes of it, and show that.

        What is not possible is told to the client; nothing changes then.

        Raises:
            ValueError: the operation is not possible, and there is no client to tell.
        """
        with self._lock:
            try:
                self._editor = operation(self._editor)
            except ValueError as error:
                if client is None:
                    raise
                client.add_notification("Not possible", str(error), color="red")
            self._show()
            self._news.notify_all()

    def settle(self, timeout: float = 10.0) -> Measurement:
        """Return what is wrong with the scene as it stands, once that is measured and shown.

        Raises:
            TimeoutError: it took too long.
        """
        with self._news:
            if not self._news.wait_for(lambda: self._measured[0] is self._editor, timeout):
                raise TimeoutError(f"the scene was not measured within {timeout} s")
            return self._measured[1]

    def stop(self) -> None:
        """End the thread that measures."""
        with self._news:
            self._stopped = True
            self._news.notify_all()
        self._thread.join()

    # What is shown

    @contextmanager
    def _quietly(self) -> Iterator[None]:
        """Set controls without taking that for a wish: their callbacks run right away."""
        before, self._showing = self._showing, True
        try:
            with self._server.atomic():
                yield
        finally:
            self._showing = before

    def _show(self) -> None:
        """Show editor, selection and the newest measurement."""
        if self._selected not in self._editor.names:
            self._selected = None
        with self._quietly():
            self.panels.show_editor(self._editor, self._selected)
            self._show_gizmos()
            self._show_measurement()

    def _show_measurement(self) -> None:
        editor, found = self._measured
        self.panels.show_measurement(editor, self._selected, found)
        # indices of another set of objects mean nothing
        trouble = torch.zeros(len(self._editor.names))
        if editor.names == self._editor.names:
            trouble = found.trouble
        self._objects.update(
            self._editor.scene,
            self._selected,
            trouble,
            labels=self.panels.labels.value,
            see_through=self.panels.photo.value,
        )

    def _show_gizmos(self) -> None:
        name = self._selected
        for gizmo in (self.mover, self.lifter):
            if name is not None and gizmo is not self._dragged:
                box = self._editor.scene.objects.boxes[self._editor.index(name)]
                x, y, z = box.centre.tolist()
                z += _lift(box)
                gizmo.scale = GIZMO + round(float(box.size.max()) / 2, 2)
                if tuple(gizmo.position) != (x, y, z):
                    gizmo.position = (x, y, z)
                if abs(yaw_of(gizmo.wxyz) - float(box.yaw)) > 1e-6:
                    gizmo.wxyz = quaternion(float(box.yaw))
            if gizmo.visible != (name is not None):
                gizmo.visible = name is not None

    def _keep_measuring(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._stopped or self._measured[0] is not self._editor)
                if self._stopped:
                    return
                editor = self._editor
            found = measure_scene(editor.scene)
            with self._news:
                self._measured = (editor, found)
                with self._quietly():
                    self._show_measurement()
                self._news.notify_all()

    def _show_room(self) -> None:
        photo = self._photo is not None and self.panels.photo.value
        if self._photo is not None:
            self._photo.visible = photo
        self._room.show("floor", not photo)
        self._room.show("wall", self.panels.walls.value and not photo)
        self._room.show("ceiling", self.panels.ceiling.value and not photo)
        if self._ghost is not None:
            self._ghost.visible = self.panels.ghost.value
        self._show()

    # What people do

    def _gizmos(self) -> tuple[viser.TransformControlsHandle, viser.TransformControlsHandle]:
        """Return arrows that move and turn on the floor, and one that lifts: no other turns."""
        add = self._server.scene.add_transform_controls
        mover = add("/mover", active_axes=(True, True, False), depth_test=False, visible=False)
        lifter = add("/lifter", active_axes=(False, False, True), depth_test=False, visible=False)
        for gizmo in (mover, lifter):
            gizmo.on_update(self._on_drag)
        return mover, lifter

    async def _on_drag(self, event: viser.TransformControlsEvent) -> None:
        """Follow a drag; being async, start, updates and end come in order."""
        gizmo = event.target
        with self._lock:
            if event.phase == "start":
                self._gestures += 1
                self._dragged = gizmo
            name = self._selected
            if name is not None and gizmo is self._dragged and event.phase != "start":
                x, y, z = gizmo.position.tolist()
                box = self._editor.scene.objects.boxes[self._editor.index(name)]
                centre, yaw = (x, y, z - _lift(box)), yaw_of(gizmo.wxyz)
                gesture = f"drag {self._gestures}"
                self.change(
                    lambda e: e.place(name, centre=centre, yaw=yaw, gesture=gesture), event.client
                )
            if event.phase == "end":
                self._dragged = None
                self._show()

    def _wire(self) -> None:
        """Connect every control to what it does."""
        panels = self.panels
        history = {UNDO: Editor.undo, REDO: Editor.redo, RESTART: Editor.restart}
        panels.history.on_click(
            lambda event: self.change(history[panels.history.value], event.client)
        )
        add = self._server.gui.add_command
        for command in (
            add(UNDO, hotkey="Z", modifier="cmd/ctrl"),
            add(REDO, hotkey="Z", modifier="cmd/ctrl+shift"),
        ):
            command.on_trigger(lambda event: self.change(history[event.target.label], event.client))
        self._button(panels.solve, self._solve, "Solve")
        self._button(panels.delete, self._on_selected(Editor.delete), "Delete object", "delete")
        self._button(panels.duplicate, self._on_selected(Editor.duplicate), "Duplicate object")
        self._button(panels.save, self._save, "Save" if self._save_to else None)
        self._button(panels.download, self._download, "Download scene.json")
        self._server.gui.add_command("Select nothing", hotkey="escape").on_trigger(
            lambda _: self.select(None)
        )
        self._input(panels.selected, lambda _: self.select(_name(panels.selected.value)))
        self._input(panels.centre, lambda c: self._slid("centre", c))
        self._input(panels.size, lambda c: self._slid("size", c))
        self._input(panels.yaw, lambda c: self._slid("yaw", c))
        self._input(
            panels.category,
            self._on_selected(lambda e, name: e.categorise(name, panels.category.value)),
        )
        for toggle in (panels.photo, panels.walls, panels.ceiling, panels.ghost):
            self._input(toggle, lambda _: self._show_room())
        self._input(panels.labels, lambda _: self._show())
        panels.camera.on_click(lambda event: self._look(event.client))

    def _button(self, button: Any, act: Act, label: str | None, hotkey: Any = None) -> None:
        """Connect a button, and a command of the palette with a key."""
        button.on_click(lambda event: act(event.client))
        if label is not None:
            command = self._server.gui.add_command(label, hotkey=hotkey)
            command.on_trigger(lambda event: act(event.client))

    def _input(self, control: Any, act: Act) -> None:
        def react(event: Any) -> None:
            with self._lock:
                if not self._showing:
                    act(event.client)

        control.on_update(react)

    def _on_selected(self, operation: Callable[[Editor, str], Editor]) -> Act:
        def act(client: Any) -> None:
            with self._lock:
                if (name := self._selected) is not None:
                    self.change(lambda editor: operation(editor, name), client)

        return act

    def _slid(self, field: str, client: Any) -> None:
        """Take the numbers of the panel, those that differ from what it was told to show."""
        name, panels = self._selected, self.panels
        if name is None:
            return
        slide = f"{field} {name}"
        if slide != self._slide[0] or time.monotonic() - self._slide[1] > SLIDE:
            self._gestures += 1
        self._slide = (slide, time.monotonic())
        wishes: dict[str, Any] = {"yaw": math.radians(panels.yaw.value)}
        if field != "yaw":
            box = self._editor.scene.objects.boxes[self._editor.index(name)]
            exact = getattr(box, field).tolist()
            shown = zip(exact, getattr(panels, field).value, strict=True)
            wishes[field] = [old if round(old, 4) == new else new for old, new in shown]
        gesture = f"{slide} {self._gestures}"
        self.change(lambda e: e.place(name, **{field: wishes[field]}, gesture=gesture), client)

    def _solve(self, client: Any) -> None:
        preset = self.panels.preset.value
        with self._lock:
            self.panels.solve.disabled = True
            try:
                self.change(lambda editor: editor.solve(preset), client)
            finally:
                self.panels.solve.disabled = False

    def _look(self, client: Any) -> None:
        view = view_of(self.panels.camera.value, self._editor.opened)
        clients = self._server.get_clients().values() if client is None else [client]
        for each in clients:
            aim(each, view)

    def _save(self, client: Any) -> None:
        if self._save_to is None:
            return
        try:
            write_scene(self._editor.scene, self._save_to)
        except (OSError, SceneFormatError) as error:
            if client is None:
                raise
            client.add_notification("Not saved", str(error), color="red")
            return
        if client is not None:
            client.add_notification("Saved", str(self._save_to), auto_close_seconds=4.0)

    def _download(self, client: Any) -> None:
        if client is not None:
            content = scene_bytes(self._editor.scene)
            client.send_file_download("scene.json", content, save_immediately=True)


def _lift(box: OrientedBoxes) -> float:
    """Return the metres from the centre to just above the top, where the object hides no arrow."""
    return float(box.size[2]) / 2 + 0.02


def _name(value: str) -> str | None:
    return None if value == NOTHING else value
