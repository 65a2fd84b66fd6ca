"""The data card of a set: what a user has to know, in Markdown."""

from pathlib import Path
from typing import Any

from panoscene.scene import write_atomically
from panoscene.style import GROUPS, words

from ._format import SPLITS
from ._index import ATTRIBUTION, read_index
from ._maps import ALBEDO, DISTANCE, GLB, INSTANCE, LABELS, NORMAL, SCENE, SEMANTIC
from ._read import open_dataset
from ._statistics import dataset_statistics

CARD = "README.md"
_PAPER_OBJECTS = 18


def data_card(root: Path | str, *, statistics: dict[str, Any] | None = None) -> str:
    """Return the data card of a rendered set in Markdown.

    Args:
        root: Folder of the set.
        statistics: What ``dataset_statistics`` returned; computed when not given.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    index = read_index(root)
    found = statistics or dataset_statistics(root)
    parts = [
        f"# {index.name}",
        f"{found['panoramas']} of {found['planned']} panoramas of {found['homes']} furnished "
        f"homes, made by `{index.generator}` with seed {index.recipe.seed}. Everything is "
        "synthetic: floor plans, furniture, light and labels; nobody's home is shown.",
        "## Parts",
        _table(
            ("part", "homes", "panoramas"),
            [(split, found["homes_in_splits"][split], found["splits"][split]) for split in SPLITS],
        ),
        "The split is by home. Homes of test-unseen are furnished with models whose base no other "
        "home has, as far as a category has enough of them "
        f"({found['bases_only_in_test_unseen']} such bases are seen there).",
        "## Rooms",
        _table(
            ("corners", "panoramas", "share"),
            [
                (count, number, _share(number, found["panoramas"]))
                for count, number in found["corner_counts"].items()
            ],
        ),
        _spread_table(found),
        _table(("room", "panoramas"), list(found["room_kinds"].items())),
        _table(("light", "panoramas"), list(found["lights"].items())),
        "## Objects",
        f"{found['visible_objects_mean']:g} visible objects a panorama (the paper: about "
        f"{_PAPER_OBJECTS}); {found['left_out_mean']:g} more are too small or too hidden for "
        "scene.json and are listed in labels.json.",
        _category_table(found),
        "## Occlusion",
        _table(
            ("hidden part of the mesh", "share of objects"),
            [(name, f"{share:.1%}") for name, share in found["occlusion_shares"].items()],
        ),
        "## Relations",
        _relation_table(found["relations"]),
        "## Files",
        _files(root),
        "## Credits",
        f"The models' makers are named in `{ATTRIBUTION}`; their licences ask that this goes with "
        "every copy of the pictures.",
    ]
    return "\n\n".join(parts) + "\n"


def write_data_card(root: Path | str) -> Path:
    """Write the data card as README.md of the set and return its path.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    path = Path(root) / CARD
    write_atomically(path, data_card(root))
    return path


_FILES = {
    "rgb.jpg": "the photo, equirectangular",
    "rgb.png": "the photo, equirectangular",
    SCENE: "layout of the camera's room, objects, relations (panoscene's scene format)",
    LABELS: "camera, models and their places, visible and amodal BFoVs, occlusion, hashes",
    DISTANCE: "16 bits: millimetres along the ray, 0 where there is nothing",
    INSTANCE: "16 bits: the ids in `labels.json`, 0 where there is nothing",
    SEMANTIC: "8 bits: 57 categories, 57 floor, 58 wall, 59 ceiling, 255 not labelled",
    GLB: "the room and its objects as a model, coloured by groups, at most about 4,000 triangles "
    "each",
    NORMAL: "8 bits a channel: x, y, z in the photo's frame, `(value - 128) / 127`",
    ALBEDO: "the colour of the surfaces without light",
}
"""What the files of a panorama are."""


def _files(root: Path | str) -> str:
    """Return which files a panorama has; those that not every set has are looked for."""
    folders = [item.folder for item in open_dataset(root)[:1]]
    always = ("rgb.jpg", SCENE, LABELS, DISTANCE, INSTANCE, SEMANTIC)
    there = [name for name in _FILES if any((folder / name).is_file() for folder in folders)]
    rows = [(f"`{name}`", _FILES[name]) for name in there or always]
    return f"""\
One folder a panorama in `panoramas/`:

{_table(("file", "what"), rows)}

World frame of a panorama: metres, +z up, origin on the floor under the camera, +y under the
picture's centre column. `dataset.json` has the frozen split and the hashes."""


def _category_table(found: dict[str, Any]) -> str:
    rows = [
        (group, words(category), found["categories"][category], found["models"][category])
        for group, members in GROUPS.items()
        for category in members
    ]
    return _table(("group", "category", "objects", "different models"), rows)


def _spread_table(found: dict[str, Any]) -> str:
    names = (
        ("room_area", "floor area, m2"), ("ceiling_height", "ceiling, m"),
        ("camera_height", "camera height, m"), ("tilt_deg", "tilt of the camera, degrees"),
        ("object_distance", "distance of objects, m"), ("visible_objects", "visible objects"),
    )  # fmt: skip
    keys = ("mean", "min", "q25", "median", "q75", "max")
    rows = [(words, *(f"{found[name][key]:g}" for key in keys)) for name, words in names]
    return _table(("", "mean", "least", "25 %", "median", "75 %", "most"), rows)


def _relation_table(relations: dict[str, Any]) -> str:
    rows = [
        ("pairs that touch, a panorama", relations["touching"]),
        ("of those, meshes within 10 cm", f"{relations['mesh_contact_share']:.1%}"),
        ("contacts with walls, a panorama", relations["touching_wall"]),
        ("objects on the floor", f"{relations['on_floor_share']:.1%}"),
        ("objects under the ceiling, a panorama", relations["under_ceiling"]),
        ("objects inside the camera's room", f"{relations['inside_room_share']:.1%}"),
    ]
    rows += [
        (f"pairs turned by {name} degrees", f"{share:.1%}")
        for name, share in relations["relative_yaw_deg_share"].items()
    ]
    return _table(("relation", "how often"), rows)


def _share(part: int, whole: int) -> str:
    return f"{part / max(whole, 1):.0%}"


def _table(head: tuple[str, ...], rows: list[tuple[Any, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
