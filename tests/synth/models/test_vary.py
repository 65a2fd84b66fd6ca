"""Variation: another size and look, the same shape, base and meaning."""

import numpy as np
import pytest

from panoscene.synth.assets import CadModel, Material
from panoscene.synth.models import (
    PARAMETRIC_KINDS,
    make_model,
    scale_model,
    size_jitter_of,
    vary_model,
)


def _library_model(category: str, materials: tuple[Material, ...]) -> CadModel:
    """Return a box as a library might hold it: no useful uv, plain colours."""
    corner = np.array([[(k >> b) & 1 for b in range(3)] for k in range(8)]) - 0.5
    faces = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3],
             [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]  # fmt: skip
    vertices = (corner * (2.0, 0.9, 0.8)).astype(np.float32)
    return CadModel(
        id="sweethome3d/Test/1", base="sweethome3d/Test/1", category=category, vertices=vertices,
        normals=(vertices / np.linalg.norm(vertices, axis=1, keepdims=True)).astype(np.float32),
        uv=np.zeros((8, 2), np.float32), faces=np.array(faces, np.int32),
        face_material=(np.arange(12) % len(materials)).astype(np.int16), materials=materials,
        size=(2.0, 0.9, 0.8),
    )  # fmt: skip


@pytest.mark.parametrize("kind", PARAMETRIC_KINDS)
def test_copies_keep_base_category_and_shape(kind: str) -> None:
    model = make_model(kind, 0, texture_size=0)
    copy = vary_model(model, np.random.default_rng(4), texture_size=0)
    assert copy.base == model.base
    assert copy.id != model.id
    assert (copy.category, copy.placement) == (model.category, model.placement)
    jitter = size_jitter_of(model.category)
    ratio = np.divide(copy.size, model.size)
    assert (np.abs(ratio - 1.0) <= jitter + 1e-6).all()
    np.testing.assert_allclose(np.ptp(copy.vertices, axis=0), copy.size, rtol=1e-4)
    assert len(copy.faces) == len(model.faces)
    assert np.isfinite(copy.uv).all()
    assert [m.kind for m in copy.materials] == [m.kind for m in model.materials]
    assert copy.faces.max() < len(copy.vertices) == len(copy.uv) == len(copy.normals)


def test_the_same_generator_gives_the_same_copy() -> None:
    model = make_model("chest", 2, texture_size=16)
    one, two = (vary_model(model, np.random.default_rng(9), texture_size=16) for _ in range(2))
    np.testing.assert_array_equal(one.vertices, two.vertices)
    assert one.id == two.id
    assert [m.colour for m in one.materials] == [m.colour for m in two.materials]


def test_copies_look_different() -> None:
    model = make_model("counter", 0, texture_size=0)
    looks = {
        tuple(m.colour for m in vary_model(model, np.random.default_rng(s), 0.0, 0).materials)
        for s in range(10)
    }
    assert len(looks) >= 8


def test_no_jitter_keeps_the_size() -> None:
    model = make_model("fridge", 0, texture_size=0)
    assert vary_model(model, np.random.default_rng(0), 0.0, 0).size == pytest.approx(model.size)


def test_glass_mirrors_and_lamps_stay() -> None:
    for kind in ("window", "mirror", "floor_lamp"):
        model = make_model(kind, 0, texture_size=0)
        copy = vary_model(model, np.random.default_rng(1), texture_size=0)
        for old, new in zip(model.materials, copy.materials, strict=True):
            if old.kind != "opaque":
                assert new is old


def test_plain_library_cloth_and_wood_get_textures() -> None:
    brown, grey = Material("flblonde", (0.75, 0.5, 0.25)), Material("lightgray", (0.7, 0.7, 0.7))
    table = vary_model(_library_model("table", (brown,)), np.random.default_rng(0), 0.0, 64)
    assert table.materials[0].name.startswith("wood")
    texture = table.materials[0].texture
    assert texture is not None
    # one tile is 1.2 m: the top of 2 m is as many tiles long
    assert np.ptp(table.uv[np.unique(table.faces)], axis=0)[0] == pytest.approx(2.0 / 1.2, rel=1e-4)
    sofa = vary_model(_library_model("sofa", (grey,)), np.random.default_rng(0), 0.0, 64)
    assert sofa.materials[0].name.startswith("fabric")


def test_a_bed_of_wood_keeps_its_bedding_of_cloth() -> None:
    frame, mattress = Material("flyellow", (0.67, 0.47, 0.33)), Material("bone2", (0.9, 0.83, 0.74))
    bed = vary_model(_library_model("bed", (frame, mattress)), np.random.default_rng(0), 0.0, 64)
    assert [m.name.split(" ")[0] for m in bed.materials] == ["wood", "fabric"]


def test_retextured_parametric_models_keep_the_scale_of_their_cloth() -> None:
    model = make_model("cushion", 4, texture_size=16)
    for seed in range(6):
        copy = vary_model(model, np.random.default_rng(seed), 0.0, 16)
        for material in copy.materials:
            assert material.texture is not None or material.name.startswith("fabric piping")
        assert 0.2 < np.ptp(copy.uv, axis=0).max() < 4.0


def test_scaling_moves_lamps_and_supports() -> None:
    lamp = make_model("floor_lamp", 0, texture_size=0)
    tall = scale_model(lamp, (1.0, 1.0, 2.0))
    assert tall.size[2] == pytest.approx(2.0 * lamp.size[2])
    assert tall.lights[0].position[2] == pytest.approx(2.0 * lamp.lights[0].position[2])
    chest = make_model("chest", 0, texture_size=0)
    assert chest.support_height is not None
    assert scale_model(chest, (1.0, 1.0, 0.5)).support_height == pytest.approx(
        chest.support_height / 2
    )
    np.testing.assert_allclose(np.linalg.norm(tall.normals, axis=1), 1.0, atol=1e-5)


def test_wrong_arguments_are_named() -> None:
    model = make_model("mirror", 0, texture_size=0)
    with pytest.raises(ValueError, match="scale is"):
        scale_model(model, (1.0, 0.0, 1.0))
    with pytest.raises(ValueError, match=r"size_jitter is 0\.9"):
        vary_model(model, np.random.default_rng(0), 0.9)
