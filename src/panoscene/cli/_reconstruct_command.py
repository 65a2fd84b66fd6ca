# ruff: noqa: PLC0415
# The imports stand inside the function: help and wrong options should not wait for torch.
"""The command that turns photos into scenes."""

import math
import threading
from functools import partial
from typing import Annotated, Any

from tyro.conf import Positional, arg

from panoscene._editions import Edition
from panoscene.cli._artist import artist
from panoscene.cli._errors import InputError
from panoscene.cli._options import Count, Flag, Number, OptionalCount, OptionalFolder, Output
from panoscene.cli._synth_commands import Address
from panoscene.cli._weight_files import check_weights

_DRAWING = (
    "panoscene.cli._results",
    "matplotlib.backends.backend_agg",
    "matplotlib.figure",
    "matplotlib.patheffects",
)
"""Modules that take long to import, for the process that draws."""


def reconstruct(
    photos: Annotated[
        Positional[tuple[str, ...]],
        arg(metavar="PHOTO [PHOTO ...]", help_behavior_hint="(required)"),
    ],
    *,
    output: Output,
    camera_height: Number = 1.6,
    edition: Edition = "compact",
    weights: OptionalFolder = None,
    device: Annotated[str, arg(metavar="NAME")] = "cpu",
    steps: OptionalCount = None,
    resolution: Count = 64,
    no_shapes: Flag = False,
    keep_frame: Flag = False,
    resume: Flag = False,
    ray: Address = None,
    json: Flag = False,
) -> int:
    """Turn 360-degree photos of rooms into 3D scenes.

    The folder gets scene.json (room, objects, relations), scene.glb for other 3D programs,
    report.html to look around in, overlay.png, birds-eye.png, render.png and view.png,
    floorplan.svg, and reconstruction.json (times, doubts, what the arrangement improved). Several
    photos get a folder each, named as they are. For example:

        panoscene reconstruct photo.jpg -o room
        panoscene reconstruct photos/ -o rooms --resume
        panoscene reconstruct /shared/photos -o /shared/rooms --ray

    A photo that cannot be used is reported and left out; the exit code is then 2.

    Args:
        photos: 2:1 panoramas (.jpg .png .webp .tif .bmp), folders of them, or quoted patterns.
        output: Folder for the results.
        camera_height: Metres from the floor to the camera; the scene scales with it.
        edition: Of the networks: compact comes with its weights; paper needs --weights.
        weights: Folder with the networks' weights, instead of those that come with the package.
        device: Where the networks run: cpu, cuda, cuda:1 ...
        steps: Steps of the arrangement's descent; 0 leaves the boxes as the networks say.
        resolution: Cells along each axis of the grid in which meshes are found: 32, 64, 128 or
            256. Meshes have up to 32 triangles for each.
        no_shapes: Leave out the meshes; objects are boxes.
        keep_frame: Take photos as they are, even if the camera was tilted.
        resume: Leave out photos whose results are there, whatever the options were then.
        ray: Spread photos over a Ray cluster whose computers share their folder and OUT: the one
            at this address, or the running one; without any, over this computer. Needs pip
            install 'panoscene[ray]'.
        json: Print what was found as JSON.
    """
    if not photos:
        raise InputError("PHOTO: found nothing, expected panoramas, folders or patterns")
    if not 0 < camera_height < math.inf:
        raise InputError(f"--camera-height: found {camera_height}, expected metres above 0")
    if resolution not in (32, 64, 128, 256):
        raise InputError(f"--resolution: found {resolution}, expected 32, 64, 128 or 256")
    if edition != "compact" and weights is None:
        raise InputError(
            f"--edition {edition}: found no --weights, expected a folder with them: "
            "weights come with the compact edition only"
        )
    if weights is not None and not weights.is_dir():
        raise InputError(f"--weights {weights}: found no folder there")
    if steps is not None and steps < 0:
        raise InputError(f"--steps: found {steps}, expected 0 or more")
    if weights is not None:
        check_weights(weights)
    from panoscene.cli._reconstruct import Choice, photo_files, photo_folders, reconstruct_files

    if device != "cpu":
        checked_device(device)
    files = photo_files(photos)
    photo_folders(files, output)
    make = partial(
        _pipeline,
        edition,
        weights=weights,
        device=device,
        shapes=not no_shapes,
        level=not keep_frame,
        steps=steps,
    )
    choice = Choice(camera_height, resolution, resume)
    # other threads and the drivers of other devices do not survive a fork
    fork = device == "cpu" and threading.active_count() == 1
    # computers of a cluster draw themselves
    drawing = partial(artist, *_DRAWING, fork=fork) if ray is None else None
    try:
        return reconstruct_files(make, files, output, choice, as_json=json, ray=ray, artist=drawing)
    except ModuleNotFoundError as error:
        if error.name != "ray":
            raise
        raise InputError(str(error)) from None


def _pipeline(edition: Edition, *, steps: int | None, **options: Any) -> Any:
    from panoscene.pipeline import PHOTO, load

    settings = PHOTO if steps is None else PHOTO.model_copy(update={"steps": steps})
    return load(edition, settings=None if steps == 0 else settings, **options)


def checked_device(name: str) -> str:
    """Return the name of a device that is there.

    Raises:
        InputError: There is none of that name.
    """
    import torch

    try:
        # back again: some devices make tensors that hold nothing
        torch.zeros(1, device=name).tolist()
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"--device: found {name}, which cannot be used: {reason}") from None
    return name
