"""One HTML file that shows a scene from every side, without network."""

import base64
import hashlib
import html
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene import __version__
from panoscene.arrange import Certificate
from panoscene.scene import Relations, Scene, relations_from_boxes, write_atomically
from panoscene.views._birds_eye import describe_room
from panoscene.views._pieces import TOLERANCE
from panoscene.views._report_colours import palette_style
from panoscene.views._report_data import report_data
from panoscene.views._report_photo import photo_address

FOLDER = Path(__file__).with_name("report")
"""Page, script and style; ``web/build.mjs`` makes them."""


def write_report(
    path: str | os.PathLike[str],
    scene: Scene,
    *,
    image: Float[Tensor, "3 height width"] | Path | None = None,
    image_caption: str = "",
    before: Scene | None = None,
    certificate: Certificate | None = None,
    timings: Mapping[str, float] | None = None,
    title: str = "",
    notes: Sequence[str] = (),
    tolerance: float = TOLERANCE,
) -> None:
    """Write a page that shows a scene in a panorama, in 3D, from above and in tables.

    The page is one file that opens from disk and loads nothing: its Content-Security-Policy
    forbids the network. What is selected in one view is selected in all of them.

    Args:
        path: file to write; it appears complete or not at all.
        scene: what to show. Without relations it gets those that follow from its boxes, and the
            page says so.
        image: the panorama, RGB in [0, 1], or its file; at most 2048 columns are kept. Boxes are
            drawn on plain grey when it is None.
        image_caption: what the panorama is, such as "Rendered from the boxes".
        before: the same objects with the boxes that they had before; the page switches between
            both, and outlines the other one.
        certificate: what the repair is worth.
        timings: seconds by the name of the stage, in their order.
        title: heading; the scene's name when empty.
        notes: sentences below the heading.
        tolerance: metres of overlap, or of sticking out of the room, from which the tables tell.

    Raises:
        ValueError: boxes, corners or timings that are not finite, a floor polygon that is not
            simple, another number of objects before, or an image that is not a full panorama.
        PanoramaError: the image's file cannot be read.
    """
    timings = {} if timings is None else timings
    _check(scene, before, timings)
    relations, relations_caption = _relations(scene)
    data = report_data(scene, relations, before, certificate, timings, tolerance=tolerance)
    title = title or scene.name or "Room"
    style = palette_style() + _part("report.css")
    script = _part("report.js")
    caption = image_caption or ("The panorama." if image is not None else "There is no photo.")
    texts = {
        "title": title,
        "version": __version__,
        "policy": _policy(script, style),
        "summary": f"{describe_room(scene)}, {len(scene.layout.floor_polygon)} corners",
        "photo": photo_address(image),
        "photo_alt": f"Panorama of {title}",
        "photo_caption": f"{caption} Drag to look around, wheel or pinch to zoom, click to select.",
        "objects_caption": "Score, distance and direction are confidences from 0 to 1. Select a "
        "row to see the object in all views.",
        "relations_caption": relations_caption,
        "licences": _part("LICENCES.txt"),
    }
    parts = {name: html.escape(text) for name, text in texts.items()} | {
        "notes": "\n".join(f'<p class="note">{html.escape(note)}</p>' for note in notes),
        "style": style,
        "script": script,
        "data": _embedded(data),
    }
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], _part("report.html"))
    write_atomically(Path(path), page)


def _check(scene: Scene, before: Scene | None, timings: Mapping[str, float]) -> None:
    for name, one in (("scene", scene), ("before", before)):
        if one is None:
            continue
        boxes = one.objects.boxes
        for tensor in (boxes.centre, boxes.size, boxes.yaw, one.layout.floor_polygon):
            if not bool(torch.isfinite(tensor).all()):
                raise ValueError(f"{name}: expected finite boxes and corners, found others")
    if before is not None and len(before.objects.boxes) != len(scene.objects.boxes):
        found, expected = len(before.objects.boxes), len(scene.objects.boxes)
        raise ValueError(f"before: expected the same {expected} objects, found {found}")
    for label, seconds in timings.items():
        if not 0 <= seconds < math.inf:
            raise ValueError(f"timings: expected seconds for {label!r}, found {seconds}")


def _relations(scene: Scene) -> tuple[Relations, str]:
    """Return the scene's relations and what to say about them."""
    if scene.relations is not None:
        return scene.relations, "Relations with a score of at least one half."
    height = scene.panorama.camera_height
    derived = relations_from_boxes(scene.objects.boxes, scene.layout, height)
    return derived, "The scene has no relations of its own; these follow from its boxes."


def _part(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")


def _policy(script: str, style: str) -> str:
    """Return a Content-Security-Policy: this very script and style, data images, nothing else."""
    hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()) for text in (script, style)]
    first, second = (f"'sha256-{text.decode()}'" for text in hashes)
    return (
        f"default-src 'none'; script-src {first}; style-src {second}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _embedded(data: object) -> str:
    """Return JSON that cannot end the element it stands in."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.translate({ord(letter): f"\\u{ord(letter):04x}" for letter in "<>&"})
