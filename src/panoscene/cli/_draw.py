"""One scene from every side: pictures and the interactive page."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from jaxtyping import Float
from torch import Tensor

from panoscene.cli._doubts import note_doubts
from panoscene.cli._errors import InputError
from panoscene.cli._files import blaming, write_bytes, writing
from panoscene.cli._folders import check_folder
from panoscene.cli._interrupt import remembered_interrupt
from panoscene.cli._photos import photo_image
from panoscene.cli._progress import progress_words
from panoscene.cli._terminal import note
from panoscene.scene import Scene, read_scene, relocate_photo
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
    note_doubts(scene, file)
    reference = None if truth is None else read_scene(truth)
    image = photo_image(scene, file, photo)
    with TemporaryDirectory(prefix="panoscene-") as name, progress_words() as progress:
        drafts = Path(name)
        with blaming(file):
            for drawn in draw_pictures(scene, drafts, image=image, reference=reference):
                progress(f"drew {drawn}")
        # all are there: nobody finds some of them after an error
        for draft in sorted(drafts.iterdir()):
            write_bytes(output / draft.name, draft.read_bytes())
    note(f"wrote {output}: a page to open in a browser, report.html, and pictures")
    return 0


def draw_pictures(
    scene: Scene,
    output: Path,
    *,
    image: Float[Tensor, "3 height width"] | None,
    reference: Scene | None,
    sheet: bool = True,
    page: bool = True,
) -> Iterator[str]:
    """Draw a scene and yield the names of the files as they are written.

    Args:
        scene: what to draw.
        output: folder for the files.
        image: the upright panorama, when there is one.
        reference: another scene, whose boxes are outlined.
        sheet: also draw all pictures side by side.
        page: also write the page to look around in.
    """
    draw_birds_eye(scene, output / "birds-eye.png", reference=reference)
    yield "birds-eye.png"
    draw_overlay(scene, output / "overlay.png", image=image, reference=reference)
    yield "overlay.png"
    rendering = draw_inside(scene, output)
    yield "render.png"
    view = draw_outside(scene, output)
    yield "view.png"
    if sheet:
        row = SheetRow(scene.name or "Room", scene, image=image, rendering=rendering, view=view)
        draw_sheet([row], output / "sheet.png", reference=reference, width_px=SHEET_WIDTH)
        yield "sheet.png"
    if not page:
        return
    caption = "" if image is not None else "Rendered from the boxes."
    write_report(
        output / "report.html",
        scene,
        image=rendering if image is None else image,
        image_caption=caption,
    )
    yield "report.html"


def draw_inside(scene: Scene, output: Path) -> Float[Tensor, "3 rows columns"]:
    """Render a scene from its own camera into a folder, and return the picture."""
    rendering = render_panorama(scene, height=RENDER_HEIGHT)
    write_image(rendering, output / "render.png")
    return rendering


def draw_outside(scene: Scene, output: Path) -> Float[Tensor, "3 height width"]:
    """Render a scene from outside into a folder, and return the picture."""
    view = render_view(scene, default_view(scene))
    write_image(view, output / "view.png")
    return view


def serve_file(
    file: Path, *, host: str, port: int, photo: Path | None, save_to: Path | None
) -> int:
    """Serve the live editor of a scene until it is interrupted, and return the exit code."""
    from panoscene.viewer import serve  # noqa: PLC0415

    if save_to is not None and save_to.suffix != ".json":
        raise InputError(f"--output {save_to}: found another ending, expected .json")
    if not 0 <= port <= 65535:
        raise InputError(f"--port: found {port}, expected 0 to 65535 (0: any free one)")
    scene = read_scene(file)
    note_doubts(scene, file)
    image = photo_image(scene, file, photo)
    if save_to is not None:
        with writing(save_to):
            scene = relocate_photo(scene, file, save_to)
    try:
        with remembered_interrupt() as asked, blaming(f"view {file}"):
            viewer = serve(scene, host=host, port=port, image=image, save_to=save_to)
        with viewer:
            if asked.is_set():
                return 0
            note(f"{viewer.url} shows {file}; press Ctrl-C to end")
            viewer.wait()
    except KeyboardInterrupt:
        pass
    return 0
