"""The optimisation as a moving picture: boxes on their way from the start to the repaired room."""

import io
import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from PIL import Image

from panoscene.arrange import ArrangementSettings, arrange, collate_scenes, energy
from panoscene.geometry import OrientedBoxes, polygon_turn
from panoscene.scene import Scene, relations_from_boxes, write_atomically
from panoscene.views._attachments import joints_from_relations
from panoscene.views._cameras import FreeCamera
from panoscene.views._default_view import default_view
from panoscene.views._frames import Stage, draw_frame

_FORMATS = (".webp", ".gif")
_FIRST_MS, _FRAME_MS, _LAST_MS = 1200, 90, 2800


def draw_animation(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    settings: ArrangementSettings | str = "default",
    states: Sequence[OrientedBoxes] | None = None,
    reference: Scene | None = None,
    camera: FreeCamera | None = None,
    title: str = "",
    frames: int = 48,
    size_px: tuple[int, int] = (1080, 560),
) -> None:
    """Write a looping animation (WebP or GIF) of the optimiser at work.

    It shows the room from above and in space, as the solver moves the boxes from the scene's to
    the repaired ones: what collides is outlined and hatched in red, attachments (contacts of
    objects, walls, floor and ceiling) are thick white lines, boxes of a reference are grey. Below
    runs the energy. It rests on the first and on the last state.

    Args:
        scene: the start; relations that are missing are derived from its boxes.
        path: file to write, ending in .webp or .gif; it appears complete or not at all.
        settings: how to solve; a preset's name or your own.
        states: the boxes to show from start to end, instead of solving the scene.
        reference: a scene whose boxes are outlined in grey, such as the truth.
        camera: of the view in space; ``default_view`` of the last state when None.
        title: heading; the scene's name when empty.
        frames: how many at most. They are spread by movement, so that little is lost.
        size_px: width and height.

    Raises:
        ValueError: a name that ends in anything else, no frames or states, a size below 320 x 240,
            or a scene that cannot be solved or drawn.

    Source: DeepPanoContext, supplement, the animated figure of relation optimization.
    """
    file = Path(path)
    if file.suffix.lower() not in _FORMATS:
        raise ValueError(f"path: found {file.name!r}, expected a name in {', '.join(_FORMATS)}")
    if frames < 2 or (states is not None and len(states) == 0):
        raise ValueError("frames, states: expected at least two frames and one state")
    if size_px[0] < 320 or size_px[1] < 240:
        raise ValueError(f"size_px: found {size_px}, expected at least 320 x 240")
    if isinstance(settings, str):
        settings = ArrangementSettings.preset(settings)
    shown, numbers = _choose(scene, settings, states, frames)
    boxes = None if reference is None else reference.objects.boxes
    stage = _stage(scene, shown, boxes, camera, size_px)
    stage = replace(stage, energies=_energies(scene, settings, shown))
    last = numbers[-1]
    heading = title or scene.name or "Room"
    pictures: list[Image.Image] = []
    for k, boxes in enumerate(shown):
        text = f"{heading} · step {numbers[k]} of {last}"
        pictures.append(draw_frame(stage, boxes, k, text))
    write_atomically(file, _encoded(pictures, file.suffix.lower()))


def _choose(
    scene: Scene,
    settings: ArrangementSettings,
    states: Sequence[OrientedBoxes] | None,
    frames: int,
) -> tuple[list[OrientedBoxes], list[int]]:
    """Return the states to show and their numbers, evenly spread over movement and steps."""
    if states is None:
        result = arrange(scene, settings, frames=settings.steps + 1)
        # the result may differ from the descent's end: settled on the floor, or an earlier state
        every = [*result.path, result.scene.objects.boxes]
        steps = [*range(len(result.path)), len(result.path) - 1]
    else:
        every, steps = list(states), list(range(len(states)))
    if len(every) <= frames:
        return every, steps
    places = torch.stack([torch.cat([b.centre, b.size], -1).double() for b in every])
    moved = places.diff(dim=0).norm(dim=-1).sum(-1).numpy(force=True)
    share = moved / max(float(moved.sum()), 1e-9) + 0.5 / len(moved)
    run = np.concatenate([[0.0], np.cumsum(share)])
    wanted = np.linspace(0.0, float(run[-1]), frames)
    kept = sorted({*np.searchsorted(run, wanted - 1e-9).clip(0, len(every) - 1).tolist(), 0})
    return [every[k] for k in kept], [steps[k] for k in kept]


def _stage(
    scene: Scene,
    shown: list[OrientedBoxes],
    reference: OrientedBoxes | None,
    camera: FreeCamera | None,
    size_px: tuple[int, int],
) -> Stage:
    relations = scene.relations
    if relations is None:
        height = scene.panorama.camera_height
        relations = relations_from_boxes(scene.objects.boxes, scene.layout, height)
    stage = Stage(
        scene,
        joints_from_relations(relations),
        reference,
        camera or FreeCamera((0.0, 0.0, 1.0), (0.0, 1.0, 1.0)),
        0.0,
        size_px,
    )
    if camera is None:
        end = replace(scene, objects=replace(scene.objects, boxes=shown[-1]))
        camera = default_view(end, size_px=stage.panels[1])
    return replace(stage, camera=camera, turn=_turn(scene, camera))


def _energies(
    scene: Scene, settings: ArrangementSettings, shown: list[OrientedBoxes]
) -> tuple[float, ...]:
    if len(scene.objects.boxes) == 0:
        return (0.0,) * len(shown)

    def together(name: str) -> Float[torch.Tensor, "states n *rest"]:
        return torch.stack([getattr(boxes, name) for boxes in shown])

    with torch.no_grad():
        batch = collate_scenes([scene] * len(shown))
        boxes = OrientedBoxes(together("centre"), together("size"), together("yaw"))
        return tuple(energy(batch, settings, boxes=boxes).sum(-1).tolist())


def _turn(scene: Scene, camera: FreeCamera) -> float:
    """Return the turn that lays walls along the page, with the camera's far side up."""
    x, y = (b - a for a, b in zip(camera.eye[:2], camera.target[:2], strict=True))
    up = math.pi / 2 - math.atan2(y, x)
    walls = polygon_turn(scene.layout.floor_polygon)
    return walls + round((up - walls) / (math.pi / 2)) * (math.pi / 2)


def _encoded(pictures: list[Image.Image], suffix: str) -> bytes:
    times = [_FIRST_MS, *[_FRAME_MS] * (len(pictures) - 2), _LAST_MS][-len(pictures) :]
    buffer = io.BytesIO()
    first, *rest = pictures
    options = {"save_all": True, "append_images": rest, "duration": times, "loop": 0}
    if suffix == ".webp":
        first.save(buffer, format="WEBP", quality=82, method=4, **options)
    else:
        palette = _palette(pictures)
        plain = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
        options["append_images"] = plain[1:]
        plain[0].save(buffer, format="GIF", optimize=False, disposal=1, **options)
    return buffer.getvalue()


def _palette(pictures: list[Image.Image]) -> Image.Image:
    """Return colours that suit all frames, so that nothing flickers."""
    some = [pictures[0], pictures[len(pictures) // 2], pictures[-1]]
    sheet = Image.new("RGB", (pictures[0].width, sum(p.height for p in some)))
    top = 0
    for picture in some:
        sheet.paste(picture, (0, top))
        top += picture.height
    return sheet.quantize(colors=255, method=Image.Quantize.MEDIANCUT)
