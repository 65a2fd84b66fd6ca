import json
from collections.abc import Callable
from pathlib import Path

import jsonschema
import pytest

import panoscene.scene
from panoscene.scene import Scene, scene_json_schema, write_scene

PUBLISHED = Path(panoscene.scene.__file__).with_name("scene.schema.json")


def test_published_schema_is_up_to_date() -> None:
    """To renew it, write json.dumps(scene_json_schema(), indent=2) and a newline."""
    assert PUBLISHED.read_text() == json.dumps(scene_json_schema(), indent=2) + "\n"


def test_written_files_satisfy_the_schema(
    random_scene: Callable[..., Scene], bedroom: Scene, tmp_path: Path
) -> None:
    schema = json.loads(PUBLISHED.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for k, scene in enumerate([bedroom, random_scene(3, 3), random_scene(4, 0)]):
        write_scene(scene, tmp_path / f"{k}.json")
        validator.validate(json.loads((tmp_path / f"{k}.json").read_text()))


@pytest.mark.parametrize(
    "change",
    [
        {"version": 2},
        {"units": "feet"},
        {"extra": 1},
        {"objects": [{"category": "unicorn", "box": {"centre": [0, 0, 0], "size": [1, 1, 1]}}]},
        {"objects": [{"category": "bed", "box": {"centre": [0, 0, 0], "size": [1, 0, 1]}}]},
        {"layout": {"floor_polygon": [[0, 0], [1, 0]]}},
    ],
)
def test_schema_refuses_what_a_schema_can_see(
    bedroom: Scene, tmp_path: Path, change: dict[str, object]
) -> None:
    write_scene(bedroom, tmp_path / "scene.json")
    document = json.loads((tmp_path / "scene.json").read_text()) | change
    validator = jsonschema.Draft202012Validator(scene_json_schema())
    assert not validator.is_valid(document)


def test_every_field_is_described_or_named_after_a_described_record() -> None:
    schema = scene_json_schema()
    for name, definition in [("scene", schema), *schema["$defs"].items()]:
        assert definition["description"], name
        assert definition["additionalProperties"] is False, name
