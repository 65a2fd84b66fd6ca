"""Scenes as models, floor plans and pages, and models as scenes."""

from pathlib import Path

from jaxtyping import Float
from torch import Tensor

from panoscene.cli._files import blaming, writing
from panoscene.cli._kinds import Kind
from panoscene.cli._photos import photo_image
from panoscene.scene import Scene, relocate_photo

MODELS: tuple[Kind, ...] = ("GLB", "OBJ", "SVG", "DXF", "page")
"""What other programs open."""
WITH_PHOTO: tuple[Kind, ...] = ("GLB", "page")
"""Those that show the photo."""


def read_model(file: Path) -> Scene:
    """Return the scene in a GLB file that panoscene wrote.

    Raises:
        SceneFormatError: It is not one.
    """
    from panoscene.exports import read_glb  # noqa: PLC0415

    return read_glb(file)


def write_model(kind: Kind, scene: Scene, output: Path, source: Path, photo: Path | None) -> str:
    """Write a scene for another program, and say what was written.

    Raises:
        InputError: The file cannot be written, or the photo is not there.
    """
    from panoscene import exports  # noqa: PLC0415

    image = photo_image(scene, source, photo) if kind in WITH_PHOTO else None
    with blaming(source), writing(output):
        if kind == "GLB":
            exports.write_glb(relocate_photo(scene, source, output), output, image=image)
        elif kind == "OBJ":
            exports.write_obj(scene, output)
        elif kind == "SVG":
            exports.write_floor_plan_svg(scene, output)
        elif kind == "DXF":
            exports.write_floor_plan_dxf(scene, output)
        else:
            _write_page(scene, output, image)
    names = {"SVG": "floor plan", "DXF": "floor plan", "page": "page"}
    return f"wrote {output}: {names.get(kind, 'model')} of {len(scene.objects.boxes)} objects"


def _write_page(scene: Scene, output: Path, image: Float[Tensor, "3 height width"] | None) -> None:
    from panoscene.views import render_panorama, write_report  # noqa: PLC0415

    caption = "" if image is not None else "Rendered from the boxes."
    shown = render_panorama(scene) if image is None else image
    write_report(output, scene, image=shown, image_caption=caption)
