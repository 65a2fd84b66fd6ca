"""One scene from every side: pictures and the interactive page."""

from collections.abc import Iterator
from pathlib import Path

from jaxtyping import Float
from torch import Tensor

from panoscene.cli._errors import InputError
from panoscene.cli._files import blaming, check_folder, writing
from panoscene.cli._photos import photo_image
from panoscene.cli._terminal import note
from panoscene.scene import Scene, read_scene
from panoscene.views import (
    SheetRow,
    default_view,
    draw_birds_eye,
    draw_overlay,
    draw_sheet,
    render_panorama,
    render_view,
    write_image,
    write_report,
)

SHEET_WIDTH, RENDER_HEIGHT = 2000, 512


def draw_file(file: Path, output: Path, photo: Path | None, truth: Path | None) -> int:
    """Draw a scene into a folder and return the exit code."""
    check_folder(output)
    scene = read_scene(file)
    reference = None if truth is None else read_scene(truth)
    image = photo_image(scene, file, photo)
    with blaming(file), writing(output / "report.html"):
        for name in draw_scene(scene, output, image=image, reference=reference):
            note(f"wrote {output / name}")
    return 0


def draw_scene(
    scene: Scene,
    output: Path,
    *,
    image: Float[Tensor, "3 height width"] | None = None,
    reference: Scene | None = None,
) -> Iterator[str]:
    """Yield the names of the pictures of a scene as they are written."""
    draw_birds_eye(scene, output / "birds-eye.png", reference=reference)
    yield "birds-eye.png"
    draw_overlay(scene, output / "overlay.png", image=image, reference=reference)
    yield "overlay.png"
    rendering = render_panorama(scene, height=RENDER_HEIGHT)
    write_image(rendering, output / "render.png")
    yield "render.png"
    view = render_view(scene, default_view(scene))
    write_image(view, output / "view.png")
    yield "view.png"
    row = SheetRow(scene.name or "Room", scene, image=image, rendering=rendering, view=view)
    draw_sheet([row], output / "sheet.png", reference=reference, width_px=SHEET_WIDTH)
    yield "sheet.png"
    caption = "" if image is not None else "Rendered from the boxes."
    write_report(
        output / "report.html",
        scene,
        image=rendering if image is None else image,
        image_caption=caption,
    )
    yield "report.html"


def serve_file(
    file: Path, *, host: str, port: int, photo: Path | None, save_to: Path | None
) -> int:
    """Serve the live editor of a scene until it is interrupted, and return the exit code."""
    from panoscene.cli._photos import photo_path  # noqa: PLC0415
    from panoscene.viewer import view_file  # noqa: PLC0415

    if save_to is not None and save_to.suffix != ".json":
        raise InputError(f"--output {save_to}: found another ending, expected .json")
    if not 0 <= port <= 65535:
        raise InputError(f"--port: found {port}, expected 0 to 65535 (0: any free one)")
    if photo is None:
        photo = photo_path(read_scene(file), file, None)
    elif not photo.is_file():
        raise InputError(f"--photo {photo}: found no file there, expected a panorama")
    if save_to is not None:
        save_to.parent.mkdir(parents=True, exist_ok=True)
    try:
        with blaming("view"):
            viewer = view_file(file, host=host, port=port, photo=photo, save_to=save_to)
        with viewer:
            note(f"{viewer.url} shows {file}; press Ctrl-C to end")
            viewer.wait()
    except KeyboardInterrupt:
        pass
    return 0
