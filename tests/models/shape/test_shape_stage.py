"""Surfaces of fields, and the stage from photo to shapes."""

import math
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
import torch
import trimesh
from torch import Tensor

from panoscene.geometry import OrientedBoxes, bfov_from_boxes
from panoscene.models import CheckpointError, WeightsHeader, read_weights, write_weights
from panoscene.models.shape import (
    CONFIGS,
    ShapeConfig,
    ShapeNetwork,
    ShapeStage,
    build_shape,
    extract_meshes,
    load_shape_stage,
    thin_boxes,
)
from panoscene.models.shape._extract import _level
from panoscene.models.shape._threads import alone
from panoscene.scene import (
    CATEGORIES,
    Layout,
    Mesh,
    Objects,
    Panorama,
    Scene,
    box_mesh,
    read_scene,
    write_scene,
)

TINY = CONFIGS["compact"].model_copy(update={"features": 24, "hidden": 24, "crop": 64})
FITTED = TINY.model_copy(update={"frame": "longest"})


@pytest.fixture(name="network", scope="module")
def fixture_network() -> ShapeNetwork:
    return build_shape(TINY).eval()


@pytest.fixture(name="fitting", scope="module")
def fixture_fitting() -> ShapeNetwork:
    """Return a network whose shapes are fitted to their boxes, whatever they are."""
    return build_shape(FITTED).eval()


def ball_code(config: ShapeConfig, centre: tuple[float, float, float], loud: float = 1.0) -> Tensor:
    """Return the code of one round element of the last kind, which has no twin."""
    code = torch.zeros(1, config.elements, config.width)
    code[0, -1, 0] = loud
    code[0, -1, 1:4] = 2 * torch.tensor(centre)
    return code.reshape(1, -1)


def without_detail(network: ShapeNetwork) -> ShapeNetwork:
    with torch.no_grad():
        network.decoder.leave.weight.zero_()
        network.decoder.leave.bias.zero_()
    return network


def as_trimesh(mesh: Mesh | None) -> trimesh.Trimesh:
    assert mesh is not None
    return trimesh.Trimesh(mesh.vertices.numpy(), mesh.faces.numpy(), process=False)


@pytest.mark.parametrize("resolution", [32, 64, 128])
def test_one_gaussian_is_a_ball(fitting: ShapeNetwork, resolution: int) -> None:
    code = ball_code(TINY, (0.1, 0.0, -0.2))
    (mesh,) = extract_meshes(without_detail(fitting), code, resolution=resolution)
    found = as_trimesh(mesh)
    assert found.is_watertight
    assert found.is_winding_consistent
    # the ball fills its box; facing outwards its volume is positive
    assert found.volume == pytest.approx(math.pi / 6, rel=0.05 if resolution == 32 else 0.02)
    assert found.bounds == pytest.approx(torch.tensor([[-0.5] * 3, [0.5] * 3]).numpy())
    radius = torch.as_tensor(found.vertices).norm(dim=1)
    assert float((radius - 0.5).abs().max()) < 0.02


def test_the_surface_is_where_the_field_says(fitting: ShapeNetwork) -> None:
    fitting = without_detail(fitting)
    code = torch.cat((ball_code(TINY, (0.2, 0.1, 0.0)), ball_code(TINY, (0.0, 0.0, 0.0), 0.2)))
    code = code.reshape(2, TINY.elements, -1)
    code[0, -2, :4] = torch.tensor([0.8, -0.3, 0.2, 0.4])
    code = code.flatten(1)
    fine = extract_meshes(fitting, code, resolution=128)
    coarse = extract_meshes(fitting, code, resolution=64)
    for one, other in zip(fine, coarse, strict=True):
        first, second = as_trimesh(one), as_trimesh(other)
        assert first.is_watertight
        assert first.volume == pytest.approx(second.volume, rel=0.02)


@pytest.mark.parametrize("resolution", [32, 64, 128])
@pytest.mark.parametrize("most", [None, 600])
def test_the_box_cuts_off_what_reaches_beyond(
    network: ShapeNetwork, resolution: int, most: int | None
) -> None:
    # so loud that it fills the box and more
    code = ball_code(TINY, (0.1, 0.0, 0.0), 1e12)
    code[0, 4 - TINY.width : 7 - TINY.width] = 5.0
    network = without_detail(network)
    (mesh,) = extract_meshes(network, code, resolution=resolution, most=most)
    found = as_trimesh(mesh)
    assert found.is_watertight
    assert found.bounds == pytest.approx(torch.tensor([[-0.5] * 3, [0.5] * 3]).numpy())
    assert found.volume == pytest.approx(1, abs=0.5 / resolution)  # edges are cut by a cell
    # nothing that is beyond the box comes back as a skin on its sides
    code = ball_code(TINY, (0.9, 0.0, 0.0))
    field = network.field(network.elements(code), torch.tensor([[[0.9, 0.0, 0.0]]]))
    assert field.item() == pytest.approx(-1)
    assert extract_meshes(network, code, resolution=resolution, most=most) == (None,)


@pytest.mark.parametrize("resolution", [32, 64, 128])
def test_thin_boards_on_a_side_stay(network: ShapeNetwork, resolution: int) -> None:
    code = torch.zeros(1, TINY.elements, TINY.width)
    # two boards, 1.4 percent thick, at the floor and the top, and a post between them
    for k, height in enumerate((-0.5, 0.5)):
        code[0, 31 - k, :7] = torch.tensor([0.5, 0.0, 0.0, 2 * height, 6.0, 6.0, -3.0])
    code[0, 29, :7] = torch.tensor([1e3, 0.0, 0.0, 0.0, -1.6, -1.6, 6.0])
    network = without_detail(network)
    elements = network.elements(code.flatten(1))
    heights = torch.tensor([-0.5, -0.49, -0.47, 0.47, 0.49, 0.5])
    points = torch.stack((torch.full((6,), 0.15), torch.zeros(6), heights), 1)
    inside = network.field(elements, points[None])[0] < -0.07
    assert inside.tolist() == [True, True, False, False, True, True]
    (mesh,) = extract_meshes(network, code.flatten(1), resolution=resolution)
    found = as_trimesh(mesh)
    assert found.is_watertight
    assert found.bounds[:, 2] == pytest.approx([-0.5, 0.5])
    for side in (-0.5, 0.5):
        board = found.vertices[abs(found.vertices[:, 2] - side) < 0.04]
        assert board[:, 0].max() - board[:, 0].min() == pytest.approx(0.67, abs=0.03)


def test_shapes_come_in_order_and_empty_ones_are_none(fitting: ShapeNetwork) -> None:
    empty = torch.zeros(1, TINY.code)
    codes = torch.cat((empty, ball_code(TINY, (0.0, 0.0, 0.0)), empty))
    found = extract_meshes(fitting, codes, resolution=32)
    assert [mesh is None for mesh in found] == [True, False, True]
    assert extract_meshes(fitting, codes[:0], resolution=64) == ()


def test_crumbs_are_left_out(fitting: ShapeNetwork) -> None:
    code = ball_code(TINY, (0.2, 0.0, 0.0)).reshape(1, TINY.elements, -1)
    code[0, -2, :7] = torch.tensor([0.08, -0.9, 0.0, 0.0, -1.0, -1.0, -1.0])
    (mesh,) = extract_meshes(without_detail(fitting), code.flatten(1), resolution=64)
    assert as_trimesh(mesh).body_count == 1
    assert as_trimesh(mesh).volume == pytest.approx(math.pi / 6, rel=0.02)


def test_unsure_parts_come_back_where_the_box_says_so(network: ShapeNetwork) -> None:
    code = torch.zeros(1, TINY.elements, TINY.width)
    corners = torch.cartesian_prod(*[torch.tensor([-0.42, 0.42])] * 2)
    for k, (x, y) in enumerate(corners.tolist()):
        code[0, 31 - k, :4] = torch.tensor([0.4, 2 * x, 2 * y, -0.84])
    code[0, 27, :4] = torch.tensor([0.06, 0.0, 0.0, 0.84])  # never below -0.07
    (mesh,) = extract_meshes(without_detail(network), code.flatten(1), resolution=64)
    assert as_trimesh(mesh).body_count == 5
    # without it, nothing is stretched to fill the box
    code[0, 27, 0] = 0
    (mesh,) = extract_meshes(network, code.flatten(1), resolution=64)
    assert as_trimesh(mesh).body_count == 4
    assert as_trimesh(mesh).bounds[1, 2] < -0.15


def test_other_resolutions_are_refused(network: ShapeNetwork) -> None:
    with pytest.raises(ValueError, match="resolution: found 100"):
        extract_meshes(network, torch.zeros(1, TINY.code), resolution=100)


def objects(lons: list[float], sizes: list[list[float]]) -> Objects:
    lon = torch.tensor(lons)
    size = torch.tensor(sizes).reshape(-1, 3)
    centre = torch.stack((3 * lon.sin(), 3 * lon.cos(), size[:, 2] / 2), 1)
    boxes = OrientedBoxes(centre, size, torch.pi - lon)
    n = len(lons)
    ones = torch.ones(n)
    category = torch.arange(n) % len(CATEGORIES)
    return Objects(boxes, category, ones, bfov_from_boxes(boxes, 1.6), ones, ones)


def test_thin_things_do_not_vanish(network: ShapeNetwork, tmp_path: Path) -> None:
    stage = ShapeStage(without_detail(network))
    things = objects([0.0, 1.0, 2.0], [[0.6, 0.6, 0.9], [2.0, 1.5, 0.01], [0.8, 0.02, 0.6]])
    assert thin_boxes(things.boxes.size).tolist() == [False, True, True]
    image = torch.rand(3, 128, 256, generator=torch.Generator().manual_seed(0))
    shapes = stage(image, things, resolution=32)
    assert shapes.source[1:] == ("slab", "slab")
    assert shapes.source[0] in ("network", "box")
    assert shapes.code is not None
    assert shapes.code.shape == (3, TINY.code)
    for mesh in shapes.mesh:
        assert as_trimesh(mesh).is_watertight
        assert mesh is not None
        assert mesh.vertices.abs().max() == pytest.approx(0.5, abs=1e-6)
    things = replace(things, shapes=shapes)
    room = Layout(torch.tensor([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]))
    write_scene(Scene(Panorama(256, 128), room, things), tmp_path / "scene.json")
    assert read_scene(tmp_path / "scene.json").objects.shapes.source == shapes.source


def test_no_objects_have_no_shapes(network: ShapeNetwork) -> None:
    shapes = ShapeStage(network)(torch.rand(3, 64, 128), objects([], []))
    assert shapes.mesh == ()
    assert shapes.source == ()


def test_turning_the_panorama_changes_no_shape(network: ShapeNetwork) -> None:
    stage = ShapeStage(network)
    image = torch.rand(3, 128, 256, generator=torch.Generator().manual_seed(1))
    sizes = [[0.6, 0.6, 0.9], [1.0, 0.5, 0.7]]
    before = stage.codes(image, objects([0.2, -1.0], sizes))
    columns = 100
    turn = 2 * math.pi * columns / 256
    lons = [math.remainder(lon + turn, 2 * math.pi) for lon in (0.2, -1.0)]
    after = stage.codes(image.roll(columns, -1), objects(lons, sizes))
    torch.testing.assert_close(after, before, atol=2e-4, rtol=1e-3)


def test_the_number_of_threads_changes_nothing(network: ShapeNetwork) -> None:
    stage = ShapeStage(network)
    image = torch.rand(3, 64, 128, generator=torch.Generator().manual_seed(2))
    count = 23
    some = objects([0.25 * number for number in range(count)], [[0.7, 0.6, 0.9]] * count)
    threads = torch.get_num_threads()
    found = []
    try:
        for number in (1, 3):
            torch.set_num_threads(number)
            found.append(stage.codes(image, some))
            assert torch.get_num_threads() == number
    finally:
        torch.set_num_threads(threads)
    assert found[0].shape == (count, TINY.code)
    torch.testing.assert_close(found[0], found[1], atol=0, rtol=0)


def test_the_stage_is_the_network_without_norms(tmp_path: Path) -> None:
    network = build_shape(CONFIGS["compact"])
    image = torch.rand(3, 64, 128, generator=torch.Generator().manual_seed(3))
    generator = torch.Generator().manual_seed(4)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            assert module.running_mean is not None
            assert module.running_var is not None
            module.running_mean.uniform_(-0.1, 0.1, generator=generator)
            for numbers in (module.running_var, module.weight):
                torch.nn.init.uniform_(numbers, 0.8, 1.2, generator=generator)
            torch.nn.init.uniform_(module.bias, 0, 0.2, generator=generator)
    path = tmp_path / "shape.safetensors"
    write_weights(path, network, WeightsHeader(stage="shape", edition="compact"))
    stage = load_shape_stage("compact", path)
    assert not any(isinstance(part, torch.nn.BatchNorm2d) for part in stage.network.modules())
    some = objects([0.2, -1.0], [[0.6, 0.6, 0.9], [1.0, 0.5, 0.7]])
    read_weights(path, network, stage="shape", edition="compact")  # rounded as those of the stage
    plain = ShapeStage(network).codes(image, some)
    away = (stage.codes(image, some) - plain).abs().max()
    assert float(away) < 1e-4 * float(plain.std())


def test_weights_are_read_and_others_refused(network: ShapeNetwork, tmp_path: Path) -> None:
    path = tmp_path / "tiny.safetensors"
    write_weights(path, network, WeightsHeader(stage="shape", edition="compact"))
    with pytest.raises(CheckpointError, match="shape"):
        load_shape_stage("compact", path)
    with pytest.raises(CheckpointError, match="compact"):
        load_shape_stage("paper", path)
    assert box_mesh().faces.shape == (12, 3)


def test_crumbs_alone_are_no_solid() -> None:
    config, nodes = CONFIGS["compact"], 33
    values = torch.full((nodes, nodes, nodes), 0.05)
    values[2:-2:3, 2:-2:3, 2:-2:3] = -0.08  # each a crumb among hundreds, all over the box
    values[6:27, 6:27, 6:27] = values[6:27, 6:27, 6:27].clamp(max=-0.06)
    level, _, solid = _level(values, config)
    assert level > -0.06
    assert int((solid < 0).sum()) >= 21**3


def test_threads_that_work_alone_give_back_what_they_took() -> None:
    before, found, entered = torch.get_num_threads(), [], threading.Event()
    turn, turns = sys.getswitchinterval(), []

    def first() -> None:
        with alone() as threads:
            found.append(threads)
            entered.set()
            time.sleep(0.1)
        found.append(torch.get_num_threads())

    def second() -> None:
        entered.wait()
        with alone() as threads:
            found.append(threads)
            time.sleep(0.2)
            turns.append(sys.getswitchinterval())
        found.append(torch.get_num_threads())

    torch.set_num_threads(3)
    try:
        workers = [threading.Thread(target=work) for work in (first, second)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        later = threading.Thread(target=lambda: found.append(torch.get_num_threads()))
        later.start()
        later.join()
        assert found == [3] * 5
        assert torch.get_num_threads() == 3
        # the second one outlives the first, and has the short turns up to its end
        assert turns[0] < turn == sys.getswitchinterval()
    finally:
        torch.set_num_threads(before)
