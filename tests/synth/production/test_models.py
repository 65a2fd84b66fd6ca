"""Which models homes get, and doors that stand open."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from panoscene.synth.assets import ModelEntry, add_models
from panoscene.synth.homes import Home, Opening, Room
from panoscene.synth.models import PARAMETRIC_KINDS, make_model
from panoscene.synth.production import Models, add_parametric_models, entries_for
from panoscene.synth.production import _models as models_module
from panoscene.synth.production._doors import door_leaf, leaf_pose


def entry(identifier: str, category: str, split: str = "seen", sure: str = "high") -> ModelEntry:
    return ModelEntry.model_validate(
        {
            "id": identifier, "base": identifier, "category": category, "placement": "floor",
            "size": (1.0, 1.0, 1.0), "confidence": sure, "faces": 12, "textured": False,
            "file": "models/x.npz", "sha256": "0" * 64, "split": split,
        }
    )  # fmt: skip


def test_parts_share_no_shape_where_there_are_enough() -> None:
    entries = [
        entry("a", "chair"), entry("b", "chair", "unseen"), entry("c", "guitar"),
        entry("d", ""), entry("e", "", "unseen"), entry("f", "chair", "seen", "low"),
        entry("g", "bed", "unseen", "low"),
    ]  # fmt: skip
    seen, unseen = entries_for(entries, "seen"), entries_for(entries, "unseen")
    assert list(seen) == ["a", "c", "d", "e"]
    assert list(unseen) == ["b", "c", "d", "e"]


def test_parametric_models_are_added_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(models_module, "PARAMETRIC_KINDS", PARAMETRIC_KINDS[:2])
    assert add_parametric_models(tmp_path, 2) == 4
    assert add_parametric_models(tmp_path, 2) == 0
    assert add_parametric_models(tmp_path, 3) == 2
    models = Models(tmp_path, 0)
    assert len(models) == 6
    kind = PARAMETRIC_KINDS[0]
    made, kept = models[f"parametric/{kind}/1"], make_model(kind, 1, 0)
    np.testing.assert_allclose(made.vertices, kept.vertices)
    assert f"parametric/{kind}/3" not in models
    with pytest.raises(KeyError):
        models[f"parametric/{kind}/3"]


def test_a_cache_with_other_models_keeps_them(tmp_path: Path) -> None:
    own = replace(make_model("basket", 0, 0), id="mine/basket", base="mine/basket")
    add_models(tmp_path, [own])
    assert list(Models(tmp_path, 0)) == ["mine/basket"]
    np.testing.assert_allclose(Models(tmp_path, 0)["mine/basket"].vertices, own.vertices)


def test_cupboards_without_a_top_are_not_taken_but_shelves_have_boards(tmp_path: Path) -> None:
    made = make_model("bottom_cabinet_no_top", 3, 0)
    corners = made.vertices[made.faces]
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 1e-9
    high = corners[..., 2].mean(axis=1) > 0.8 * made.vertices[:, 2].max()
    faces, of = made.faces[~(up & high)], made.face_material[~(up & high)]
    open_ = replace(made, id="mine/open", base="mine/open", faces=faces, face_material=of)
    add_models(tmp_path, [made, open_, make_model("shelf", 1, 0)])
    models = Models(tmp_path, 0)
    assert "mine/open" in models
    assert list(models.entries_of("seen")) == [made.id, "parametric/shelf/1"]
    assert len(models.summaries("seen").boards["parametric/shelf/1"]) > 1


def home_with(opening: Opening) -> Home:
    room = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)])
    return Home(0, (Room("living", room, 2.6),), (opening,), (), wall_thickness=0.12)


@pytest.mark.parametrize("seed", range(4))
def test_a_leaf_is_a_door_without_its_frame(seed: int) -> None:
    door = make_model("door", seed, 0)
    leaf = door_leaf(door)
    assert leaf is not None
    assert 0.6 * door.size[0] < leaf.size[0] < door.size[0] - 0.03
    assert leaf.faces.max() == len(leaf.vertices) - 1
    low, high = leaf.vertices.min(axis=0), leaf.vertices.max(axis=0)
    np.testing.assert_allclose(low, -high, atol=1e-5)


@pytest.mark.parametrize("at_start", [True, False])
@pytest.mark.parametrize("swing", [0.3, 1.2, np.pi / 2])
def test_an_open_leaf_hangs_on_its_hinge_and_stands_in_the_room(
    at_start: bool, swing: float
) -> None:
    leaf = door_leaf(make_model("door", 0, 0))
    assert leaf is not None
    opening = Opening(
        kind="door", room=0, wall=0, start=1.0, width=0.9, bottom=0.0, top=2.05,
        hinge_at_start=at_start, swing=swing,
    )  # fmt: skip
    matrix = leaf_pose(home_with(opening), opening, leaf)
    placed = leaf.vertices.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    assert placed[:, 2].min() > 0
    assert placed[:, 2].max() < 2.05
    hinge = np.array([1.0 if at_start else 1.9, 0.0])
    reach = np.linalg.norm(placed[:, :2] - hinge, axis=1)
    assert reach.min() < 0.09
    assert 0.85 < reach.max() < 0.95
    # its far edge has turned by the swing, into the room
    far = placed[reach.argmax(), :2] - hinge
    assert far[1] > 0
    assert abs(np.arctan2(far[1], abs(far[0])) - swing) < 0.12


@pytest.mark.parametrize("at_start", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_an_open_leaf_is_not_mirrored_and_hangs_on_the_side_without_handles(
    seed: int, at_start: bool
) -> None:
    leaf = door_leaf(make_model("door", seed, 0))
    assert leaf is not None
    opening = Opening("door", 0, 0, 1.0, 0.9, 0.0, 2.05, swing=1.2, hinge_at_start=at_start)
    home = home_with(opening)
    pose = leaf_pose(home, opening, leaf)
    assert np.linalg.det(pose[:3, :3]) > 0
    polygon = home.rooms[0].polygon
    along = (polygon[1] - polygon[0]) / np.linalg.norm(polygon[1] - polygon[0])
    hinge = polygon[0] + along * (opening.start + (0.0 if at_start else opening.width))
    out = np.abs(leaf.vertices[:, 1])
    handles = leaf.vertices[out > 0.9 * out.max()] @ pose[:3, :3].T + pose[:3, 3]
    assert np.linalg.norm(handles[:, :2] - hinge, axis=1).min() > 0.5
