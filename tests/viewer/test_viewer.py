"""The running editor: what its controls do, how it starts and stops, and the page in a browser."""

import asyncio
import contextlib
import dataclasses
import logging
import math
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch
from PIL import Image
from playwright.sync_api import Browser
from trimesh.visual import TextureVisuals
from viser import _messages as messages

from panoscene.geometry import lonlat_from_direction
from panoscene.scene import PanoramaError, Scene, SceneFormatError, read_scene, write_scene
from panoscene.viewer import Editor, ViewerHandle, serve, view_file
from panoscene.viewer._cameras import view_of
from panoscene.viewer._panels import NOTHING
from panoscene.viewer._photo import photo_sphere


class Client:
    """Somebody who is told things."""

    def __init__(self) -> None:
        self.told: list[tuple[str, str]] = []

    def add_notification(self, title: str, body: str, **_: Any) -> None:
        self.told.append((title, body))


@contextlib.contextmanager
def running(scene: Scene, **options: Any) -> Iterator[ViewerHandle]:
    with serve(scene, port=0, **options) as viewer:
        yield viewer


def press(button: Any) -> None:
    """Press a button as viser does for a client."""
    button.value = True


def drag(viewer: ViewerHandle, gizmo: Any, *moves: tuple[float, float, float], yaw: float) -> None:
    """Send what a browser sends while somebody drags."""
    api = gizmo._impl.api
    name, loop = gizmo.name, viewer._server.get_event_loop()

    async def gesture() -> None:
        owner = messages.TransformControlsDragStartMessage
        await api._handle_transform_controls_drag_start(7, owner(name=name, owner=""))
        for x, y, z in moves:
            wxyz = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
            update = messages.TransformControlsUpdateMessage(
                name=name, wxyz=wxyz, position=(x, y, z), owner=""
            )
            await api._handle_transform_controls_updates(7, update)
        end = messages.TransformControlsDragEndMessage(name=name, owner="")
        await api._handle_transform_controls_drag_end(7, end)

    asyncio.run_coroutine_threadsafe(gesture(), loop).result(10)


def test_it_starts_shows_and_stops(colliding: Scene) -> None:
    with running(colliding) as viewer:
        assert viewer.url == f"http://127.0.0.1:{viewer.port}"
        assert viewer.port > 0
        assert viewer.app.settle().violations.colliding_pairs == 1
        panels = viewer.app.panels
        assert "| Colliding pairs | 1 | **1** |" in panels.violations.content
        assert panels.selected.options == (NOTHING, "table-0", "chair-0", "plant-0")
        assert not panels.object.visible
        assert not panels.solved.visible
        assert not panels.photo.visible
    viewer.wait()
    viewer.stop()
    with (
        pytest.raises(ConnectionRefusedError),
        socket.create_connection(("127.0.0.1", viewer.port)),
    ):
        pass


def test_moving_by_numbers_changes_panels_live(colliding: Scene) -> None:
    with running(colliding) as viewer:
        app, panels = viewer.app, viewer.app.panels
        panels.selected.value = "chair-0"
        assert app.selected == "chair-0"
        assert panels.object.visible
        assert panels.category.value == "chair"
        assert "| touches table-0 | yes | yes |" in panels.relations.content
        panels.centre.value = (0.0, -1.5, 0.45)
        assert app.settle().violations.colliding_pairs == 0
        assert "| Colliding pairs | 1 | **0** |" in panels.violations.content
        assert "touches table-0" not in panels.relations.content
        assert "touches wall-0" not in panels.relations.content
        panels.centre.value = (0.0, -1.73, 0.45)
        app.settle()
        assert "| touches wall-0 | yes | yes |" in panels.relations.content
        panels.yaw.value = 90.0
        assert float(viewer.scene.objects.boxes.yaw[1]) == pytest.approx(math.pi / 2)
        panels.size.value = (0.6, 0.5, 0.9)
        panels.category.value = "stool"
        assert app.editor.state.action == "called chair-0 stool"
        # one step for both numbers of the centre, since they came at once
        assert len(app.editor.past) == 4
        panels.selected.value = NOTHING
        assert app.selected is None


def test_numbers_that_nobody_touched_stay_exact(colliding: Scene) -> None:
    third = colliding.objects.boxes.centre.clone()
    third[1] = torch.tensor([1 / 3, -1 / 3, 0.45])
    boxes = dataclasses.replace(colliding.objects.boxes, centre=third)
    scene = dataclasses.replace(
        colliding, objects=dataclasses.replace(colliding.objects, boxes=boxes)
    )
    with running(scene) as viewer:
        viewer.app.select("chair-0")
        x, _, z = viewer.app.panels.centre.value
        viewer.app.panels.centre.value = (x, 1.0, z)
        assert viewer.scene.objects.boxes.centre[1].tolist() == [
            float(third[1, 0]),
            1.0,
            float(third[1, 2]),
        ]


def test_a_drag_moves_turns_and_is_one_step(colliding: Scene) -> None:
    with running(colliding) as viewer:
        app = viewer.app
        app.select("chair-0")
        assert app.mover.visible
        assert app.mover.position.tolist() == pytest.approx([0.0, 0.05, 0.92])
        drag(viewer, app.mover, (0.0, -0.5, 0.92), (0.0, -1.0, 0.92), yaw=0.5)
        box = viewer.scene.objects.boxes[1]
        assert box.centre.tolist() == pytest.approx([0.0, -1.0, 0.45])
        assert float(box.yaw) == pytest.approx(0.5)
        assert app.lifter.position.tolist() == pytest.approx([0.0, -1.0, 0.92])
        assert len(app.editor.past) == 1
        drag(viewer, app.lifter, (0.0, -1.0, 1.27), yaw=0.5)
        assert app.settle().violations.colliding_pairs == 0
        assert "stands on the floor" not in app.panels.relations.content
        app.panels.history.value = "Undo"
        app.panels.history.value = "Undo"
        assert viewer.scene is app.editor.opened
        assert app.mover.position.tolist() == pytest.approx([0.0, 0.05, 0.92])
        app.panels.history.value = "Redo"
        assert app.mover.position.tolist() == pytest.approx([0.0, -1.0, 0.92])


def test_solve_clears_collisions_and_shows_the_certificate(disturbed: Scene) -> None:
    with running(disturbed) as viewer:
        panels = viewer.app.panels
        press(panels.solve)
        assert viewer.app.settle().violations.colliding_pairs == 0
        assert panels.solved.visible
        assert "| Colliding pairs | 2 | **0** |" in panels.certificate.content
        assert not panels.solve.disabled
        panels.history.value = "To the start"
        assert viewer.app.settle().violations.colliding_pairs == 2
        assert not panels.solved.visible


def test_delete_and_duplicate(colliding: Scene) -> None:
    with running(colliding) as viewer:
        app, panels = viewer.app, viewer.app.panels
        press(panels.delete)
        assert len(app.editor.names) == 3
        app.select("chair-0")
        press(panels.delete)
        assert app.selected is None
        assert not app.mover.visible
        assert panels.selected.options == (NOTHING, "table-0", "plant-0")
        assert app.settle().violations.colliding_pairs == 0
        app.select("plant-0")
        press(panels.duplicate)
        assert panels.selected.options == (NOTHING, "table-0", "plant-0", "plant-1")
        nodes = viewer._server.scene._handle_from_node_name
        assert sum(name.endswith("/shape") for name in nodes) == 3
        press(panels.delete)
        app.change(Editor.restart)
        assert app.editor.names == ("table-0", "chair-0", "plant-0")


def test_rooms_with_nothing_in_them(empty: Scene) -> None:
    with running(empty) as viewer:
        press(viewer.app.panels.solve)
        press(viewer.app.panels.delete)
        assert viewer.app.settle().violations.energy == 0.0
        assert viewer.app.panels.troubles.content.startswith("Nothing overlaps")


def test_what_is_not_possible_is_told(colliding: Scene) -> None:
    with running(colliding) as viewer:
        client = Client()
        viewer.app.change(lambda editor: editor.place("chair-0", size=(0.0, 1.0, 1.0)), client)
        assert client.told[0][0] == "Not possible"
        assert viewer.scene is viewer.app.editor.opened
        with pytest.raises(ValueError, match="size: found"):
            viewer.app.change(lambda editor: editor.place("chair-0", size=(0.0, 1.0, 1.0)))


def test_toggles_and_views(colliding: Scene) -> None:
    with running(colliding, image=torch.full((3, 64, 128), 0.5)) as viewer:
        panels, nodes = viewer.app.panels, viewer._server.scene._handle_from_node_name
        assert nodes["/room/wall-0"].visible
        assert not nodes["/room/ceiling"].visible
        panels.ceiling.value = True
        assert nodes["/room/ceiling"].visible
        panels.photo.value = True
        assert nodes["/photo"].visible
        assert not nodes["/room/wall-0"].visible
        assert not nodes["/room/ceiling"].visible
        panels.photo.value = panels.walls.value = False
        assert not nodes["/room/wall-0"].visible
        assert nodes["/room/floor"].visible
        panels.labels.value = False
        labels = [node for name, node in nodes.items() if name.endswith("/name")]
        assert [label.visible for label in labels] == [False] * 3
        viewer.app.select("chair-0")
        assert [label.visible for label in labels] == [False, True, False]
        panels.ghost.value = True
        assert nodes["/ghost"].visible
        panels.camera.value = "From above"
    with pytest.raises(ValueError, match="name: found 'Below'"):
        view_of("Below", colliding)


def test_the_photo_is_where_it_was_taken() -> None:
    image = torch.zeros(3, 64, 128)
    sphere = photo_sphere(image, 1.6, 10.0)
    direction = torch.tensor(sphere.vertices) - torch.tensor([0.0, 0.0, 1.6])
    lon, lat = lonlat_from_direction(direction).unbind(-1)
    assert isinstance(sphere.visual, TextureVisuals)
    u, v = torch.tensor(sphere.visual.uv).unbind(-1)
    away = lat.abs() < 1.5
    turn = torch.remainder(lon / (2 * math.pi) + 0.5 - u + 0.5, 1.0) - 0.5
    assert float(turn[away].abs().max()) < 1e-6
    assert torch.allclose(v, lat / math.pi + 0.5, atol=1e-6)
    # seen from inside
    inward = -(sphere.triangles_center - [0.0, 0.0, 1.6])
    whole = sphere.area_faces > 1e-9
    assert ((sphere.face_normals * inward).sum(1)[whole] > 0).all()


def test_saving(colliding: Scene, tmp_path: Path) -> None:
    target = tmp_path / "edited.json"
    with running(colliding, save_to=target) as viewer:
        assert viewer.app.panels.save.label == "Save edited.json"
        viewer.app.select("plant-0")
        press(viewer.app.panels.delete)
        press(viewer.app.panels.save)
        assert read_scene(target).objects.id == ("table-0", "chair-0")
        target.unlink()
        target.mkdir()
        client = Client()
        viewer.app._save(client)
        assert client.told[0][0] == "Not saved"
    with running(colliding) as viewer:
        assert not viewer.app.panels.save.visible


def test_files(tmp_path: Path, colliding: Scene) -> None:
    (tmp_path / "out").mkdir()
    Image.new("RGB", (128, 64), (200, 100, 50)).save(tmp_path / "photo.png")
    panorama = dataclasses.replace(colliding.panorama, file="photo.png")
    path, target = tmp_path / "room.json", tmp_path / "out" / "edited.json"
    write_scene(dataclasses.replace(colliding, panorama=panorama), path)
    with view_file(path, port=0, save_to=target) as viewer:
        assert viewer.app.panels.photo.visible
        press(viewer.app.panels.save)
    assert read_scene(target).panorama.file == "../photo.png"
    (tmp_path / "photo.png").unlink()
    with view_file(path, port=0) as viewer:
        assert not viewer.app.panels.photo.visible
    with pytest.raises(PanoramaError):
        view_file(path, port=0, photo=tmp_path / "photo.png")
    with pytest.raises(SceneFormatError):
        view_file(tmp_path / "nothing.json")


def test_tilted_photos_are_upright(
    tmp_path: Path, colliding: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the camera stood upside down: what is red above is below in the photo
    photo = Image.new("RGB", (128, 64), (0, 0, 120))
    photo.paste((255, 0, 0), (0, 32, 128, 64))
    photo.save(tmp_path / "photo.png")
    over = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
    panorama = dataclasses.replace(colliding.panorama, file="photo.png", upright_from_photo=over)
    write_scene(dataclasses.replace(colliding, panorama=panorama), tmp_path / "room.json")
    shown: list[torch.Tensor] = []

    def draw(_: object, image: torch.Tensor, __: object) -> None:
        shown.append(image)

    monkeypatch.setattr("panoscene.viewer._app.draw_photo", draw)
    with view_file(tmp_path / "room.json", port=0):
        (image,) = shown
    assert float(image[0, :28].min()) > 0.9
    assert float(image[0, 36:].max()) < 0.1


def test_addresses_that_cannot_be_used(colliding: Scene) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ValueError, match=f"port: found {port} on 127.0.0.1 in use"):
            serve(colliding, port=port)
    with pytest.raises(ValueError, match="port: found 70000, expected 0 to 65535"):
        serve(colliding, port=70000)
    with pytest.raises(ValueError, match="found '203\\.0\\.113\\.1', expected an address of this"):
        serve(colliding, host="203.0.113.1", port=0)


def test_nothing_is_printed_and_nothing_published(
    colliding: Scene, capfd: pytest.CaptureFixture[str]
) -> None:
    with running(colliding) as viewer:
        assert viewer._server.request_share_url() is None
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("words", [b"", b"hello\r\n\r\n", b"\x16\x03\x01" + bytes(200)])
def test_who_does_not_speak_its_language_is_no_reason_to_print(
    colliding: Scene, words: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    with (
        caplog.at_level(logging.WARNING),
        running(colliding) as viewer,
        socket.create_connection(("127.0.0.1", viewer.port), timeout=10) as stranger,
    ):
        stranger.sendall(words)
        stranger.shutdown(socket.SHUT_WR)
        while stranger.recv(1000):
            pass
    assert [record.getMessage() for record in caplog.records] == []


@pytest.mark.render
def test_the_page_in_a_browser(colliding: Scene, browser: Browser) -> None:
    with running(colliding) as viewer:
        page = browser.new_page(viewport={"width": 700, "height": 420})
        page.set_default_timeout(90_000)
        asked: list[str] = []
        errors: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.on("websocket", lambda socket: asked.append(socket.url))
        page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(viewer.url)
        page.wait_for_selector("canvas")
        row = page.get_by_role("row").filter(has_text="Colliding pairs").first
        row.wait_for()
        assert row.inner_text().split()[-2:] == ["1", "1"]
        page.get_by_role("button", name="Solve").click()
        page.get_by_text("Last solve").wait_for()
        page.get_by_text("Nothing overlaps").wait_for()
        assert row.inner_text().split()[-2:] == ["1", "0"]
        page.close()
        assert viewer.app.settle().violations.colliding_pairs == 0
    here = (f"http://127.0.0.1:{viewer.port}", f"ws://127.0.0.1:{viewer.port}", "data:", "blob:")
    assert [url for url in asked if not url.startswith(here)] == []
    assert errors == []
