"""The model of the editor: every operation, its undo, and what it leaves alone."""

import dataclasses
import math
from collections.abc import Callable

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry import bfov_from_boxes
from panoscene.sample import sample_room_path
from panoscene.scene import (
    Mesh,
    Relations,
    Scene,
    Shapes,
    category_index,
    read_scene,
    relations_from_boxes,
    scene_to_json,
)
from panoscene.viewer import Editor, measure_scene

OPERATIONS: dict[str, Callable[[Editor], Editor]] = {
    "move": lambda e: e.place(e.names[0], centre=(0.1, -0.2, 0.4)),
    "turn": lambda e: e.place(e.names[-1], yaw=0.3),
    "resize": lambda e: e.place(e.names[0], size=(1.0, 0.5, 0.6)),
    "delete": lambda e: e.delete(e.names[0]),
    "duplicate": lambda e: e.duplicate(e.names[-1]),
    "categorise": lambda e: e.categorise(e.names[0], "sofa"),
    "solve": lambda e: e.solve(),
    "restart": lambda e: e.restart(),
}


def document(scene: Scene) -> dict[str, object]:
    """Return everything a scene says, for comparison bit for bit."""
    return scene_to_json(scene)


def relations_of(scene: Scene) -> Relations:
    assert scene.relations is not None
    return scene.relations


@settings(max_examples=8)
@given(st.lists(st.sampled_from(sorted(OPERATIONS)), min_size=1, max_size=5))
def test_undo_returns_every_state_exactly_and_redo_repeats_it(steps: list[str]) -> None:
    editor = Editor.open(read_scene(sample_room_path()))
    start, states = document(editor.scene), [editor.scene]
    for step in steps:
        changed = OPERATIONS[step](editor)
        if changed.scene is not editor.scene:
            states.append(changed.scene)
        editor = changed
    end, backward = document(editor.scene), [editor.scene]
    while editor.past:
        editor = editor.undo()
        backward.append(editor.scene)
    assert [id(scene) for scene in backward] == [id(scene) for scene in states[::-1]]
    assert editor.undo() is editor
    # no operation wrote into the tensors of an earlier state
    assert document(editor.scene) == start
    while editor.future:
        editor = editor.redo()
    assert document(editor.scene) == end
    assert editor.redo() is editor


def test_opening_names_objects_and_derives_relations(colliding: Scene) -> None:
    bare = dataclasses.replace(
        colliding, relations=None, objects=dataclasses.replace(colliding.objects, id=())
    )
    editor = Editor.open(bare)
    assert editor.names == ("table-0", "chair-1", "plant-2")
    assert relations_of(editor.scene).on_floor.tolist() == [1.0, 1.0, 1.0]
    assert bare.relations is None


def test_given_relations_are_kept_as_they_are(colliding: Scene) -> None:
    assert Editor.open(colliding).scene.relations is colliding.relations


def test_moving_changes_one_box_and_what_the_photo_would_show(colliding: Scene) -> None:
    editor = Editor.open(colliding).place("chair-0", centre=(-1.0, -1.0, 0.45), yaw=math.pi)
    old, new = colliding.objects, editor.scene.objects
    assert new.boxes.centre[1].tolist() == pytest.approx([-1.0, -1.0, 0.45])
    assert float(new.boxes.yaw[1]) == pytest.approx(-math.pi)
    assert torch.equal(new.boxes.size, old.boxes.size)
    for k in (0, 2):
        assert torch.equal(new.boxes.centre[k], old.boxes.centre[k])
        assert torch.equal(new.bfov[k], old.bfov[k])
    assert torch.allclose(new.bfov[1], bfov_from_boxes(new.boxes[1], 1.6))
    assert editor.state.action == "moved and turned chair-0"


def test_relations_are_renewed_for_the_moved_object_only(colliding: Scene) -> None:
    given = relations_of(colliding)
    # somebody says that plant and table touch, though they are far apart
    touching = given.touching.clone()
    touching[0, 2] = touching[2, 0] = 1.0
    scene = dataclasses.replace(colliding, relations=dataclasses.replace(given, touching=touching))
    moved = Editor.open(scene).place("chair-0", centre=(-1.7, 0.0, 0.45))
    after, derived = (
        relations_of(moved.scene),
        relations_from_boxes(moved.scene.objects.boxes, scene.layout, inside="any_corner"),
    )
    assert after.touching[0, 2] == after.touching[2, 0] == 1.0
    assert derived.touching[0, 2] == 0.0
    assert after.touching[1].tolist() == after.touching[:, 1].tolist() == [0.0, 0.0, 0.0]
    assert given.touching[0, 1] == 1.0
    assert after.touching_wall[1].tolist() == [0.0, 0.0, 0.0, 1.0]
    assert torch.equal(after.relative_yaw[1], derived.relative_yaw[1])
    assert torch.equal(after.touching_wall[0], given.touching_wall[0])


def test_deleting_keeps_the_relations_of_the_others(disturbed: Scene) -> None:
    editor = Editor.open(disturbed)
    gone = 4
    after = editor.delete(editor.names[gone])
    rest = [k for k in range(len(editor.names)) if k != gone]
    assert after.names == tuple(editor.names[k] for k in rest)
    old, new = relations_of(editor.scene), relations_of(after.scene)
    for field in dataclasses.fields(Relations):
        before = getattr(old, field.name)[rest]
        if field.name in ("touching", "farther_than", "relative_yaw"):
            before = before[:, rest]
        assert torch.equal(getattr(new, field.name), before), field.name
    assert torch.equal(after.scene.objects.bfov, disturbed.objects.bfov[rest])


def test_shapes_follow_their_objects(colliding: Scene) -> None:
    meshes = tuple(Mesh(torch.full((3, 3), k / 10), torch.tensor([[0, 1, 2]])) for k in range(3))
    shapes = Shapes(torch.arange(6.0).reshape(3, 2), meshes)
    objects = dataclasses.replace(colliding.objects, shapes=shapes)
    editor = Editor.open(dataclasses.replace(colliding, objects=objects))
    changed = editor.delete("table-0").duplicate("plant-0").scene.objects
    assert changed.id == ("chair-0", "plant-0", "plant-1")
    assert changed.shapes.mesh == (meshes[1], meshes[2], meshes[2])
    assert changed.shapes.code is not None
    assert changed.shapes.code.tolist() == [[2.0, 3.0], [4.0, 5.0], [4.0, 5.0]]


def test_a_duplicate_stands_beside_and_inside(colliding: Scene) -> None:
    editor = Editor.open(colliding).duplicate("plant-0")
    boxes = editor.scene.objects.boxes
    # to its right is the wall
    assert boxes.centre[3].tolist() == pytest.approx([1.2, 1.7, 0.5])
    assert torch.equal(boxes.size[3], boxes.size[2])
    assert relations_of(editor.scene).touching.shape == (4, 4)
    assert float(relations_of(editor.scene).touching[3, 3]) == 0.0


def test_names_are_never_used_twice(colliding: Scene) -> None:
    editor = Editor.open(colliding).delete("plant-0")
    editor = editor.duplicate("chair-0").duplicate("chair-0")
    assert editor.names == ("table-0", "chair-0", "chair-1", "chair-2")
    # the name of a deleted object stays its own, undo may bring it back
    assert Editor.open(colliding).duplicate("plant-0").names[-1] == "plant-1"


def test_categories_change(colliding: Scene) -> None:
    editor = Editor.open(colliding)
    changed = editor.categorise("chair-0", "stool")
    assert int(changed.scene.objects.category[1]) == category_index("stool")
    assert editor.categorise("chair-0", "chair") is editor


def test_a_drag_is_undone_as_one(colliding: Scene) -> None:
    editor = Editor.open(colliding)
    for step in range(5):
        editor = editor.place("chair-0", centre=(0.1 * step, -1.0, 0.45), gesture="drag 1")
    editor = editor.place("chair-0", centre=(0.0, -1.5, 0.45), gesture="drag 2")
    assert len(editor.past) == 2
    assert editor.undo().undo().scene is editor.opened
    again = editor.undo().place("chair-0", yaw=1.0, gesture="drag 2")
    assert len(again.past) == 2
    assert again.future == ()


def test_what_changes_nothing_is_no_step(colliding: Scene) -> None:
    editor = Editor.open(colliding)
    box = colliding.objects.boxes[1]
    same = editor.place("chair-0", centre=box.centre.tolist(), yaw=float(box.yaw))
    assert same is editor
    assert editor.restart() is editor


def test_history_is_bounded(colliding: Scene) -> None:
    editor = Editor.open(colliding)
    for step in range(250):
        editor = editor.categorise("plant-0", "stool" if step % 2 else "chest")
    assert len(editor.past) == 200


@pytest.mark.parametrize("preset", ["default", "released", "paper"])
def test_solving_carries_its_certificate(colliding: Scene, preset: str) -> None:
    editor = Editor.open(colliding).solve(preset)
    assert editor.state.certificate is not None
    assert editor.state.certificate.preset == preset
    assert editor.undo().state.certificate is None


@pytest.mark.parametrize("seed", range(4))
def test_solving_is_never_worse(disturbed: Scene, seed: int) -> None:
    generator = torch.Generator().manual_seed(seed)
    editor = Editor.open(disturbed)
    for _ in range(3):
        name = editor.names[int(torch.randint(len(editor.names), (), generator=generator))]
        x, y = (torch.rand(2, generator=generator) * 3 - 1.5).tolist()
        editor = editor.place(name, centre=(x, y, 0.5), yaw=x)
    before = measure_scene(editor.scene).violations
    after = measure_scene(editor.solve().scene).violations
    assert after.colliding_pairs <= before.colliding_pairs
    for field in ("worst_penetration", "total_penetration", "worst_out_of_room",
                  "out_of_room_volume"):  # fmt: skip
        assert getattr(after, field) <= getattr(before, field) + 1e-4, field


def test_solving_clears_a_collision(colliding: Scene) -> None:
    editor = Editor.open(colliding)
    assert measure_scene(editor.scene).violations.colliding_pairs == 1
    solved = editor.solve()
    assert measure_scene(solved.scene).violations.colliding_pairs == 0
    assert solved.scene.relations is editor.scene.relations


def test_a_cushion_in_a_sofa_is_no_trouble(colliding: Scene) -> None:
    assert float(measure_scene(colliding).trouble[0]) > 0.15
    category = colliding.objects.category.clone()
    category[:2] = torch.tensor([category_index(name) for name in ("sofa", "cushion")])
    objects = dataclasses.replace(colliding.objects, category=category)
    found = measure_scene(dataclasses.replace(colliding, objects=objects))
    assert not found.overlaps
    assert float(found.trouble[0]) == 0
    assert found.violations.colliding_pairs == 1


def test_a_solve_that_changes_nothing_is_no_step(empty: Scene) -> None:
    editor = Editor.open(empty).solve()
    assert editor.state.certificate is not None
    assert editor.past == ()


def test_the_last_object_can_be_deleted(colliding: Scene) -> None:
    editor = Editor.open(colliding)
    for name in editor.names:
        editor = editor.delete(name)
    assert editor.names == ()
    found = measure_scene(editor.scene)
    assert found.violations.colliding_pairs == 0
    assert found.trouble.shape == (0,)
    assert editor.undo().names == ("plant-0",)
    assert editor.undo().undo().undo().scene is editor.opened


@pytest.mark.parametrize(
    ("operation", "message"),
    [
        (lambda e: e.place("nobody", yaw=0.0), "name: found 'nobody'"),
        (lambda e: e.delete("nobody"), "name: found 'nobody'"),
        (lambda e: e.place("chair-0", centre=(0.0, math.nan, 0.0)), "centre: found"),
        (lambda e: e.place("chair-0", size=(1.0, 0.0, 1.0)), "size: found"),
        (lambda e: e.place("chair-0", yaw=math.inf), "yaw: found"),
        (lambda e: e.categorise("chair-0", "chiar"), "did you mean 'chair'"),
        (lambda e: e.solve("best"), "preset: found 'best'"),
    ],
)
def test_what_is_not_possible_says_so(
    colliding: Scene, operation: Callable[[Editor], Editor], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        operation(Editor.open(colliding))
