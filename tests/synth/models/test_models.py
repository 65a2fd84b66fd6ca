"""Parametric models: closed, upright, of real sizes, all different, enough of every category."""

import csv
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.resources import files

import jaxtyping
import numpy as np
import pytest

from panoscene.scene import CATEGORIES
from panoscene.synth.assets import CadModel
from panoscene.synth.models import DECORATION_KINDS, PARAMETRIC_KINDS, make_model
from panoscene.synth.models._catalogue import _DECORATION, _LABELLED, _made
from panoscene.synth.models._workshop import Workshop

SEEDS = range(2)
"""Looked at closely; the shapes of arrays are checked while the first one is made."""
ENOUGH = 8
"""Models that every category must have."""
# smallest and largest width, depth, height
SIZES = {
    "basket": ((0.2, 0.2, 0.1), (0.6, 0.6, 0.8)),
    "bathtub": ((1.4, 0.65, 0.45), (2.0, 1.0, 1.0)),
    "bench": ((0.8, 0.25, 0.35), (1.7, 0.7, 1.0)),
    "bottom_cabinet": ((0.3, 0.3, 0.5), (2.1, 0.75, 2.5)),
    "bottom_cabinet_no_top": ((0.25, 0.4, 0.6), (1.3, 0.7, 0.95)),
    "carpet": ((0.6, 0.5, 0.005), (3.2, 2.4, 0.03)),
    "chest": ((0.3, 0.3, 0.3), (1.4, 0.65, 1.4)),
    "coffee_machine": ((0.1, 0.2, 0.2), (0.4, 0.6, 0.5)),
    "console_table": ((0.7, 0.2, 0.6), (1.6, 0.5, 1.0)),
    "cooktop": ((0.25, 0.4, 0.008), (1.0, 0.6, 0.08)),
    "counter": ((1.1, 0.5, 0.75), (3.0, 1.2, 1.2)),
    "crib": ((1.0, 0.55, 0.7), (1.6, 0.85, 1.2)),
    "cushion": ((0.25, 0.08, 0.1), (0.65, 0.4, 0.6)),
    "dishwasher": ((0.4, 0.5, 0.75), (0.65, 0.75, 0.9)),
    "door": ((0.7, 0.08, 1.9), (1.2, 0.3, 2.3)),
    "dryer": ((0.55, 0.45, 0.8), (0.65, 0.75, 0.9)),
    "fence": ((0.8, 0.02, 0.6), (2.2, 0.7, 1.9)),
    "floor_lamp": ((0.15, 0.15, 1.1), (0.9, 1.5, 2.2)),
    "fridge": ((0.5, 0.5, 0.75), (1.0, 0.9, 2.1)),
    "grandfather_clock": ((0.35, 0.2, 1.5), (0.65, 0.4, 2.4)),
    "guitar": ((0.25, 0.2, 0.8), (0.5, 0.7, 1.2)),
    "heater": ((0.4, 0.05, 0.35), (1.6, 0.3, 0.9)),
    "laptop": ((0.25, 0.18, 0.15), (0.45, 0.45, 0.4)),
    "loudspeaker": ((0.12, 0.15, 0.2), (0.45, 0.5, 1.3)),
    "microwave": ((0.4, 0.28, 0.2), (0.6, 0.6, 0.36)),
    "mirror": ((0.3, 0.005, 0.3), (1.1, 0.06, 1.6)),
    "monitor": ((0.4, 0.1, 0.25), (0.8, 0.35, 0.65)),
    "office_chair": ((0.5, 0.5, 0.8), (0.8, 0.95, 1.6)),
    "oven": ((0.5, 0.5, 0.4), (0.65, 0.7, 0.65)),
    "piano": ((1.2, 0.3, 0.7), (1.7, 2.0, 1.9)),
    "picture": ((0.15, 0.01, 0.15), (1.4, 0.06, 1.2)),
    "pool_table": ((1.8, 1.0, 0.7), (2.8, 1.6, 0.95)),
    "range_hood": ((0.5, 0.4, 0.5), (1.0, 0.6, 1.1)),
    "shelf": ((0.4, 0.2, 0.7), (1.5, 0.5, 2.2)),
    "shower": ((0.7, 0.7, 1.8), (1.5, 1.2, 2.4)),
    "speaker_system": ((0.25, 0.08, 0.05), (1.2, 0.35, 0.4)),
    "standing_tv": ((0.45, 0.15, 0.35), (1.7, 0.6, 1.1)),
    "stool": ((0.25, 0.25, 0.3), (0.6, 0.6, 1.05)),
    "stove": ((0.45, 0.5, 0.8), (1.0, 0.8, 1.2)),
    "table_lamp": ((0.1, 0.1, 0.2), (0.5, 0.5, 0.7)),
    "toilet": ((0.3, 0.5, 0.65), (0.5, 0.85, 1.3)),
    "top_cabinet": ((0.35, 0.25, 0.3), (1.8, 0.5, 1.1)),
    "towel_rack": ((0.12, 0.03, 0.02), (0.9, 0.4, 1.3)),
    "trash_can": ((0.18, 0.18, 0.22), (0.45, 0.5, 0.95)),
    "treadmill": ((0.6, 1.3, 1.0), (1.0, 2.1, 1.7)),
    "wall_clock": ((0.15, 0.02, 0.15), (1.0, 0.1, 1.3)),
    "wall_mounted_tv": ((0.7, 0.05, 0.4), (1.7, 0.2, 1.1)),
    "washer": ((0.35, 0.45, 0.8), (0.75, 0.75, 1.1)),
    "window": ((0.5, 0.05, 0.8), (2.5, 0.35, 1.8)),
}


@contextmanager
def _unchecked() -> Iterator[None]:
    """Leave out the checks of array shapes, which take longer than the work itself."""
    jaxtyping.config.update("jaxtyping_disable", True)
    try:
        yield
    finally:
        jaxtyping.config.update("jaxtyping_disable", False)


@cache
def _models(kind: str) -> list[CadModel]:
    first = make_model(kind, SEEDS[0], texture_size=0)
    with _unchecked():
        return [first, *(make_model(kind, seed, texture_size=0) for seed in SEEDS[1:])]


def _design(kind: str, seed: int) -> tuple[int, tuple[float, ...]]:
    """Return the number of triangles of a model and its size in tenths of a millimetre."""
    shop = Workshop(np.random.default_rng([seed, *kind.encode()]), 0)
    (_LABELLED.get(kind) or _DECORATION[kind]).make(shop)
    pieces = [piece for piece, _, _ in shop._pieces]
    corners = np.concatenate([piece.vertices for piece in pieces])
    size = np.round(np.ptp(corners, axis=0), 4)
    return sum(len(piece.faces) for piece in pieces), tuple(size.tolist())


@cache
def _library_counts() -> Counter[str]:
    """Return how many models the libraries have of every category, the doubtful ones apart."""
    folder = files("panoscene.synth.assets")
    count: Counter[str] = Counter()
    with (folder / "sweethome3d.csv").open(encoding="utf-8") as file:
        count.update(r["category"] for r in csv.DictReader(file) if r["confidence"] != "low")
    with (folder / "sweethome3d_derived.csv").open(encoding="utf-8") as file:
        count.update(r["category"] for r in csv.DictReader(file))
    return count


def _open_edges(model: CadModel) -> int:
    """Return how many directed edges have no partner in the other direction."""
    raw = np.ascontiguousarray(model.vertices + 0.0).view("V12").reshape(-1)
    place = np.unique(raw, return_inverse=True)[1].reshape(-1)
    faces = place[model.faces].astype(np.int64)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    start, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    key = low * (place.max() + 1) + high
    _, inverse = np.unique(key, return_inverse=True)
    balance = np.bincount(inverse.reshape(-1), np.where(start < end, 1.0, -1.0))
    return int(np.abs(balance).sum())


@pytest.mark.parametrize("kind", PARAMETRIC_KINDS)
def test_pieces_are_closed_and_look_outwards(kind: str) -> None:
    for model in _models(kind):
        assert _open_edges(model) == 0
        a, b, c = (model.vertices[model.faces[:, k]].astype(np.float64) for k in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0.0
        normal = np.cross(b - a, c - a)
        agree = np.einsum("ij,ij->i", normal, model.normals[model.faces].mean(axis=1))
        area = np.linalg.norm(normal, axis=1)
        assert area[agree < 0.0].sum() < 0.003 * area.sum()


@pytest.mark.parametrize("kind", PARAMETRIC_KINDS)
def test_records_are_complete(kind: str) -> None:
    for model in _models(kind):
        assert model.category == ("" if kind in DECORATION_KINDS else kind)
        assert model.id == model.base
        for array in (model.vertices, model.normals, model.uv):
            assert np.isfinite(array).all()
        assert np.abs(model.uv).max() < 60.0
        np.testing.assert_allclose(np.linalg.norm(model.normals, axis=1), 1.0, atol=1e-4)
        extent = model.vertices.max(axis=0), model.vertices.min(axis=0)
        np.testing.assert_allclose(extent[0] + extent[1], 0.0, atol=1e-5)
        np.testing.assert_allclose(extent[0] - extent[1], model.size, atol=1e-5)
        assert model.face_material.max() < len(model.materials)
        assert len(model.materials) == len(np.unique(model.face_material)) <= 32
        assert len(model.faces) <= 20_000
        assert model.elevation >= 0.0
        if model.support_height is not None:
            assert 0.0 < model.support_height <= model.size[2] + 1e-5
        for lamp in model.lights:
            assert (np.abs(lamp.position) <= np.asarray(model.size) / 2 + 0.05).all()


@pytest.mark.parametrize("kind", SIZES)
def test_sizes_are_those_of_real_furniture(kind: str) -> None:
    low, high = SIZES[kind]
    for seed, model in enumerate(_models(kind)):
        size = model.size
        assert (np.asarray(size) >= low).all(), (seed, size)
        assert (np.asarray(size) <= high).all(), (seed, size)


def test_every_labelled_kind_has_a_size_check() -> None:
    assert set(PARAMETRIC_KINDS) - set(DECORATION_KINDS) <= set(SIZES)


@pytest.mark.parametrize("kind", PARAMETRIC_KINDS)
def test_designs_differ_pairwise(kind: str) -> None:
    """Eight of them, and some of what the libraries have enough of."""
    few = kind in _LABELLED and _library_counts()[kind] < ENOUGH
    with _unchecked():
        designs = [_design(kind, seed) for seed in range(ENOUGH if few else 4)]
    assert len(set(designs)) == len(designs)
    proportions = np.array([np.asarray(size) / max(size) for _, size in designs])
    topologies = {faces for faces, _ in designs}
    assert len(topologies) > 1 or np.ptp(proportions, axis=0).max() > 0.05


@pytest.mark.parametrize("kind", PARAMETRIC_KINDS)
def test_a_seed_gives_one_model(kind: str) -> None:
    one = _models(kind)[1]
    with _unchecked():
        two = _made.__wrapped__(kind, SEEDS[1], 0)
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.uv, two.uv)
    assert [m.name for m in one.materials] == [m.name for m in two.materials]
    assert all(m.texture is None for m in one.materials)


@pytest.mark.parametrize("kind", ["counter", "picture", "cushion", "bench"])
def test_the_size_of_textures_leaves_the_shape(kind: str) -> None:
    textured, plain = make_model(kind, 3, texture_size=16), make_model(kind, 3, texture_size=0)
    np.testing.assert_array_equal(textured.vertices, plain.vertices)
    assert any(m.texture is not None for m in textured.materials)


def _material_faces(model: CadModel, start: str) -> np.ndarray:
    chosen = [k for k, m in enumerate(model.materials) if m.name.startswith(start)]
    return model.faces[np.isin(model.face_material, chosen)]


@pytest.mark.parametrize(
    ("kind", "material"),
    [
        ("picture", "picture"), ("mirror", "mirror"), ("wall_clock", "dial"),
        ("grandfather_clock", "dial"), ("monitor", "screen"), ("standing_tv", "screen"),
        ("wall_mounted_tv", "screen"), ("laptop", "screen"), ("oven", "screen"),
        ("microwave", "screen"), ("piano", "ivory"), ("loudspeaker", "rubber"),
        ("treadmill", "screen"), ("guitar", "metal chrome"), ("socket", "plastic grey"),
    ],
)  # fmt: skip
def test_the_telling_part_is_at_the_front(kind: str, material: str) -> None:
    """Screens, dials, keys and the like lie in front of the model's middle and face +y."""
    for model in _models(kind):
        faces = _material_faces(model, material)
        assert len(faces), (kind, material)
        a, b, c = (model.vertices[faces[:, k]].astype(np.float64) for k in range(3))
        normal = np.cross(b - a, c - a)
        if kind not in ("piano", "guitar", "loudspeaker"):
            towards = np.clip(normal, 0.0, None).sum(axis=0)
            assert towards[1] > 0.5 * towards[2], kind
        if kind not in ("treadmill", "laptop", "guitar", "grandfather_clock", "monitor",
                        "standing_tv", "picture", "mirror"):  # fmt: skip
            assert a[:, 1].mean() > -0.1 * model.size[1], kind


@pytest.mark.parametrize(
    "kind", ["fridge", "dishwasher", "oven", "counter", "top_cabinet", "chest"]
)
def test_handles_are_on_the_front(kind: str) -> None:
    plated = ("metal chrome", "metal nickel", "metal brass", "metal black", "metal copper")
    found = 0
    for model in _models(kind):
        for name in plated:
            places = model.vertices[np.unique(_material_faces(model, name))]
            if len(places) and name not in model.materials[0].name:
                assert (places[:, 1] > 0.25 * model.size[1]).all()
                found += 1
    assert found


def test_pictures_are_not_mirrored() -> None:
    """u grows to the right of someone who looks at the front, towards the model's -x."""
    model = make_model("monitor", 0, texture_size=0)
    faces = _material_faces(model, "screen")
    vertices = np.unique(faces)
    flat = model.vertices[vertices, 1] > model.vertices[vertices, 1].max() - 1e-5
    x, z = model.vertices[vertices[flat], 0], model.vertices[vertices[flat], 2]
    uv = model.uv[vertices[flat]]
    assert np.corrcoef(x, uv[:, 0])[0, 1] < -0.99
    assert np.corrcoef(z, uv[:, 1])[0, 1] > 0.99


@pytest.mark.parametrize("kind", ["floor_lamp", "table_lamp", "ceiling_lamp"])
def test_lamps_glow(kind: str) -> None:
    for model in _models(kind):
        assert model.lights
        assert any(m.kind == "light" and m.emission > 0.0 for m in model.materials)


def test_glass_and_mirrors_are_marked() -> None:
    assert all(any(m.kind == "glass" for m in model.materials) for model in _models("window"))
    assert all(any(m.kind == "mirror" for m in model.materials) for model in _models("mirror"))
    assert all(any(m.kind == "glass" for m in model.materials) for model in _models("shower"))


def test_every_category_has_eight_models() -> None:
    """Library models of good confidence, derived ones, and eight seeds of the parametric kinds."""
    count = _library_counts() + Counter(dict.fromkeys(PARAMETRIC_KINDS, ENOUGH))
    assert len(CATEGORIES) == 57
    assert {c: count[c] for c in CATEGORIES if count[c] < ENOUGH} == {}


def test_wrong_arguments_are_named() -> None:
    with pytest.raises(ValueError, match="kind is 'spaceship'"):
        make_model("spaceship", 0)
    with pytest.raises(ValueError, match="seed is -3"):
        make_model("mirror", -3)
