"""The files that say what is on a photo."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

from panoscene.cli._account import SCENE, account
from panoscene.cli._draw import draw_renderings
from panoscene.cli._files import write_bytes
from panoscene.cli._terminal import json_text
from panoscene.exports import write_floor_plan_svg, write_glb
from panoscene.pipeline import Reconstruction
from panoscene.scene import relocate_photo, write_scene
from panoscene.views import draw_birds_eye, draw_overlay, write_report

TEXTURE = 64.0
"""Pixels for each metre of the painted room: those of the panorama at 2.5 m."""


def write_results(result: Reconstruction, photo: Path, folder: Path) -> None:
    """Write everything about a photo, the scene last; all is drawn before the first is written."""
    with TemporaryDirectory(prefix="panoscene-") as name:
        drafts = Path(name)
        # rays and pictures leave the interpreter to the other thread most of the time
        with ThreadPoolExecutor(max_workers=1) as pool:
            painted = pool.submit(_paint, result, drafts)
            _describe(result, drafts, photo, folder)
            painted.result()
        for draft in sorted(drafts.iterdir(), key=lambda path: (path.name == SCENE, path.name)):
            write_bytes(folder / draft.name, draft.read_bytes())


def _paint(result: Reconstruction, drafts: Path) -> None:
    draw_renderings(result.scene, drafts)
    write_glb(result.scene, drafts / "scene.glb", image=result.image, texture_px_per_metre=TEXTURE)


def _describe(result: Reconstruction, drafts: Path, photo: Path, folder: Path) -> None:
    """Draw what matplotlib draws, which is for one thread, and write what is text."""
    scene = result.scene
    draw_birds_eye(scene, drafts / "birds-eye.png")
    draw_overlay(scene, drafts / "overlay.png", image=result.image)
    write_floor_plan_svg(scene, drafts / "floorplan.svg")
    write_report(
        drafts / "report.html",
        scene,
        image=result.image,
        before=result.initial,
        certificate=result.certificate,
        timings=result.timings,
        title=scene.name,
        notes=result.doubts,
    )
    document = {"schema": "panoscene/reconstruction", "version": 1, **account(result)}
    (drafts / "reconstruction.json").write_text(json_text(document) + "\n", encoding="utf-8")
    write_scene(relocate_photo(scene, photo.resolve(), folder.resolve() / SCENE), drafts / SCENE)
