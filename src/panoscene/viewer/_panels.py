"""The controls beside the 3D view."""

import math
from pathlib import Path

import viser

from panoscene.scene import CATEGORIES

from ._editor import Editor
from ._measurement import Measurement, measure_scene
from ._tables import (
    certificate_text,
    relations_table,
    trouble_list,
    turns_table,
    violations_table,
)

NOTHING = "(nothing)"
"""What the list of objects says when none is selected."""
UNDO, REDO, RESTART = HISTORY = ("Undo", "Redo", "To the start")
OVERVIEW, ABOVE, CAMERA = VIEWS = ("Overview", "From above", "From camera")
PRESET_ORDER = ("default", "released", "paper")


class Panels:
    """Every control, and what they show."""

    def __init__(
        self, gui: viser.GuiApi, editor: Editor, *, photo: bool, save_to: Path | None
    ) -> None:
        self._opened = measure_scene(editor.opened).violations
        with gui.add_folder("Certificate"):
            self.history = gui.add_button_group("History", HISTORY, hint="Ctrl+Z, Ctrl+Shift+Z")
            self.preset = gui.add_dropdown(
                "Preset", PRESET_ORDER, hint="default is never worse than what it starts from"
            )
            # above what changes its height, so that it stays under the pointer
            self.solve = gui.add_button(
                "Solve",
                icon=viser.Icon.WAND,
                hint="Move boxes out of each other and into the room",
            )
            self.violations = gui.add_markdown("")
            self.troubles = gui.add_markdown("")
        with gui.add_folder("Last solve", visible=False) as self.solved:
            self.certificate = gui.add_markdown("")
        self._build_object(gui)
        self._build_view(gui, photo)
        with gui.add_folder("File"):
            words = "Save" if save_to is None else f"Save {save_to.name}"
            self.save = gui.add_button(
                words, icon=viser.Icon.DEVICE_FLOPPY, visible=save_to is not None
            )
            self.download = gui.add_button("Download scene.json", icon=viser.Icon.DOWNLOAD)

    def _build_object(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Object"):
            self.selected = gui.add_dropdown(
                "Selected", [NOTHING], hint="Or click an object in the 3D view; Escape lets go"
            )
            self.hint = gui.add_markdown("Click an object to move, turn or delete it.")
            with gui.add_folder(None, visible=False) as self.object:
                self.category = gui.add_dropdown("Category", CATEGORIES)
                self.centre = gui.add_vector3(
                    "Centre, m", (0.0, 0.0, 0.0), step=0.01, hint="World x, y, z of the centre"
                )
                self.yaw = gui.add_slider(
                    "Yaw, °", -180.0, 180.0, 1.0, 0.0, hint="Counter-clockwise seen from above"
                )
                self.size = gui.add_vector3(
                    "Size, m", (1.0, 1.0, 1.0), step=0.01, min=(0.01, 0.01, 0.01),
                    hint="Width, depth, height",
                )  # fmt: skip
                self.duplicate = gui.add_button("Duplicate", icon=viser.Icon.COPY, hint="D")
                self.delete = gui.add_button(
                    "Delete", icon=viser.Icon.TRASH, color="red", hint="Delete"
                )
                self.relations = gui.add_markdown("")
                with gui.add_folder("Turns and distances", expand_by_default=False):
                    self.turns = gui.add_markdown("")

    def _build_view(self, gui: viser.GuiApi, photo: bool) -> None:
        with gui.add_folder("View"):
            self.camera = gui.add_button_group("Look", VIEWS)
            self.photo = gui.add_checkbox("Photo instead of the room", False, visible=photo)
            self.walls = gui.add_checkbox("Walls", True, hint="They are seen from inside only")
            self.ceiling = gui.add_checkbox("Ceiling", False)
            self.labels = gui.add_checkbox("Names", True)
            self.ghost = gui.add_checkbox("Outlines of the start", False)

    def show_editor(self, editor: Editor, selected: str | None) -> None:
        """Show the history and the numbers of the selected object."""
        certificate = editor.state.certificate
        self.solved.visible = certificate is not None
        if certificate is not None:
            self.certificate.content = certificate_text(certificate)
        options = (NOTHING, *editor.names)
        if self.selected.options != options:
            self.selected.options = options
        self.selected.value = selected or NOTHING
        self.hint.visible = selected is None and bool(editor.names)
        self.object.visible = selected is not None
        if selected is None:
            return
        index = editor.index(selected)
        box = editor.scene.objects.boxes[index]
        x, y, z = (round(number, 4) for number in box.centre.tolist())
        self.centre.value = (x, y, z)
        width, depth, height = (round(number, 4) for number in box.size.tolist())
        self.size.value = (width, depth, height)
        self.yaw.value = round(math.degrees(float(box.yaw)), 2)
        self.category.value = CATEGORIES[int(editor.scene.objects.category[index])]

    def show_measurement(self, editor: Editor, selected: str | None, found: Measurement) -> None:
        """Show what is wrong with the scene, and the relations of the selected object."""
        titles = ("Opened", "Now")
        self.violations.content = violations_table(self._opened, found.violations, titles)
        self.troubles.content = trouble_list(editor.scene, found)
        if selected is not None and selected in editor.names:
            self.relations.content = relations_table(editor, selected, found)
            self.turns.content = turns_table(editor, selected, found)
