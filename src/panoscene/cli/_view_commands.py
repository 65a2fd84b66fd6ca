# ruff: noqa: PLC0415
# The imports stand inside the functions: help and wrong options should not wait for torch.
"""The commands that show scenes: functions whose parameters are the options."""

from typing import Annotated

from tyro.conf import arg

from panoscene.cli._options import Count, OptionalFile, OptionalOutput, Output, SceneFile


def draw(
    scene: SceneFile, *, output: Output, photo: OptionalFile = None, truth: OptionalFile = None
) -> int:
    """Draw a scene from every side: pictures, and a page to look around in.

    The folder gets birds-eye.png (from above), overlay.png (boxes on the panorama), render.png
    (what the boxes look like from the camera), view.png (the room as a model), sheet.png (all of
    them side by side) and report.html: one file that opens in a browser without network, with the
    panorama, the room in 3D, the plan and the tables. For example:

        panoscene draw room.json -o pictures
        panoscene draw room.json -o pictures --photo photo.jpg --truth true-room.json

    Args:
        scene: A scene.json file.
        output: Folder for the pictures.
        photo: The panorama, instead of the one that the scene names.
        truth: Another scene, whose boxes are outlined in grey.
    """
    from panoscene.cli._scene_files import check_scene

    for file in (scene,) if truth is None else (scene, truth):
        check_scene(file)
    from panoscene.cli._draw import draw_file

    return draw_file(scene, output, photo, truth)


def view(
    scene: SceneFile,
    *,
    output: OptionalOutput = None,
    host: Annotated[str, arg(metavar="NAME")] = "127.0.0.1",
    port: Count = 8080,
    photo: OptionalFile = None,
) -> int:
    """Edit a scene in the browser: drag, turn and delete boxes, and let the room be repaired.

    Relations, collisions and what is outside the room follow every change; Solve repairs the
    arrangement and shows its certificate; Save writes the scene. The page is served to this
    computer alone unless --host says otherwise, and there is no password. For example:

        panoscene view room.json
        panoscene view room.json -o edited.json --port 9000

    Args:
        scene: A scene.json file.
        output: Where Save writes the scene; without it the browser downloads it.
        host: Address to serve at; 0.0.0.0 lets other computers in.
        port: Port to serve at; 0 takes any free one.
        photo: The panorama, instead of the one that the scene names.
    """
    from panoscene.cli._scene_files import check_scene

    check_scene(scene)
    from panoscene.cli._draw import serve_file

    return serve_file(scene, host=host, port=port, photo=photo, save_to=output)
