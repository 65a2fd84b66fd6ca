"""What is wrong with a scene, and how the panels say it."""

import dataclasses

import pytest
import torch

from panoscene.arrange import arrange
from panoscene.scene import Scene
from panoscene.viewer import Editor, measure_scene
from panoscene.viewer._tables import (
    certificate_text,
    plain,
    relations_table,
    trouble_list,
    turns_table,
    violations_table,
)


def test_violations_are_those_of_the_certificate(disturbed: Scene) -> None:
    found = measure_scene(disturbed)
    assert found.violations == arrange(disturbed, "default").certificate.before


def test_overlaps_name_pair_and_depth(colliding: Scene) -> None:
    found = measure_scene(colliding)
    assert [(o.first, o.second) for o in found.overlaps] == [(0, 1)]
    assert found.overlaps[0].depth == pytest.approx(0.2, abs=1e-5)
    assert found.trouble.tolist() == pytest.approx([0.2, 0.2, 0.0], abs=1e-5)


@pytest.mark.parametrize(
    ("centre", "depth"),
    [((1.9, 0.0, 0.5), 0.1), ((0.0, -1.0, 0.3), 0.2), ((0.0, -1.0, 2.2), 0.1)],
)
def test_outside_is_measured_at_walls_floor_and_ceiling(
    colliding: Scene, centre: tuple[float, float, float], depth: float
) -> None:
    editor = Editor.open(colliding).place("plant-0", centre=centre)
    assert float(measure_scene(editor.scene).outside[2]) == pytest.approx(depth, abs=1e-5)


def test_what_is_not_meant_to_be_inside_is_not_out_of_the_room(colliding: Scene) -> None:
    editor = Editor.open(colliding).place("plant-0", centre=(4.0, 0.0, 0.5))
    assert float(measure_scene(editor.scene).outside[2]) == 0.0


def test_worst_outside_agrees_with_the_certificate(disturbed: Scene) -> None:
    found = measure_scene(disturbed)
    assert float(found.outside.max()) == pytest.approx(found.violations.worst_out_of_room)
    assert max(o.depth for o in found.overlaps) == pytest.approx(found.violations.worst_penetration)


def test_tables_say_what_is_wrong(colliding: Scene) -> None:
    found = measure_scene(colliding)
    now = violations_table(found.violations, found.violations, ("Opened", "Now"))
    assert "| Colliding pairs | 1 | **1** |" in now
    assert "| Worst overlap, cm | 20.0 | **20.0** |" in now
    assert trouble_list(colliding, found) == "- table-0 and chair-0 overlap: 20 cm"
    solved = Editor.open(colliding).solve()
    certificate = solved.state.certificate
    assert certificate is not None
    text = certificate_text(certificate)
    assert "| Colliding pairs | 1 | **0** |" in text
    assert "preset default" in text
    assert trouble_list(solved.scene, measure_scene(solved.scene)).startswith("Nothing overlaps")


def test_relations_show_what_holds_and_what_is_wanted(colliding: Scene) -> None:
    editor = Editor.open(colliding)
    assert editor.scene.relations is not None
    relations = dataclasses.replace(
        editor.scene.relations,
        touching_wall=torch.tensor([[0.0] * 4, [0.0, 0.0, 0.0, 0.9], [0.0] * 4]),
    )
    editor = Editor.open(dataclasses.replace(colliding, relations=relations))
    table = relations_table(editor, "chair-0", measure_scene(editor.scene))
    assert "| touches table-0 | yes | yes |" in table
    assert "| stands on the floor | yes | yes |" in table
    assert "| **touches wall-3** | no | yes |" in table
    assert "plant" not in table


def test_turns_are_counter_clockwise_from_the_object(colliding: Scene) -> None:
    editor = Editor.open(colliding).place("chair-0", yaw=torch.pi / 2)
    table = turns_table(editor, "chair-0", measure_scene(editor.scene))
    # wall 0 is behind, its front looks along +y; the chair looks along -x
    assert "| wall-0 | -90° | |" in table
    assert "| table-0 | -90° | nearer |" in table or "| table-0 | -90° | farther |" in table
    assert "| plant-0 | -90° | farther |" in table


def test_names_cannot_become_markup() -> None:
    assert plain("a<b>|*c*_") == "a&#60;b&#62;&#124;&#42;c&#42;&#95;"
