"""The files that say what is on a photo."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from panoscene.cli._account import account
from panoscene.cli._draw import draw_inside, draw_outside
from panoscene.cli._files import write_together
from panoscene.cli._reconstruct import ACCOUNT, SCENE, account_of_photo
from panoscene.cli._terminal import json_text
from panoscene.exports import write_floor_plan_svg, write_glb
from panoscene.pipeline import Reconstruction
from panoscene.scene import relocate_photo, write_scene
from panoscene.views import draw_birds_eye, draw_overlay, write_report

TEXTURE = 64.0
"""Pixels for each metre of the painted room: those of the panorama at 2.5 m."""
FORGIVEN = 0.1
"""Metres of overlap that are not shown: what is estimated is not exact to the centimetre, and the
arrangement lets as much be. The paper's counts forgive as much, too."""


class Results:
    """Everything about a photo, in drafts until all is drawn."""

    def __init__(self, placed: Reconstruction, artist: Executor, drafts: Path) -> None:
        self._artist, self._drafts = artist, drafts
        self._placed = artist.submit(_draw_placed, _lean(placed), drafts)

    def write(self, result: Reconstruction, photo: Path, folder: Path) -> None:
        """Draw what shows meshes, then write everything, the scene last."""
        drafts, scene = self._drafts, result.scene
        shaped = self._artist.submit(_draw_shaped, _lean(result), drafts)
        draw_inside(scene, drafts)
        write_glb(scene, drafts / "scene.glb", image=result.image, texture_px_per_metre=TEXTURE)
        head = {"schema": "panoscene/reconstruction", "version": 1, **account_of_photo(photo)}
        document = head | account(result)
        (drafts / ACCOUNT).write_text(json_text(document) + "\n", encoding="utf-8")
        scene = relocate_photo(scene, photo.resolve(), folder.resolve() / SCENE)
        write_scene(scene, drafts / SCENE)
        for drawn in (self._placed, shaped):
            drawn.result()
        found = sorted(drafts.iterdir(), key=lambda path: (path.name == SCENE, path.name))
        write_together(folder, {draft.name: draft.read_bytes() for draft in found})


@contextmanager
def results(placed: Reconstruction, artist: Executor) -> Iterator[Results]:
    """Begin to draw the results of a photo, and give what draws the rest and writes them.

    Args:
        placed: The scene, whose objects need not have their meshes yet.
        artist: Draws a part of the pictures while this process does something else.
    """
    # an artist that is interrupted may still be writing
    with TemporaryDirectory(prefix="panoscene-", ignore_cleanup_errors=True) as drafts:
        yield Results(placed, artist, Path(drafts))


def _lean(result: Reconstruction) -> Reconstruction:
    """Return a result without the signals of the layout, which nobody draws."""
    return replace(result, layout=None)


def _draw_placed(placed: Reconstruction, drafts: Path) -> None:
    scene, slack = placed.scene, FORGIVEN
    draw_birds_eye(scene, drafts / "birds-eye.png", tolerance=slack)
    draw_overlay(scene, drafts / "overlay.png", image=placed.image, tolerance=slack)
    write_floor_plan_svg(placed.scene, drafts / "floorplan.svg")


def _draw_shaped(result: Reconstruction, drafts: Path) -> None:
    draw_outside(result.scene, drafts)
    write_report(
        drafts / "report.html",
        result.scene,
        image=result.image,
        before=result.initial,
        certificate=result.certificate,
        timings=result.timings,
        title=result.scene.name,
        notes=result.doubts,
        tolerance=FORGIVEN,
    )
