"""The panorama on the walls: the right colour at every texel, without seam, poles or ghosts."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from panoscene.exports import write_glb
from panoscene.exports._glb_container import read_container
from panoscene.exports._room_textures import halvings, jpeg, reproject, texture_plane
from panoscene.scene import Layout, Scene, room_surfaces


def colour_of(place: torch.Tensor, camera_height: float) -> torch.Tensor:
    """Return what the smooth panorama shows of places of the world, channels first."""
    ray = place - place.new_tensor([0.0, 0.0, camera_height])
    return (0.5 + 0.5 * ray / ray.norm(dim=-1, keepdim=True)).movedim(-1, 0)


@pytest.mark.parametrize("px_per_metre", [20.0, 100.0])
def test_a_smooth_panorama_is_reprojected_exactly(
    room: Scene, smooth_panorama: torch.Tensor, px_per_metre: float
) -> None:
    for surface in room_surfaces(room.layout):
        plane = texture_plane(surface, room.layout)
        picture = reproject(halvings(smooth_panorama), plane, room, px_per_metre)
        columns, rows = plane.size_px(px_per_metre)
        assert picture.shape == (3, rows, columns)
        wanted = colour_of(plane.texels(columns, rows), room.panorama.camera_height)
        # seam behind the camera, pole below and above it: all within half a level of 8 bits
        assert float((picture - wanted).abs().max()) < 2e-3


def test_texture_coordinates_find_the_texel_of_a_place(
    room: Scene, smooth_panorama: torch.Tensor, turned_room
) -> None:
    for scene in (room, turned_room(0.6)):
        for surface in room_surfaces(scene.layout):
            plane = texture_plane(surface, scene.layout)
            uv = plane.texture_uv(surface.vertices)
            assert float(uv.min()) > -1e-6
            assert float(uv.max()) < 1 + 1e-6
            across, down = uv[:, :1], uv[:, 1:]
            place = plane.origin + across * plane.right + down * plane.down
            assert torch.allclose(place, surface.vertices.double(), atol=1e-5)


def test_pictures_are_not_mirrored(room: Scene) -> None:
    for surface in room_surfaces(room.layout):
        plane = texture_plane(surface, room.layout)
        a, b, c = surface.vertices.double()[surface.faces[0]]
        normal = torch.linalg.cross(b - a, c - a)
        # seen from the side that the normal points to, down is to the right of right
        assert float(torch.linalg.cross(plane.right, plane.down) @ normal) < 0


def test_what_other_walls_hide_is_flat(smooth_panorama: torch.Tensor, room: Scene) -> None:
    # an L: the camera stands in one arm, and the far end of the other arm is out of sight
    corners = torch.tensor([[-1.0, -1], [1, -1], [1, 4], [6, 4], [6, 6], [-1, 6]])
    scene = replace(room, layout=Layout(corners))
    surfaces = {surface.name: surface for surface in room_surfaces(scene.layout)}
    levels = halvings(smooth_panorama)

    def picture(name: str) -> torch.Tensor:
        return reproject(levels, texture_plane(surfaces[name], scene.layout), scene, 32.0)

    hidden = picture("wall-2")  # from (1, 4) to (6, 4), all of it behind the corner
    assert float((hidden - hidden[:, :1, :1]).abs().max()) < 1e-6
    part = picture("wall-4")  # from (6, 6) to (-1, 6): seen up to x = 1.5
    spread = part.std(dim=1).amax(dim=0)
    # right of the picture is where the wall begins
    columns = part.shape[-1]
    seen = spread > 1e-4
    assert seen.float().mean() == pytest.approx(2.5 / 7, abs=0.02)
    assert bool(seen[: columns // 4].all())


def test_textures_in_the_file(room: Scene, smooth_panorama: torch.Tensor, tmp_path: Path) -> None:
    path = tmp_path / "room.glb"
    write_glb(room, path, image=smooth_panorama)
    container = read_container(path)
    document = container.document
    assert isinstance(document, dict)
    assert len(document["images"]) == 6
    for image in document["images"]:
        view = document["bufferViews"][image["bufferView"]]
        data = container.binary[view["byteOffset"] :][: view["byteLength"]]
        picture = Image.open(io.BytesIO(data))
        assert max(picture.size) <= 1024
        assert all(side & (side - 1) == 0 for side in picture.size)
    assert path.stat().st_size < 1_000_000


def test_jpeg_keeps_colours() -> None:
    picture = torch.tensor([0.2, 0.5, 0.9])[:, None, None].expand(3, 16, 32)
    back = np.asarray(Image.open(io.BytesIO(jpeg(picture)))) / 255
    assert back.shape == (16, 32, 3)
    assert np.abs(back - [0.2, 0.5, 0.9]).max() < 0.02
