"""Conversions between boxes, scenes and panoramas, told from the names of the files."""

import math
from dataclasses import dataclass, fields, replace
from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.cli._errors import InputError
from panoscene.cli._files import blaming
from panoscene.cli._kinds import kind_of, write_as
from panoscene.cli._models import MODELS, WITH_PHOTO, read_model, write_model
from panoscene.cli._pictures import PanoramaOptions, convert_panorama
from panoscene.cli._relations import with_relations
from panoscene.cli._terminal import note
from panoscene.geometry import polygon_area, polygon_problem
from panoscene.scene import Layout, Scene, read_box_table, read_scene, scene_from_boxes

POSSIBLE = """\
  boxes.csv --room ...   to  scene .json, or its relations: .relations.json .graphml
  scene.json             to  scene .json, boxes .csv, or relations: .relations.json .graphml
  scene.json             to  a model .glb .obj, a floor plan .svg .dxf, or a page .html
  model.glb              to  scene .json, if panoscene made it
  panorama --cube        to  a folder of six faces
  panorama --view ...    to  a picture: .png .jpg .webp .tif .bmp
  panorama --yaw-deg ... to  a picture"""

FROM_SCENE = {"scene", "graph JSON", "GraphML", "table", *MODELS}
"""What a scene can become."""


@dataclass(frozen=True, slots=True)
class SceneOptions:
    """Options that complete a table of boxes to a scene; None for those that were not given."""

    room: str | None
    ceiling: float | None
    camera_height: float | None
    name: str | None


def convert_file(
    file: Path,
    output: Path,
    scene_options: SceneOptions,
    panorama_options: PanoramaOptions,
    photo: Path | None = None,
) -> int:
    """Convert a file and return the exit code.

    Raises:
        InputError: There is no such conversion, or an option does not belong to it.
    """
    kind, wanted = kind_of(file), kind_of(output)
    if photo is not None and (kind == "picture" or wanted not in WITH_PHOTO):
        raise InputError(f"--photo: found it with {output}, expected it for .glb or .html")
    if kind == "picture":
        _refuse(scene_options, file, kind)
        note(convert_panorama(file, output, panorama_options))
        return 0
    _refuse(panorama_options, file, kind)
    if kind == "table" and wanted in FROM_SCENE - {"table"}:
        scene = _scene_from_table(file, scene_options)
    elif kind in {"scene", "GLB"} and wanted in FROM_SCENE:
        _refuse(replace(scene_options, name=None), file, kind)
        scene = read_scene(file) if kind == "scene" else read_model(file)
        if scene_options.name is not None:
            scene = replace(scene, name=scene_options.name)
        if scene.relations is None and wanted in {"graph JSON", "GraphML"}:
            scene = with_relations(scene, file)
    else:
        raise InputError(
            f"{file} to {output}: found no such conversion ({kind} to {wanted}), "
            f"expected one of\n{POSSIBLE}"
        )
    if wanted in MODELS:
        note(write_model(wanted, scene, output, file, photo))
        return 0
    note(write_as(wanted, scene, output, file))
    return 0


def floor_polygon(text: str) -> Float[Tensor, "corners 2"]:
    """Return the corners written as "x,y x,y ...", counter-clockwise from above.

    Raises:
        InputError: The text is not that, or the corners do not make a floor plan.
    """
    written = '"x,y x,y x,y ..." in metres'
    corners: list[tuple[float, float]] = []
    for pair in text.replace(";", " ").split():
        try:
            x, y = (float(number) for number in pair.split(","))
        except ValueError:
            raise InputError(f"--room: found {pair!r}, expected {written}") from None
        corners.append((x, y))
    if len(corners) < 3:
        raise InputError(f"--room: found {len(corners)} corners, expected at least 3: {written}")
    polygon = torch.tensor(corners)
    if float(polygon_area(polygon)) < 0:
        polygon = polygon.flip(0)
    problem = polygon_problem(polygon)
    if problem is not None:
        raise InputError(f"--room: found {text!r}, expected a simple polygon: {problem}")
    return polygon


def _scene_from_table(file: Path, options: SceneOptions) -> Scene:
    if options.room is None:
        raise InputError(
            f"{file}: found a table without a floor plan, expected one as well, such as\n"
            '  --room "-2,-1 3,-1 3,4 -2,4"'
        )
    polygon = floor_polygon(options.room)
    ceiling = _metres("--ceiling", options.ceiling, 2.6)
    height = _metres("--camera-height", options.camera_height, 1.6)
    name = file.stem if options.name is None else options.name
    with blaming(file):
        objects = read_box_table(file, camera_height=height)
        layout = Layout(polygon, ceiling_height=ceiling)
        return scene_from_boxes(objects, layout, camera_height=height, name=name)


def _metres(option: str, value: float | None, usual: float) -> float:
    metres = usual if value is None else value
    if not 0 < metres < math.inf:
        raise InputError(f"{option}: found {metres:g}, expected metres above 0")
    return metres


def _refuse(options: SceneOptions | PanoramaOptions, file: Path, kind: str) -> None:
    """Refuse options that would be ignored without a word."""
    names = [field.name for field in fields(options)]
    given = [f"--{name.replace('_', '-')}" for name in names if getattr(options, name) is not None]
    if given:
        raise InputError(
            f"{file}: found {' and '.join(given)} with a {kind}, expected one of\n{POSSIBLE}"
        )
