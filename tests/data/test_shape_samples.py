"""What the shape network learns from: stores, pictures and samples."""

import math
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from panoscene.data._shape_crops import cut_object_crops, read_object_crops, write_object_crops
from panoscene.data._shape_renders import render_views
from panoscene.data._shape_samples import (
    Picture,
    collate_shapes,
    crop_picture,
    picture_view,
    read_seen_views,
    render_picture,
    seen_views,
    shape_sample,
    write_seen_views,
)
from panoscene.data._shape_store import (
    ModelShape,
    prepare_shape_store,
    read_model_shape,
    sampled_model,
    store_file,
)
from panoscene.scene import CATEGORIES
from panoscene.synth.assets import AssetError, CadModel, Material, add_models, load_library
from panoscene.synth.dataset import open_dataset

for package in ("skimage", "fast_simplification"):
    pytest.importorskip(package, reason="an optional package")

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"


def chair(red_right: bool = False) -> CadModel:
    """Return a seat with a back at -y: its front is +y. The right half may be red."""
    seat = trimesh.creation.box((0.5, 0.5, 0.3))
    back = trimesh.creation.box((0.5, 0.1, 0.6))
    back.apply_translation((0.0, -0.2, 0.45))
    mesh = trimesh.util.concatenate([seat, back])
    assert isinstance(mesh, trimesh.Trimesh)
    mesh = mesh.subdivide()
    vertices = mesh.vertices - (mesh.vertices.min(0) + mesh.vertices.max(0)) / 2
    right = (vertices[mesh.faces].mean(1)[:, 0] > 0) & red_right
    size = np.ptp(vertices, axis=0).tolist()
    return CadModel(
        id="test/chair",
        base="test/chair",
        category="chair",
        vertices=vertices.astype(np.float32),
        normals=np.zeros((len(vertices), 3), np.float32),
        uv=np.zeros((len(vertices), 2), np.float32),
        faces=np.asarray(mesh.faces, np.int32),
        face_material=right.astype(np.int16),
        materials=(Material("grey"), Material("red", (1.0, 0.0, 0.0))),
        size=(size[0], size[1], size[2]),
    )


@pytest.fixture(name="shape", scope="module")
def fixture_shape() -> ModelShape:
    rng = np.random.default_rng(0)
    return sampled_model(chair(), rng, render_views(chair(), rng, 2, 48))


def inside(points: np.ndarray) -> np.ndarray:
    """Return what is well inside of the chair, whose longest side is 0.9."""
    x, y, z = (points * 0.9).T
    seat = (np.abs(x) < 0.23) & (np.abs(y) < 0.23) & (z > -0.43) & (z < -0.17)
    back = (np.abs(x) < 0.23) & (y < -0.17) & (y > -0.23) & (np.abs(z) < 0.43)
    return seat | back


def test_signs_are_those_of_the_body(shape: ModelShape) -> None:
    assert shape.extent.tolist() == pytest.approx([0.5556, 0.5556, 1.0], abs=1e-3)
    for points in (shape.uniform, shape.near):
        assert (points[inside(points[:, :3]), 3] < 0).all()
        outside = (np.abs(points[:, :3]) > shape.extent / 2 + 0.02).any(1)
        assert (points[outside, 3] > 0).all()
    share = (shape.uniform[:, 3] < 0).mean()
    true = (0.5 * 0.5 * 0.3 + 0.5 * 0.1 * 0.6) / (0.5 * 0.5 * 0.9 * 1.2**3)
    assert share == pytest.approx(true, abs=0.01)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume * 0.9**3 == pytest.approx(0.5 * 0.5 * 0.3 + 0.5 * 0.1 * 0.6, rel=0.03)


def test_grid_is_x_first(shape: ModelShape) -> None:
    axis = np.linspace(-0.7, 0.7, 32)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    value = shape.grid.reshape(-1)
    assert (value[inside(nodes)] < 0).all()
    assert (value[(np.abs(nodes) > shape.extent / 2 + 0.02).any(1)] > 0).all()


def test_pictures_show_the_side_that_their_yaw_says() -> None:
    views = render_views(chair(red_right=True), np.random.default_rng(3), 12, 48)
    for image, alpha, yaw in zip(views.image, views.alpha, views.view_yaw, strict=True):
        theta = math.remainder(float(yaw), 2 * math.pi)
        red = (alpha > 0) & (image[..., 0] > 3 * image[..., 1].astype(int) + 5)
        grey = (alpha > 0) & ~red
        if min(red.sum(), grey.sum()) < 30 or abs(math.cos(theta)) < 0.5:
            continue
        # seen from its back, an object's right is on the right
        side = np.nonzero(red)[1].mean() - np.nonzero(grey)[1].mean()
        assert (side > 0) == (math.cos(theta) > 0)


def test_mirroring_mirrors_picture_shape_and_yaw(shape: ModelShape) -> None:
    background = np.zeros((58, 58, 3), np.uint8)
    picture = render_picture(shape, 0, 0.9, background)
    found = {}
    for seed in range(8):
        generator = torch.Generator().manual_seed(seed)
        view = picture_view(picture, generator, rows=32)
        sample = shape_sample(picture, shape, None, rows=32, points=500, frame="box", view=view)
        found[view.mirrored] = sample
        again = shape_sample(
            picture, shape, torch.Generator().manual_seed(seed), rows=32, points=50, frame="box"
        )
        twice = shape_sample(
            picture, shape, torch.Generator().manual_seed(seed), rows=32, points=50, frame="box"
        )
        assert torch.equal(again.crop, twice.crop)
        assert torch.equal(again.uniform, twice.uniform)
    plain, mirrored = found[False], found[True]
    torch.testing.assert_close(plain.hints[0], -mirrored.hints[0])
    assert torch.equal(plain.hints[1], mirrored.hints[1])
    mirror = torch.tensor([-1.0, 1.0, 1.0])
    assert torch.equal(plain.uniform * mirror, mirrored.uniform)
    assert torch.equal(plain.grid.flip(0), mirrored.grid)


@pytest.mark.parametrize("frame", ["box", "longest"])
def test_samples_are_in_the_frame_of_the_network(shape: ModelShape, frame: str) -> None:
    picture = render_picture(shape, 1, 0.9, np.zeros((58, 58, 3), np.uint8))
    assert picture.size.tolist() == pytest.approx([0.5, 0.5, 0.9], abs=0.01)
    sample = shape_sample(
        picture, shape, torch.Generator().manual_seed(0), rows=32, points=800,
        frame=frame,  # ty: ignore[invalid-argument-type]
    )  # fmt: skip
    reach = 0.5 if frame == "box" else 0.7
    assert float(sample.uniform.abs().max()) == pytest.approx(reach, abs=0.01)
    assert sample.category == CATEGORIES.index("chair")
    points = (sample.uniform * sample.stretch).numpy()
    if not sample.hints[0].isnan():
        outside = (np.abs(points) > shape.extent / 2 + 0.02).any(1)
        assert bool((sample.uniform_outside[torch.from_numpy(outside)] == 1).all())
    batch = collate_shapes([sample, sample])
    assert batch["crop"].shape == (2, 3, 32, 32)
    assert batch["grid"].shape == (2, 32, 32, 32)


def test_stores_hold_what_was_made_and_go_on(tmp_path: Path) -> None:
    add_models(tmp_path / "cache", [chair()])
    told: list[str] = []
    for _ in range(2):
        failed = prepare_shape_store(
            tmp_path / "cache", tmp_path / "store", ["test/chair"], views=1, progress=told.append
        )
        assert failed == ()
    assert told == ["test/chair"]
    library = load_library(tmp_path / "cache")
    shape = read_model_shape(store_file(tmp_path / "store", "test/chair"), library)
    assert np.array_equal(shape.uniform, library.shape("test/chair").uniform)
    assert shape.id == "test/chair"
    assert shape.image.shape == (1, 96, 96, 3)
    (tmp_path / "store" / "broken.npz").write_bytes(b"PK")
    with pytest.raises(AssetError, match=r"broken\.npz"):
        read_model_shape(tmp_path / "store" / "broken.npz", library)


def test_crops_of_panoramas(tmp_path: Path) -> None:
    dataset = open_dataset(SAMPLES)
    item = next(one for one in dataset if len(one.labels().objects) > 3)
    crops = cut_object_crops([item])
    assert len(crops.model) == len(crops.image) > 0
    write_object_crops(tmp_path / "crops.npz", crops)
    again = read_object_crops(tmp_path / "crops.npz")
    assert np.array_equal(again.image, crops.image)
    assert again.model.tolist() == crops.model.tolist()
    picture = crop_picture(again, 0)
    label = next(one for one in item.labels().objects if one.model == again.model[0])
    assert picture.size.tolist() == pytest.approx(label.box.size, abs=1e-5)
    assert isinstance(picture, Picture)
    with pytest.raises(AssetError):
        read_object_crops(tmp_path / "none.npz")


def test_what_a_backbone_sees_is_kept(tmp_path: Path, shape: ModelShape) -> None:
    picture = render_picture(shape, 0, 0.9, np.zeros((58, 58, 3), np.uint8))
    views = [
        picture_view(picture, torch.Generator().manual_seed(seed), rows=16) for seed in range(4)
    ]
    seen = seen_views(["a", "b"], torch.arange(12.0).reshape(4, 3), views)
    write_seen_views(
        tmp_path / "seen.safetensors",
        seen.with_more(seen_views(["c"], torch.zeros(2, 3), views[:2])),
    )
    again = read_seen_views(tmp_path / "seen.safetensors").chosen(["b", "a"])
    assert again.view(0, 1).crop.tolist() == [9.0, 10.0, 11.0]
    assert again.view(0, 1).mirrored == views[3].mirrored
    assert again.view(1, 0).window == pytest.approx(views[0].window)
