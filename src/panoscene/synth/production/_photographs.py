"""The panoramas of one home: cameras, light, picture, labels, files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from panoscene.scene import Scene
from panoscene.synth.dataset import (
    DatasetIndex,
    FileChoice,
    HomeJob,
    Recipe,
    label_panorama,
    write_panorama,
)
from panoscene.synth.render import (
    Camera,
    Renderer,
    RenderScene,
    sample_cameras,
    sample_light,
    scene_from_home,
)

from ._finishes import sample_finishes
from ._furnished import FurnishedHome, furnished_home
from ._models import Models

Extra = Callable[[Scene, Path], None]
"""Writes further files of a panorama into its folder; gets the scene with its meshes."""
_ATTEMPTS = 5
_LIGHTS = 2
"""Different lights in one home; its cameras take turns."""


def photograph_home(
    job: HomeJob,
    index: DatasetIndex,
    models: Models,
    renderer: Renderer,
    root: Path | str,
    *,
    extra: Extra | None = None,
    written: Callable[[str], None] | None = None,
) -> None:
    """Render and write the panoramas of one home that a job asks for.

    What a panorama shows depends on the recipe and the models alone, not on which of the home's
    panoramas are there already.

    Args:
        job: The home and the cameras that are missing.
        index: Of the data set.
        models: To furnish the home with, their textures as large as the recipe wants.
        renderer: Of this process.
        root: Folder of the data set.
        extra: Writes further files.
        written: Told the name of every panorama that is there.

    Raises:
        ValueError: No place for a camera was found in any furnishing of the home.
    """
    recipe = index.recipe
    furnished, scene, cameras = _prepared(job, recipe, models)
    numbers = {f"{job.home}-{k}": k for k in range(recipe.cameras)}
    files = FileChoice(recipe.jpeg_quality, recipe.normals, recipe.albedo)
    lit = None
    for light_number in range(_LIGHTS):
        wanted = [c for c in job.cameras if numbers[c.name] % _LIGHTS == light_number]
        if not wanted:
            continue
        light = sample_light(np.random.default_rng([job.seed, 8, light_number]), scene)
        lit = renderer.light_up(scene, light, like=lit)
        for camera_job in wanted:
            camera = cameras[numbers[camera_job.name]]
            picture = lit.photograph(
                camera, camera_job.seed, samples=recipe.samples, depth=recipe.depth
            )
            panorama = label_panorama(
                scene, picture, name=camera_job.name, home=job.home, seed=job.seed,
                room_kind=furnished.home.rooms[camera.room].kind,
                light={"kind": light.kind, "seed": light.seed},
            )  # fmt: skip
            write_panorama(panorama, root, split=job.split, files=files, extra=extra)
            if written is not None:
                written(camera_job.name)


def _prepared(
    job: HomeJob, recipe: Recipe, models: Models
) -> tuple[FurnishedHome, RenderScene, tuple[Camera, ...]]:
    """Return the home with enough free floor for its cameras."""
    part = "unseen" if job.split == "test-unseen" else "seen"
    count, width = recipe.cameras, recipe.width
    for attempt in range(_ATTEMPTS):
        furnished = furnished_home(
            job.seed, models, part, attempt=attempt, texture_size=recipe.furniture_texture
        )
        rng = np.random.default_rng([job.seed, 6])
        finishes = sample_finishes(furnished.home, rng)
        scene = scene_from_home(furnished.home, furnished.drawn, finishes, poses=furnished.poses)
        places = np.random.default_rng([job.seed, 7])
        cameras = sample_cameras(
            furnished.home, scene.placed, places, count,
            robust=job.varied, width=width, height=width // 2,
        )  # fmt: skip
        if len(cameras) == count:
            return furnished, scene, cameras
    raise ValueError(f"{job.home}: found no room for {count} cameras in {_ATTEMPTS} furnishings")
